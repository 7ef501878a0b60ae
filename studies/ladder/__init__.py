"""Fidelity against cost: `flexsim ladder`."""
