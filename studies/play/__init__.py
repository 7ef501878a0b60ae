"""The closed loop, live: both arms in MuJoCo's viewer, pushed, laden, retuned while they move."""
