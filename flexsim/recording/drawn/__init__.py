"""What is drawn of an arm and how it deviates, as arrays; solids of an MJCF file; states."""
