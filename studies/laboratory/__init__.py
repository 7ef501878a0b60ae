"""What made the paper's laboratory worse than its simulation: `flexsim laboratory`."""
