"""Runs as one file to read: tables, zoomable figures, differences, how to reproduce."""
