"""Follow an MJCF file at every save: `flexsim watch`."""
