"""Where joint 1 comes to rest in the ideal loop, by model and step: a table of studies/compare.

python docs/made/rest.py
"""

from __future__ import annotations

from pathlib import Path

import pyarrow.parquet as pq
import tomli_w
from asked import own_folder, row, said

from studies.core.evidence.digits import with_interval
from studies.core.evidence.intervals import median_interval, share_interval
from studies.core.evidence.repeats import quantile

PLANTS = (  # what it is called, the model, its step [s]
    ("3 modes at 1 ms", "assumed-modes:3", 1e-3),
    ("3 modes at 0.25 ms", "assumed-modes:3", 2.5e-4),
    ("4 modes", "assumed-modes:4", 2.5e-4),
    ("5 modes", "assumed-modes:5", 2.5e-4),
    ("8 modes", "assumed-modes:8", 1.25e-4),
    ("chain of 6 at 1 ms", "closed-chain:6", 1e-3),
    ("chain of 6 at 0.25 ms", "closed-chain:6", 2.5e-4),
    ("chain of 10", "closed-chain:10", 2.5e-4),
)
REPEATS = 160
NEAR = 8.0  # [mm]: below are the runs that end with 7.8
STUDY = {
    "title": "Where joint 1 rests",
    "repeats": REPEATS,
    "plants": [{"name": name, "model": model, "step": step} for name, model, step in PLANTS],
    "controllers": [{"use": "two-loop"}],
    "trajectories": [{"use": "line"}],
    "settings": ["simulink"],
    "hardware": ["ideal"],
}


def main() -> None:
    """Print a row per model: the median envelope, and the share of runs that end with 7.8 mm."""
    Path("study.toml").write_text(tomli_w.dumps(STUDY), encoding="utf-8")
    said("run", "study.toml", "--out", "run")
    rows = pq.read_table("run/results.parquet").to_pylist()
    for name, _, _ in PLANTS:
        found = [1e3 * each["envelope"] for each in rows if each["plant"] == name]
        median = with_interval(quantile(found), *median_interval(found))
        near = sum(each < NEAR for each in found)
        low, high = (100 * end for end in share_interval(near, len(found)))
        row(name, median, f"{100 * near / len(found):.0f} % [{low:.0f}, {high:.0f}]")


if __name__ == "__main__":
    with own_folder():
        main()
