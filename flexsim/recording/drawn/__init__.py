"""What is drawn of an arm and how it deviates, as arrays of points; solids of an MJCF file."""
