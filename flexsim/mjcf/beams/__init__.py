"""Which beam a file stands for."""
