"""What each misprint of the paper costs: `flexsim misprints`."""
