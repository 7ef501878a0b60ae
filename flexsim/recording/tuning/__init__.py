"""Tunings recorded: their convergence as a file, their course in a viewer while they run."""
