"""A tuning as it goes: on the terminal, in the rerun viewer. Nothing here decides a result."""
