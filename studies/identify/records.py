"""Logs as an identification takes them: torques on the loop's clock, signals at their own stamps.

>>> record = read_record(Path("log.csv"), None, LogOptions())
>>> record.torque.shape, record.time.shape, record.signals
((5000, 2), (5000,), ('theta1', 'theta2', 'v'))

A torque holds until the next sample; what is measured is only known at its own stamp, so nothing is
held over there and an empty cell counts for nothing. `flexsim drive` writes the signals that are
read, torques beside them or in a file of their own, whose first row is then the motion's first.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from flexsim.errors import ParameterError
from flexsim.numerics.types import Array
from studies.core.text import spelled
from studies.tools.log_table import names_in
from studies.tools.logs import TORQUES, LogOptions, read_log

NEEDED = ("theta1", "theta2", "v")
ANGLES = NEEDED[:2]
STRAINS, RATES = ("strain1", "strain2"), ("w1", "w2")  # where a log has them
SIGNALS = (*NEEDED, *RATES, *STRAINS)
UNITS = {"theta1": "rad", "theta2": "rad", "v": "m", "w1": "rad/s", "w2": "rad/s"}
UNITS |= dict.fromkeys(STRAINS, "-")
LEAST_ROWS = 50
SLOW = 500.0  # periods between rows, which no vibration survives
OFF_GRID = 0.05  # of a count, at the most, by the digits of a file
STILL = 5  # first rows whose mean is the angle at rest


@dataclass(frozen=True, eq=False)
class Record:
    """A log.

    Attributes:
        source: the file. period: of the torque's clock [s]. torque: (K, 2) [N m], each held.
        time: (N,) of the measured rows, since the first torque [s].
        signals: names. values: (N, S) of them, nan where there is none.
        left_out: rows of the file at which there is no torque.
    """

    source: str
    period: float
    torque: Array
    time: Array
    signals: tuple[str, ...]
    values: Array
    left_out: int = 0

    @property
    def words(self) -> str:
        """What was read, in a line."""
        own = f"{self.source}: {len(self.time)} rows, {self.duration:.4g} s"
        more = f"; {self.left_out} more rows have no torque and are left out"
        return own + (more if self.left_out else "")

    @property
    def duration(self) -> float:
        """The last measured row's time [s]."""
        return float(self.time[-1])

    def first(self, duration: float) -> Record:
        """Return what was measured up to a time [s], and the torques until then."""
        rows = int(np.searchsorted(self.time, duration, side="right"))
        count = min(len(self.torque), int(np.ceil(duration / self.period)) + 1)
        return replace(
            self, torque=self.torque[:count], time=self.time[:rows], values=self.values[:rows]
        )

    def resting(self) -> Array:
        """Return the joint angles (2,) at the start [rad]: the mean of the first rows."""
        first = self.values[:STILL, [self.signals.index(name) for name in ANGLES]]
        return np.nanmean(first, axis=0)


def read_record(
    path: Path,
    torque: Path | None,
    options: LogOptions,
    signals: tuple[str, ...] = (),
) -> Record:
    """Return a log with its torques.

    Args:
        path: of the log. torque: of the file that has its torques, None where the log has them.
        options: how both are read. signals: to be used, all that there are unless given.

    Raises:
        RunError: a file cannot be read.
        ParameterError: a column, row or stamp that cannot be used; no torques, too few rows.
    """
    names = options.columns_of((*TORQUES, *SIGNALS))
    there = set(names_in(path, set(names.values())))
    strained = any(names[each] in there for each in STRAINS)
    needed = ANGLES if strained else NEEDED
    wanted = tuple(each for each in SIGNALS if each in needed or names[each] in there)
    for each in signals:
        if names.get(each) not in there:
            raise ParameterError(
                f"{path}: has no column {each!r} that --signals asks for; it has "
                f"{', '.join(spelled(name) for name in there)}"
            )
    wanted = signals or wanted
    own = all(names[each] in there for each in TORQUES)
    if torque is None and not own:
        raise ParameterError(
            f"{path}: has no columns {' and '.join(names[each] for each in TORQUES)}; give the "
            "torques in a file of their own with --torque, or name the columns with --columns"
        )
    log = read_log(path, _for(options, wanted), wanted)
    source = path if torque is None else torque
    driven = read_log(source, _for(options, TORQUES), TORQUES, "torque file")
    first = len(log.table.time) - len(log.time)
    values, time = log.table.values[first:], log.time
    # a motion of `drive` counts from the first torque; stamps of one clock are kept apart
    shift = 0.0 if torque is None or log.start == 0.0 else log.start - driven.start
    if torque is None:
        shift = log.start - driven.start
    apart = float(np.median(np.diff(time))) / options.period if len(time) > 1 else 0.0
    if apart > SLOW:
        raise ParameterError(
            f"{path}: its rows are {apart:.4g} of the loop's periods apart; if its stamps are no "
            "seconds, say so with --time-unit ms, else give a longer --period"
        )
    held = driven.resampled(options.period)
    inside = (time + shift >= 0) & (time + shift <= options.period * len(held) * (1 + 1e-9))
    if inside.sum() < LEAST_ROWS:
        raise ParameterError(
            f"{path}: {int(inside.sum())} rows lie within the {len(held)} torques of {source}; "
            f"give {LEAST_ROWS} or more, on one clock or both from their first row"
        )
    beyond = int(len(inside) - inside.sum())
    time, values = (time + shift)[inside], values[inside]
    return _begun(Record(str(path), options.period, held, time, wanted, values, beyond))


def _begun(record: Record) -> Record:
    """Return a record whose first torque is that of its first measured row."""
    skipped = int(np.floor(record.time[0] / record.period + 1e-6))
    time = record.time - skipped * record.period
    return replace(record, torque=record.torque[skipped:], time=np.maximum(time, 0.0))


def _for(options: LogOptions, signals: tuple[str, ...]) -> LogOptions:
    """Return options whose names are those of these signals only."""
    names = options.columns_of((*TORQUES, *SIGNALS))
    kept = ",".join(f"{each}={names[each]}" for each in ("t", *signals))
    return LogOptions(
        columns=kept, time_unit=options.time_unit, gap=options.gap, period=options.period
    )


def counts_of(record: Record) -> Array:
    """Return the counts (S,) of a record's angles [rad], 0 of what is not counted.

    An angle is if all its values lie on a grid as wide as its least step, and some steps are none.
    """
    found = np.zeros(len(record.signals))
    for s, name in enumerate(record.signals):
        known = record.values[np.isfinite(record.values[:, s]), s]
        steps = np.abs(np.diff(known))
        moved = steps[steps > 1e-9 * (1 + np.abs(known).max())]
        if name not in ANGLES or not 0 < len(moved) < len(steps):
            continue
        least, span = float(moved.min()), float(np.ptp(known))
        count = span / np.round(span / least)
        on_grid = (known - known.min()) / count
        if np.abs(on_grid - np.round(on_grid)).max() < OFF_GRID:
            found[s] = count
    return found


def noise_of(record: Record) -> Array:
    """Return the noise (S,) of a record's signals, from what changes from row to row.

    The root mean square of second differences over sqrt(6), which is that of white noise and hardly
    sees a smooth motion; at least that of a count, where there are steps: a step over sqrt(12).
    """
    found = np.empty(len(record.signals))
    for s, column in enumerate(record.values.T):
        known = column[np.isfinite(column)]
        curved = np.sqrt(np.mean(np.diff(known, 2) ** 2) / 6)
        steps = np.abs(np.diff(known))
        moved = steps[steps > 1e-9 * (1 + np.abs(known).max())]
        still = len(steps) - len(moved)
        count = moved.min() / np.sqrt(12) if len(moved) and still > len(steps) / 4 else 0.0
        found[s] = max(curved, count, 1e-9 * (1e-3 + np.ptp(known)))
    return found
