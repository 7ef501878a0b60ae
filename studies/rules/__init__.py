"""Designs by rule on the plants: `flexsim rules`."""
