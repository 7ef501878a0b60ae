"""A commented study file that runs: what `flexsim run --example` prints."""

EXAMPLE = """\
# A study: what is listed is crossed, what is swept is varied, every case is repeated.
#   flexsim check study.toml            what it means: how many runs, how long
#   flexsim run study.toml              results.parquet, summary.csv, figures in runs/study
title = "Does a stiffer beam help my PID as much as the paper's controllers?"
seed = 1            # of repeats, samples and noise
repeats = 20        # of each case: gains as they are, then each gain changed by
perturbation = 1e-4 # this share, since dry friction makes single runs a matter of chance

# Models of the robot: rigid, assumed-modes[:n], chain[:N] (MuJoCo), closed-chain[:N] (the same
# chain's equations), untuned[:N], rule-of-thumb[:N], rod[:N], printed[:n], exudyn[:N]. A name, or
# with a step:
plants = ["assumed-modes", { model = "closed-chain:6", step = 5e-4 }]
check = 20          # runs of each closed-chain case that MuJoCo itself repeats

# Controllers: by name (line, two-loop, circle, ideal-line, ..., figure-3, ...) ...
[[controllers]]
use = "line"

# ... by gains and orders, k1 D^nu1 + k2 D^nu2 + k3 (SI), or kp, ki, kd, filter_time; also
# { b, a }, { sos }, { zeros, poles, gain } for each joint, A, B, C, D for both, run = "runs/tune",
# or function = "mine.py:design"
[[controllers]]
name = "PID"
joint1 = { kp = 250.0, ki = 30.0, kd = 20.0, filter_time = 0.005 }
joint2 = { kp = 12.0, ki = 2.0, kd = 0.8, filter_time = 0.005 }

# Trajectories: a shape, its numbers changed as you like ...
[[trajectories]]
use = "line"
duration = 4.0      # [s]
hold = 1.0

# ... or waypoints [m], in place or file = "points.csv"; time laws: minimum-jerk, quintic, spline,
# constant-speed
[[trajectories]]
name = "detour"
points = [[0.70, 0.20], [0.62, 0.42], [0.30, 0.60]]
time_law = "minimum-jerk"
duration = 4.0
lead = 0.2

# Friction: none, simulink, jump, opposing, reconstructed; or with numbers of your own
[[settings]]
use = "simulink"

# Sensors, computer, motors: ideal, delayed, bench, worn; or with numbers of your own
[[hardware]]
use = "bench"

# The robot by its numbers [SI], or mjcf = "my.xml"
[robot]
zeta = 0.001        # damping ratio of the beam's first mode

# What is varied, by its path in this file: on a grid (values, linear, log: [from, to, points]),
# or by a distribution (uniform, log-uniform, normal), sampled alike for all plants and controllers
[sweep]
robot.EI = { values = [0.349, 0.698] }
"""
