"""How likely causes are with another seed and with more modes: a table of studies/laboratory.

python docs/made/causes.py
"""

from __future__ import annotations

import csv
import shlex
from pathlib import Path

from asked import asked, row

from studies.laboratory.causes import FAMILIES

SMALL = "--controllers default --sizes 4 --perturbations 6 --draws 48 --base 0 --synthetic 0"
VARIED = ("--seed 2", "--plants assumed-modes --modes 5")
BESIDE = r" \| "


def main() -> None:
    """Print a row per variation, as stated, plants beside each other."""
    for options in VARIED:
        asked("laboratory", *shlex.split(f"{options} {SMALL}"), "--out", "run", "--force")
        with Path("run", "causes.csv").open(encoding="utf-8") as file:
            rows = [each for each in csv.DictReader(file) if not each["discrepancy"]]
        widest = max(float(each["decades"]) for each in rows)
        rows = [each for each in rows if float(each["decades"]) == widest]
        cells = [
            BESIDE.join(percent(r["probability"]) for r in rows if r["cause"] == cause)
            for cause in FAMILIES
        ]
        best = dict.fromkeys((r["plant"], r["best"], r["best_probability"]) for r in rows)
        likeliest = BESIDE.join(f"{name} {percent(share)}" for _, name, share in best)
        row(f"`{options}`", *cells, likeliest)


def percent(share: str) -> str:
    """Return a share in whole per cent."""
    return f"{100 * float(share):.0f}"


if __name__ == "__main__":
    main()
