"""Which model size, which step? `flexsim converge`."""
