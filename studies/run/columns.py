"""The columns of results: names, units, meanings, as Parquet's metadata has them, too.

>>> schema = results_schema(workshop)
>>> schema.field("envelope").metadata
{b'unit': b'm', b'meaning': b'largest distance of the tip from the path'}
"""

from __future__ import annotations

from dataclasses import fields
from typing import Any, NamedTuple

import pyarrow as pa

from flexsim.arm.parameters import Parameters
from studies.spec.building import Workshop


class Figure(NamedTuple):
    """A figure of merit: its name, unit and meaning."""

    name: str
    unit: str
    meaning: str


FACTORS = ("plant", "robot", "controller", "trajectory", "setting", "hardware")
COUNTERS = (
    ("run", "number of the run, from 0"),
    ("draw", "sample of the distributions + samples x point of the grid"),
    ("repeat", "0: gains as they are; others: every gain slightly changed"),
)
FIGURES = (
    Figure("envelope", "m", "largest distance of the tip from the path"),
    Figure("max_error", "m", "largest distance of the tip from its reference"),
    Figure("rms_error", "m", "root mean square of that distance"),
    Figure("max_v", "m", "largest tip deflection"),
    Figure("residual_v", "m", "largest tip deflection over the hold; none without a hold"),
    Figure("growth", "1/s", "rate at which v's rms grows over the hold; none without a hold"),
    Figure("index", "m2 s", "performance index (5)"),
    *(Figure(f"index_{part}", "m2 s", f"what {part} adds to it") for part in "xyv"),
    Figure("effort", "N2 m2 s", "integral of the commanded torques' squares"),
    *(
        Figure(f"{name}_{joint}", "N m", f"{meaning} of joint {joint}")
        for name, meaning in (
            ("peak_torque", "largest commanded torque"),
            ("rms_torque", "root mean square of the commanded torque"),
            ("variation", "total variation of the commanded torque"),
        )
        for joint in (1, 2)
    ),
)
NONE_DIVERGED = ("residual_v", "growth")  # that a run which diverged does not have
DIVERGED = (
    ("diverged", "whether the run left the workspace; its figures are then inf"),
    ("diverged_at", "when it did; none if it did not"),
)
TRACES = (
    ("t", "s", "time"),
    ("x", "m", "tip"),
    ("y", "m", "tip"),
    ("x_ref", "m", "reference of the tip"),
    ("y_ref", "m", "reference of the tip"),
    ("theta1", "rad", "angle of joint 1"),
    ("theta2", "rad", "angle of joint 2"),
    ("theta1_ref", "rad", "reference of joint 1"),
    ("theta2_ref", "rad", "reference of joint 2"),
    ("v", "m", "tip deflection"),
    ("error1", "rad", "error that controller 1 gets"),
    ("error2", "rad", "error that controller 2 gets, with v in it"),
    ("tau1", "N m", "torque that controller 1 commands"),
    ("tau2", "N m", "torque that controller 2 commands"),
    ("applied1", "N m", "mean torque of motor 1 over the period, ahead of friction"),
    ("applied2", "N m", "mean torque of motor 2 over the period, ahead of friction"),
)


def _field(name: str, kind: Any, unit: str, meaning: str) -> Any:
    return pa.field(name, kind, metadata={"unit": unit, "meaning": meaning})


def unit_of(path: str) -> str:
    """Return the unit of a number of the file, nothing where it is not known."""
    units = {item.name: item.metadata["unit"] for item in fields(Parameters)}
    units |= {"step": "s", "period": "s", "duration": "s", "lead": "s", "hold": "s", "lag": "s"}
    units |= {"noise_v": "m", "delay": "samples", "tau_0": "N m", "torque_limit": "N m"}
    return units.get(path.rpartition(".")[2].partition("[")[0], "")


def results_schema(workshop: Workshop) -> Any:
    """Return the schema of a study's results: one row a run."""
    swept = [
        _field(path, pa.float64(), unit_of(path), "varied") for path in workshop.matrix.draws.paths
    ]
    return pa.schema(
        [
            *(_field(name, pa.int64(), "-", meaning) for name, meaning in COUNTERS),
            *(_field(name, pa.string(), "-", f"name of the {name}") for name in FACTORS),
            *swept,
            *(_field(each.name, pa.float64(), each.unit, each.meaning) for each in FIGURES),
            _field(DIVERGED[0][0], pa.bool_(), "-", DIVERGED[0][1]),
            _field(DIVERGED[1][0], pa.float64(), "s", DIVERGED[1][1]),
        ],
        metadata={"flexsim": "results", "study": workshop.resolved.digest},
    )


def trace_schema() -> Any:
    """Return the schema of time series: one row a sample of a run."""
    return pa.schema(
        [
            _field("run", pa.int64(), "-", COUNTERS[0][1]),
            *(_field(name, pa.float64(), unit, meaning) for name, unit, meaning in TRACES),
        ],
        metadata={"flexsim": "traces"},
    )
