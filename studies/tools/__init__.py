"""Single commands: drive, chain, filter, benchmark, view."""
