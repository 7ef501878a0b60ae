"""Which fractional filter serves best: `flexsim realisations`."""
