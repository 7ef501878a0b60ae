"""What a file of others must be before it is an arm: its text, its size, its names, all checks."""
