"""Do the models agree, rung by rung? `flexsim modes`, `flexsim crosscheck`."""
