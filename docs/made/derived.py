"""What documents say of a run's files: run in the folder of the item that wrote them.

python docs/made/derived.py pid-question
python docs/made/derived.py screening
"""

from __future__ import annotations

import csv
import math
import sys
from pathlib import Path

from asked import run_part


def rows(name: str) -> list[dict[str, str]]:
    """Return the rows of a table of the run."""
    path = Path("run", name)
    if not path.is_file():
        sys.exit(f"there is no {path}; run this beside the run that wrote it")
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def number(text: str) -> float:
    """Return a cell's number, inf where there is none."""
    return float(text) if text not in ("", "None") else math.inf


def pid_question() -> None:
    """Print how many searches found something bounded, and how many of these ends grow."""
    searches = rows("searches.csv")
    bounded = [each for each in searches if math.isfinite(number(each["best_index"]))]
    grow = sum(each["best_stable"] == "False" for each in bounded)
    print(f"{len(bounded)} of {len(searches)} searches\nand {grow} of these end")
    print(f"Of {len(bounded)} searches by\nbounded, {grow} ended")


def screening() -> None:
    """Print how many simulations searches took to the target, plain and screened."""
    ends = []
    for screened in (False, True):
        mine = [each for each in rows("results.csv") if (int(each["screen"]) > 0) == screened]
        found = [number(each["simulations_to_target"]) for each in mine]
        finite = [int(each) for each in found if math.isfinite(each)]
        ends.append(f"{min(finite):,} to {max(finite):,}")
    print(f"{ends[0]} simulations; all screened ones do, after {ends[1]}")


if __name__ == "__main__":
    run_part({"pid-question": pid_question, "screening": screening})
