"""The closed loop: friction, trajectories, settings, the compiled run, its figures of merit."""
