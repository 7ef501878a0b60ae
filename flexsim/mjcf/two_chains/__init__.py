"""An arm whose link 1 bends as well, as MJCF: two tuned chains, one behind the other."""
