"""What it takes for the paper's Table 2 to be bounded: `flexsim reconstruct`."""
