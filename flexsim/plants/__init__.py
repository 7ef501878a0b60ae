"""The models of the arm that a loop can run: one protocol, many plants."""
