"""An arm whose link 1 bends as well, as plants: assumed modes of two beams, two chains."""
