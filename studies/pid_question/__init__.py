"""Why the paper found no integer PID: `flexsim pid-question`."""
