"""Run folders for the tests of reports, as the commands leave them, made without simulating."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from matplotlib.figure import Figure

from studies.core.figures import save
from studies.core.folder import run_folder, versions, write_tables
from studies.core.table import Column, Table
from studies.run.columns import FACTORS, trace_schema

QUESTION = "Do both models agree?"
ANSWER = "They do, within 2 %.\nNote: of this test alone."
PLANTS = ("assumed-modes", "chain")
SAMPLES = 3000  # of a time series: more than a figure has


@dataclass(frozen=True)
class Row:
    """A case on a plant [m]."""

    case: str
    plant: str
    envelope: float | None
    envelope_low: float | None
    envelope_high: float | None
    growth: float | None = None
    note: str = ""


COLUMNS = (
    Column("case"),
    Column("plant"),
    Column("envelope", unit="mm", form=".2f", scale=1e3),
    Column("growth", unit="1/s", form=".1f"),
)


def rows(shift: float = 0.0, cases: int = 6, note: str = "") -> list[Row]:
    """Return rows whose order by number is another than that by text; one has no envelope."""
    found = []
    for i in range(cases):
        for plant in PLANTS:
            middle = 1e-3 * (cases - i) ** 2 + 1e-4 * (plant == "chain") + shift
            ends = (middle - 2e-4, middle + 2e-4)
            found.append(Row(f"case {i}", plant, middle, *ends, -float(i), note))
    return [*found, Row("lost", "chain", None, None, None)]


def config(command: Sequence[str], **more: Any) -> str:
    """Return config.json as a study writes it."""
    content = {
        "command": ["flexsim", *command],
        "configuration": {"seed": 1, "robot": {"EI": 0.349}, "out": "x"},
        "versions": versions(),
        "machine": {"processor": "abacus", "version": "0.1.0", "sources": "0123456789abcdef"},
        "question": QUESTION,
        "answer": ANSWER,
        **more,
    }
    return json.dumps(content)


def study(folder: Path, found: Sequence[Row] | None = None, **more: Any) -> Path:
    """Return the folder of a run of a study, made."""
    table = Table(rows() if found is None else found, COLUMNS, "Envelopes", file="results.csv")
    with run_folder(folder, force=False) as new:
        (new / "config.json").write_text(config(["compare", "--out", "my run"], **more))
        table.write_csv(new / table.file)
        write_tables(new, [table])
        (new / "figures").mkdir()
        save(Figure(figsize=(3, 2)), new / "figures" / "curves.png")
    return folder


def study_file(folder: Path, runs: int = 4) -> Path:
    """Return the folder of a run of a study file with time series, made."""
    names = {name: ["the one"] * runs for name in FACTORS}
    names["plant"] = [PLANTS[i % 2] for i in range(runs)]
    names["trajectory"] = [f"path {i // 2}" for i in range(runs)]
    time = np.linspace(0.0, 3.0, SAMPLES)
    with run_folder(folder, force=False) as new:
        (new / "config.json").write_text(config(["run", "study.toml"]))
        (new / "study.toml").write_text("seed = 7\ntitle = 'mine'\n")
        content = {"run": range(runs), **names, "envelope": np.arange(runs) / 100}
        pq.write_table(pa.table(content), new / "results.parquet")
        pq.write_table(pa.table(content), new / "ignored.parquet")
        (new / "traces").mkdir()
        path = new / "traces" / f"{0:010d}-{runs - 1:010d}.parquet"
        with pq.ParquetWriter(path, trace_schema()) as writer:
            for run in range(runs):
                series = {n: np.full(SAMPLES, 1.0 + run) for n in trace_schema().names}
                series |= {"run": np.full(SAMPLES, run), "t": time, "v": 1e-3 * np.sin(time)}
                writer.write_table(pa.table(series, schema=trace_schema()))
    return folder


def tuning(folder: Path, finished: bool = True, seed: int = 2) -> Path:
    """Return the folder of a run of flexsim tune, made."""
    si = {"k1": 1.0 + seed, "nu1": 0.25}
    result = {"best_index": 2e-5, "best_parameters": {"k1": 3.0, "nu1": 0.25}, "answer": ANSWER}
    lines = ["generation,individual,origin,index,growth"]
    lines += [f"{i // 3},{i % 3},random,{'inf' if i % 3 == 2 else 1 / (9 + i)},0" for i in range(9)]
    with run_folder(folder, force=False) as new:
        own = {"configuration": {"seed": seed, "trajectory": "circle"}, "answer": ""}
        (new / "config.json").write_text(config(["tune"], **own))
        (new / "generations.csv").write_text("\n".join(lines) + "\n")
        if finished:
            (new / "result.json").write_text(json.dumps({**result, "best_parameters_si": si}))
            course = "generation,evaluations,best,median,stable_share\n0,3,2e-4,,0.5\n1,6,1e-4,,1\n"
            (new / "convergence.csv").write_text(course)
    return folder


def written(folder: Path, files: Mapping[str, str | bytes]) -> Path:
    """Return a run's folder after files in it were written, over what there was."""
    for name, content in files.items():
        data = content.encode() if isinstance(content, str) else content
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(data)
    return folder
