"""The other arms in closed loop: blocks and a table of models/README.md.

python docs/made/arms.py
"""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path

from asked import ROOT, own_folder, row, said

STUDIES = {
    "one-link": ("one link, `turn`", ("ideal", "a sample late", "bench")),
    "two-flexible": ("two flexible links, line", ("bench", "a sample more")),
}
REFERENCE, CHAIN = "assumed-modes", "closed-chain"


def main() -> None:
    """Print what both studies end with, then the table's rows."""
    for study in STUDIES:
        print(said("run", ROOT / "studies" / "files" / f"{study}.toml", "--out", study))
    for study, (title, hardware) in STUDIES.items():
        for first, name in zip((title, *[""] * len(hardware)), hardware, strict=False):
            row(first, name, *_cells(study, name))


def _cells(study: str, hardware: str) -> Iterator[str]:
    """Give envelopes of both models with their intervals [mm], and the ratio with its own."""
    with Path(study, "summary.csv").open(encoding="utf-8") as file:
        rows = [
            each
            for each in csv.DictReader(file)
            if each["figure"] == "envelope" and each["hardware"] == hardware
        ]
    mine = {(each["what"], each["plant"]): each for each in rows}
    for plant in (REFERENCE, CHAIN):
        found = [1e3 * float(mine["cells", plant][name]) for name in ("median", "low", "high")]
        yield "{:.2f} [{:.2f}, {:.2f}]".format(*found)
    names = ("ratio", "ratio_low", "ratio_high")
    found = [float(mine["plants", CHAIN][name]) for name in names]
    yield "{:.4f} [{:.4f}, {:.4f}]".format(*found)


if __name__ == "__main__":
    with own_folder():
        main()
