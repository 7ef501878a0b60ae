"""Ask a recording: the largest difference of the two models, and what a joint did meanwhile.

    python examples/query.py runs/compare/run.rrd

A recording is also a table: rerun's dataframe interface (`pip install 'flexsim[query]'`) gives
every sample of every curve. A plant's curves are one column, a structure whose fields end with
their unit; poses and the rest have columns of their own, by the path of what is drawn.
"""

from __future__ import annotations

import sys
from pathlib import Path

from datafusion import col
from datafusion import functions as f
from rerun.chunk import RrdReader


def apart(path: Path, case: str) -> dict[str, float]:
    """Return where the tips of a case differ most, [s] and [mm], and the root mean square [mm].

    Args:
        path: of a recording of `flexsim compare`. case: its name, as its tab has it.
    """
    store = RrdReader(path).store().stream().collect()
    table = store.reader(index="simulation_time", contents=f"/{case}/curves")
    difference, chain = (col(f'"/{case}/curves:{name}"')[0] for name in ("difference", "chain"))
    rows = table.select(
        col("simulation_time").alias("t"),
        difference["distance_mm"].alias("apart"),
        chain["torque_1_Nm"].alias("torque"),
    ).filter(col("apart").is_not_null())
    (most,) = rows.sort(col("apart").sort(ascending=False)).limit(1).to_pylist()
    (mean,) = rows.aggregate([], [f.avg(col("apart") * col("apart")).alias("square")]).to_pylist()
    return {
        "at_s": most["t"].total_seconds(),
        "apart_mm": most["apart"],
        "torque_1_Nm": most["torque"],
        "rms_mm": mean["square"] ** 0.5,
    }


if __name__ == "__main__":
    recording = Path(sys.argv[1] if len(sys.argv) > 1 else "runs/compare/run.rrd")
    if not recording.is_file():
        sys.exit(f"there is no {recording}; make one with flexsim compare")
    for name in sys.argv[2:] or ("tuned_line", "tuned_two-loop", "tuned_circle"):
        try:
            found = apart(recording, name)
        except Exception as error:  # of the readers: no recording, or none of that case
            sys.exit(f"{recording}: no curves of {name} in it: {error}")
        print(name, {key: round(value, 4) for key, value in found.items()})
