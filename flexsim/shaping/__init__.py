"""References made so that more follows than the loop alone would: feedforward, true tip."""
