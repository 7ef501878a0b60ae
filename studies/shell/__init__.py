"""What a shell sees of the commands: their help, and the completion of their words."""
