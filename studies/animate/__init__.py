"""A closed loop to look at: both arms over the reference, moving or still."""
