"""Machinery below any robot: compiling, MuJoCo's C functions, linear algebra, clocks, steps."""
