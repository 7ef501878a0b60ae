"""What prints beside the files that programs read: tables in LaTeX and markdown."""
