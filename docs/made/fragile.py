"""What section 3.2's algorithm alone finds, and how much of it holds: sentences of studies/tables.

python docs/made/fragile.py
"""

from __future__ import annotations

import csv
from pathlib import Path

from asked import own_folder, said

from studies.core.evidence.intervals import share_interval

MODES, CHAIN, LINE = "assumed-modes", "chain", "line"


def main() -> None:
    """Print how many cases keep all runs bounded, and of two cases how many runs diverge."""
    said("tables", "--no-exact", "--out", "run")
    with Path("run", "results.csv").open(encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["diverged_share"]]
    (runs,) = {int(row["runs"]) for row in rows}
    lost = {
        (row["tuned_on"], row["tuned_for"], row["run_on"], row["trajectory"]): round(
            float(row["diverged_share"]) * runs
        )
        for row in rows
    }
    held = sum(count == 0 for count in lost.values())
    print(
        f"of the {len(lost)} combinations of controller, path and plant only {held} keep all of "
        f"{runs} runs"
    )
    print(f"tuned on, {lost[MODES, LINE, MODES, LINE]} of {runs} diverge")
    count = lost[CHAIN, LINE, MODES, LINE]
    low, high = (100 * end for end in share_interval(count, runs))
    assert lost[CHAIN, LINE, CHAIN, LINE] == 0
    print(f"modes {count} of {runs} diverge, {100 * count / runs:.0f} % [{low:.0f}, {high:.0f}]")


if __name__ == "__main__":
    with own_folder():
        main()
