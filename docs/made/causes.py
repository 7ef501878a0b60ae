"""How likely causes are with another seed and with more modes: a table of studies/laboratory.

python docs/made/causes.py
"""

from __future__ import annotations

import csv
import shlex
from pathlib import Path

from asked import asked, own_folder, row

from studies.laboratory.causes import FAMILIES, SEVERAL
from studies.laboratory.suspects import MEASURED, OTHERS

SMALL = "--controllers default --sizes 4 --perturbations 6 --draws 48 --base 0 --synthetic 0"
VARIED = ("--seed 2", "--plants assumed-modes --modes 5")
BESIDE = r" \| "


def main() -> None:
    """Print a row per variation, as stated, plants beside each other, and how far others go."""
    every = []
    for number, options in enumerate(VARIED):
        run = f"run-{number}"
        asked("laboratory", *shlex.split(f"{options} {SMALL}"), "--out", run, "--force")
        with Path(run, "causes.csv").open(encoding="utf-8") as file:
            found = list(csv.DictReader(file))
        every += found
        widest = max(float(each["decades"]) for each in found)
        rows = [
            each for each in found if not each["discrepancy"] and float(each["decades"]) == widest
        ]
        cells = [
            BESIDE.join(percent(r["probability"]) for r in rows if r["cause"] == cause)
            for cause in FAMILIES
        ]
        best = dict.fromkeys((r["plant"], r["best"], r["best_probability"]) for r in rows)
        likeliest = BESIDE.join(f"{name} {percent(share)}" for _, name, share in best)
        row(f"`{options}`", *cells, likeliest)
    measured, others, several = (
        sorted(float(each["probability"]) for each in every if each["cause"] == cause)
        for cause in (MEASURED, OTHERS, SEVERAL)
    )
    print(
        f"by discrepancy go to {percent(measured[-1])}, to {percent(others[-1])}, and from "
        f"{percent(several[0])} to {percent(several[-1])}"
    )


def percent(share: str | float) -> str:
    """Return a share in whole per cent."""
    return f"{100 * float(share):.0f}"


if __name__ == "__main__":
    with own_folder():
        main()
