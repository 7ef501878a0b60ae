"""What screening by stability saves the tuner: `flexsim screening`."""
