"""Both methods of `flexsim identify` on steps and impulses: a table of studies/identify.

python docs/made/methods.py
"""

from __future__ import annotations

import re

from asked import own_folder, row, said

from flexsim import setting

FREE = ["--free", "friction.tau_0_1,friction.mu_2", "--setting", "opposing"]
MOVES = ["--torques", "9", "2", "--v-most", "0.08", "--theta1-range", "-2", "2", "--duration", "4"]
TRUE = setting("opposing").friction
ROWS = {
    "friction.tau_0_1": ("N m", TRUE.tau_0[0]),
    "friction.mu_2": ("N m s/rad", TRUE.mu[1]),
}


def main() -> None:
    """Print the table's rows, and what the algorithm says of itself."""
    for kind in ("step", "impulse"):
        torques, log = f"{kind}.csv", f"{kind}-log.csv"
        said("experiment", "--kind", kind, *FREE, *MOVES, "--out", torques, "--force")
        motion = ["--plant", "chain", "--setting", "opposing", "--hardware", "bench"]
        motion += ["--log", "measured", "--theta2", "1.2"]
        said("drive", *motion, "--torque", torques, "--out", log, "--force")
    logs = ["step-log.csv", "impulse-log.csv"]
    answers = [
        said("identify", *logs, *FREE, "--hardware", "bench", "--method", method)
        for method in ("genetic", "least-squares")
    ]
    for name, (unit, true) in ROWS.items():
        cells = [re.findall(rf"{name} (\S+ \[\S+, \S+\]) {unit}", each)[-1] for each in answers]
        row(f"{name} [{unit}]", true, *cells)
    (found,) = re.findall(r"After \d+ simulations .*? squares", answers[0])
    print(f'"{found}"')


if __name__ == "__main__":
    with own_folder():
        main()
