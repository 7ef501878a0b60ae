"""The arm on paper: its numbers, kinematics, beam, the exact linear arm, the chain's design."""
