"""Do the controllers behave the same on both models? `flexsim compare`."""
