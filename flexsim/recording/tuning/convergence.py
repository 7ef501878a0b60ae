"""The convergence of a tuning run as a small recording, on a timeline that counts generations.

>>> write_convergence(run / "convergence.rrd", "index (5)", curves, metadata)  # doctest: +SKIP
"""

from __future__ import annotations

import hashlib
import uuid
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import rerun as rr

from flexsim.errors import ParameterError
from flexsim.numerics.types import Array
from flexsim.recording import texts
from flexsim.recording.colours import Colour
from flexsim.recording.curves import CURVES, Columns, sent
from flexsim.recording.layout import Beside, layout
from flexsim.recording.panels import NOWHERE, Panel, Plan, Series, plans_text, rounded
from flexsim.recording.rerun_file import (
    APPLICATION,
    PLANS,
    arranged_as,
    log_properties,
    log_text,
    new_stream,
    write_rrd,
)

TIMELINE = "generation"
NAME = "convergence"  # of the recording's one case
BROAD, THIN = 3.4, 1.2  # widths of curves [points]: the median's lies on the best's
BEST: Colour = (86, 180, 233)
MEDIAN: Colour = (230, 159, 0)
STABLE: Colour = (0, 158, 115)


@dataclass(frozen=True)
class Course:
    """The course of a tuning: indices of every generation, inf where diverged; stable shares.

    Attributes:
        title: what the index is, with its unit. best, median, stable_share: (G,).
    """

    title: str
    best: Array
    median: Array
    stable_share: Array

    @property
    def curves(self) -> dict[str, dict[str, Array]]:
        """Values (G,) by entity and field, not finite where diverged."""
        with np.errstate(divide="ignore"):
            return {
                "best": {"index": self.best, "log10_index": np.log10(self.best)},
                "median": {"index": self.median, "log10_index": np.log10(self.median)},
                "stable": {"share": self.stable_share},
            }


def plan_of(course: Course) -> Plan:
    """Return what is shown of a tuning: three plots over generations, and what explains it."""

    def panel(title: str, field: str, *names: tuple[str, str, Colour]) -> Panel:
        series = [
            Series(entity, CURVES, field, said, rgb, THIN if i else BROAD)
            for i, (entity, said, rgb) in enumerate(names)
        ]
        values = np.concatenate([course.curves[entity][field] for entity, _, _ in names])
        return Panel("course", title, *rounded(values), tuple(series))

    key = " · broad blue: best · thin orange: median"
    both = (("best", "best", BEST), ("median", "median", MEDIAN))
    stable = ("stable", "stable share", STABLE)
    plots = (
        panel(f"log10 of {course.title}{key}", "log10_index", *both),
        panel(f"{course.title}{key}", "index", *both),
        panel("share of the population that holds", "share", stable),
    )
    end = float(len(course.best))
    about = (("run", "run"),)
    places = (course.title, NOWHERE, NOWHERE, course.title)
    return Plan(NAME, end, *places, plots, False, False, False, about, TIMELINE)


def _identity(course: Course, metadata: Mapping[str, str]) -> uuid.UUID:
    """Return an id that only equal contents share."""
    digest = hashlib.sha256(repr(sorted(metadata.items())).encode())
    for values in (course.best, course.median, course.stable_share):
        digest.update(np.ascontiguousarray(values).tobytes())
    return uuid.uuid5(uuid.NAMESPACE_URL, f"flexsim:{digest.hexdigest()}")


def log_course(stream: rr.RecordingStream, course: Course) -> None:
    """Record the curves where they are finite: what diverged has no place on an axis."""
    for entity, fields in course.curves.items():
        shown = np.flatnonzero(np.isfinite(next(iter(fields.values()))))
        if shown.size:
            values = {CURVES: {name: each[shown] for name, each in fields.items()}}
            times = rr.TimeColumn(TIMELINE, sequence=shown)
            table = Columns(entity, shown.astype(float), values)
            stream.send_columns(f"{NAME}/{entity}", [times], sent(table))


def write_convergence(
    path: Path,
    title: str,
    best: Array,
    median: Array,
    stable_share: Array,
    metadata: Mapping[str, str],
) -> None:
    """Write the convergence of a run, all of it or nothing.

    Args:
        path: the `.rrd` to write; a file already there is replaced.
        title: what the index is, with its unit.
        best, median: (G,) indices of each generation, inf where diverged.
        stable_share: (G,) of each generation's population.
        metadata: what else explains the run.

    Raises:
        ParameterError: there is no generation.
        RunError: the file cannot be written.
    """
    if not len(best):
        raise ParameterError("there is no generation to record")
    course = Course(title, *(np.asarray(each, float) for each in (best, median, stable_share)))
    plans = [plan_of(course)]

    def log(stream: rr.RecordingStream) -> None:
        stream.send_recording_name(f"{APPLICATION} tune")
        log_properties(stream, "run", metadata)
        log_properties(stream, PLANS, {"json": plans_text(plans)})
        log_text(stream, "run", texts.run(metadata))
        log_course(stream, course)

    stream = new_stream(arranged_as(plans_text(plans)), _identity(course, metadata))
    write_rrd(path, stream, layout([Beside("", plans)]), log)
