"""A flexible beam for any robot: its tuned chain written into an MJCF file."""
