"""Frequencies and damping of a free decay alone: the matrix pencil, and its command."""
