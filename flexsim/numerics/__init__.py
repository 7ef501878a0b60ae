"""Machinery below any robot: compiling, MuJoCo's C functions, clocks, steps, files."""
