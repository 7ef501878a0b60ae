"""How well each chain stands for the beam: tables of models/README.md.

python docs/made/chains.py
"""

from __future__ import annotations

import numpy as np
from asked import asked, numbers, own_folder, row

FILES = (  # of the table's columns
    ("--segments", 4),
    ("--segments", 6),
    ("--segments", 10, "--timestep", 0.00025),
    ("--segments", 8, "--plain", "--timestep", 0.0005),
)
ZERO = 1e-9  # relative error of a frequency that is shown as none


def coupling(chain: dict) -> float:
    """Return the largest error of a mode's coupling."""
    return float(np.abs([*chain["Phi_error"], *chain["moment_error"]]).max())


def quality() -> None:
    """Print how well the chains of the files stand for the beam, and one of equal cells."""
    chains = [
        asked("chain", *each, "--out", f"chain-{i}.xml", "--force") for i, each in enumerate(FILES)
    ]

    def clamped(chain: dict) -> str:
        errors = np.array(chain["frequency_error"])
        return ", ".join("0" if abs(each) < ZERO else f"{100 * each:+.2f}" for each in errors)

    def of(name: str, form: str, scale: float = 1.0) -> list[str]:
        return [format(scale * chain[name], form) for chain in chains]

    row("error of the clamped frequencies 1, 2, 3 [%]", *map(clamped, chains))
    row("largest error of a coupling [%]", *(f"{100 * coupling(c):.4f}" for c in chains))
    row("frequencies 1, 2, 3 under any payload [%]", *of("payload_error", ".4f", 100))
    row("static tip deflection under a force [%]", *of("compliance_error", "+.4f", 100))
    row("static tip rotation under a moment [%]", *of("rotation_error", "+.4f", 100))
    row("MAC at hinges and tip, modes 1, 2, 3", *(numbers(c["mac"], ".4f") for c in chains))
    row("highest frequency, joints free [rad/s]", *of("highest_frequency", ".0f"))
    row("longest stable step of RK4 [ms]", *of("longest_step", ".3g", 1e3))


def front() -> None:
    """Print what six hinges can do."""
    for each in asked("chain", "--front")["front"]:
        cells = (
            f"{100 * each['coupling']:.4f}",
            f"{100 * each['payload']:.4f}",
            f"{100 * each['rotation']:+.4f}",
            f"{each['top']:.0f}",
            f"{1e3 * each['longest_step']:.3g}",
        )
        row(*(f"**{cell}**" if each["chosen"] else cell for cell in cells))


if __name__ == "__main__":
    with own_folder():
        quality()
        front()
