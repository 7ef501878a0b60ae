"""Poles, margins and maps of the sampled loop: `flexsim stability`."""
