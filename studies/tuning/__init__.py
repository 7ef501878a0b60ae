"""The paper's genetic algorithm and its peers: `flexsim tune`."""
