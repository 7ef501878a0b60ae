"""Controllers of any linear kind: read by their type, and run in the compiled loop."""
