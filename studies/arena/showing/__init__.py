"""The arena in tables, figures and a sentence. Nothing here decides a result."""
