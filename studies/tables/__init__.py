"""The paper's Tables 2 and 3 and Figure 6 anew: `flexsim tables`."""
