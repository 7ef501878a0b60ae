"""What prints: tables in LaTeX, ticks that can be read."""
