"""The headings of options in a command's help, in their order.

A class of options says in `PANEL` under which its options stand.
"""

MAIN = "What is run"
SEARCH = "Search"
FILE = "The file read"
SIZES = "Sizes, steps, repeats"
HARDWARE = "Sensors, computer, motors"
ROBOT = "Robot"
NUMBERS = "The robot by its numbers"
TRAJECTORIES = ("Trajectory line", "Trajectory two-loop", "Trajectory circle")
RUNNING = "How it runs"
OUTPUT = "Output"

HEADINGS = (MAIN, SEARCH, FILE, SIZES, HARDWARE, ROBOT, NUMBERS, *TRAJECTORIES, RUNNING, OUTPUT)
