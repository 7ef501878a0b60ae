"""What `studies/files/payloads.toml` shows, and at other steps and sizes: studies/files/README.md.

python docs/made/payloads.py
"""

from __future__ import annotations

import tomllib
from pathlib import Path

import pyarrow.parquet as pq
import tomli_w
from asked import ROOT, own_folder, said

from flexsim import Parameters
from studies.core.evidence.intervals import share_interval

CONTROLLER = "ideal-line"
FROM = 0.05  # [kg]: from there on one model loses every run
PAYLOAD, LENGTH = "robot.payload", Parameters().L
VARIED = (
    ("as it is", ["assumed-modes", "closed-chain"]),
    (
        "at half the step",
        [{"model": "assumed-modes", "step": 5e-4}, {"model": "closed-chain", "step": 5e-4}],
    ),
    (
        "finer",
        [
            {"model": "assumed-modes:5", "step": 2.5e-4},
            {"model": "closed-chain:10", "step": 2.5e-4},
        ],
    ),
)


def main() -> None:
    """Print how many runs diverge, and how far those bend that do not."""
    study = tomllib.loads((ROOT / "studies/files/payloads.toml").read_text(encoding="utf-8"))
    study["controllers"] = [CONTROLLER]
    for number, (name, plants) in enumerate(VARIED):
        study["plants"] = plants
        if number:
            study["sweep"]["robot"]["payload"] = [0.05, 0.1, 0.2]
        Path("study.toml").write_text(tomli_w.dumps(study), encoding="utf-8")
        out = Path(f"run-{number}")
        said("run", "study.toml", "--out", out)
        rows = pq.read_table(out / "results.parquet").to_pylist()
        for plant in dict.fromkeys(row["plant"] for row in rows):
            mine = [row for row in rows if row["plant"] == plant and row[PAYLOAD] >= FROM]
            by_payload: dict[float, list[dict]] = {}
            for row in mine:
                by_payload.setdefault(row[PAYLOAD], []).append(row)
            lost = [sum(row["diverged"] for row in same) for same in by_payload.values()]
            count = len(mine) // len(by_payload)
            low, high = share_interval(min(lost), count)[0], share_interval(max(lost), count)[1]
            bent = [row["max_v"] / LENGTH for row in mine if not row["diverged"]]
            swing = f", v to {min(bent):.0%} to {max(bent):.0%} of L" if bent else ""
            print(
                f"{name}, {plant}: {min(lost)} to {max(lost)} of {count} runs diverge "
                f"[{100 * low:.0f}, {100 * high:.0f}] %{swing}"
            )


if __name__ == "__main__":
    with own_folder():
        main()
