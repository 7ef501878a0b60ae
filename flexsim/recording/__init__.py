"""Runs as rerun recordings, arranged when opened; the only room that knows rerun."""
