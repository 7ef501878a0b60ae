"""A laboratory's log on the loop's clock: missing samples held over, resampled, and all that said.

    >>> log = read_log(Path("log.csv"), LogOptions(columns="t=Time,tau1=Torque 1,tau2=Torque 2"))
    >>> torque = log.resampled(1e-3)              # (K, 2) from the first stamp to the last
    >>> log.words(1e-3)                           # what was done

A sample holds until the next one, a zero-order hold: what is asked for at an instant is the last
sample up to it. Of a log faster than the clock some samples are passed over, and no mean is taken
over a period: that would be another signal than what any instant had. A log on the clock's own
instants is taken as it is, to the bit.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from flexsim.errors import ParameterError
from flexsim.numerics.clocks import PERIOD
from flexsim.numerics.types import Array
from studies.tools.held_log import GAP_FROM, Log, median_interval
from studies.tools.log_table import TIME, LogTable, read_table

TORQUES = ("tau1", "tau2")
GAP_INTERVALS = 10  # median intervals that are held over, unless told otherwise
ROUNDING = 1e-9  # relative, of a gap


@dataclass(frozen=True, kw_only=True)
class LogOptions:
    """How a log is read."""

    columns: str | None = None
    """The file's own names of columns, as 't=Time,tau1=Torque 1,tau2=Torque 2'; t, tau1, tau2
    unless given [s, N m]. Other columns are left out."""
    time_unit: Literal["s", "ms", "us", "ns"] = "s"
    """Unit of the stamps."""
    gap: float | None = None
    """Longest time without a sample over which the last is held [s]; 10 times the median interval
    unless given."""
    period: float = PERIOD
    """Control period [s]: rows are resampled to it by a zero-order hold."""

    def columns_of(self, signals: Sequence[str] = TORQUES) -> dict[str, str]:
        """Return the names of the columns by their signals, t first.

        Raises:
            ParameterError: --columns names no signal, one twice, or two by one column.
        """
        known = (TIME, *signals)
        names = {signal: signal for signal in known}
        starts = rf",(?=\s*(?:{'|'.join(known)})\s*=)"  # so that names may have commas
        seen = set()
        for part in [] if self.columns is None else re.split(starts, self.columns):
            signal, _, name = (each.strip() for each in part.partition("="))
            if signal not in known or not name:
                wanted = ",".join(f"{each}=NAME" for each in known)
                raise ParameterError(f"--columns has {part!r}; give {wanted}, or some of them")
            if signal in seen:
                raise ParameterError(f"--columns names {signal} twice; name it once")
            seen.add(signal)
            names[signal] = name
        for signal, name in names.items():
            others = [other for other in names if other != signal and names[other] == name]
            if others:
                raise ParameterError(
                    f"--columns takes {name!r} for {signal} and {others[0]}; name a column for each"
                )
        return names

    def require_usable(self) -> None:
        """Raise a ParameterError unless gap and period are finite numbers above 0."""
        for option, value in (("--gap", self.gap), ("--period", self.period)):
            if value is not None and not 0 < value < math.inf:
                raise ParameterError(f"{option} is {value} s; give a finite number above 0")


def read_log(
    path: Path,
    options: LogOptions | None = None,
    signals: Sequence[str] = TORQUES,
    what: str = "log",
) -> Log:
    """Return a log, its missing samples held over.

    Args:
        path: of a CSV file. options: how it is read. signals: wanted, beside the time.
        what: the file is, for messages.

    Raises:
        RunError: the file cannot be read.
        ParameterError: options, a column, row or stamp that cannot be used, or a gap too long.
    """
    options = options or LogOptions()
    options.require_usable()
    table = read_table(path, options.columns_of(signals), options.time_unit, what)
    return _held(table, options)


def _held(table: LogTable, options: LogOptions) -> Log:
    """Return a table as a log, the last sample of each signal held over empty cells."""
    there = np.isfinite(table.values)  # (N, S)
    for s, column in enumerate(table.columns):
        if not there[:, s].any():
            raise ParameterError(f"{table.source}: column {column!r} is empty; name another")
    first = int(there.argmax(axis=0).max())
    rows = np.where(there, np.arange(len(there))[:, None], 0)
    last = np.maximum.accumulate(rows, axis=0)  # of each signal's samples, up to each row
    waited = _waited(table, there)
    interval = median_interval(table.time) or 0.0
    _require_short(table, waited[first:], first, options.gap, interval)
    longest = waited[first + 1 :].max(axis=1)
    return Log(
        table=table,
        time=table.time[first:] - table.time[first],
        values=np.take_along_axis(table.values, last, axis=0)[first:],
        gaps=longest[longest > GAP_FROM * interval],
        empty=int((~there[first:]).sum()),
        left_out=first,
        unit=options.time_unit,
    )


def _waited(table: LogTable, there: NDArray[np.bool_]) -> Array:
    """Return at each sample how long there was none of its signal before (N, S) [s], else 0.

    The last row ends every wait.
    """
    waited = np.zeros(there.shape)
    for s in range(there.shape[1]):
        rows = np.flatnonzero(there[:, s])
        rows = np.append(rows, len(there) - 1) if rows[-1] < len(there) - 1 else rows
        waited[rows[1:], s] = np.diff(table.time[rows])
    return waited


def _require_short(
    table: LogTable, waited: Array, first: int, gap: float | None, interval: float
) -> None:
    """Raise a ParameterError at the first gap that is too long to be held over.

    Args:
        waited: (N, S) [s] of the rows from `first` on. gap: longest, as asked for [s].
        interval: median of the stamps [s].
    """
    longest = GAP_INTERVALS * interval if gap is None else gap
    long = waited > longest * (1 + ROUNDING)
    if not long.any():
        return
    row, s = (int(each[0]) for each in np.nonzero(long))
    needed = float(waited.max())
    usual = f", {GAP_INTERVALS} median intervals" if gap is None else ""
    raise ParameterError(
        f"{table.source}, line {table.lines[first + row]}: {waited[row, s]:.6g} s without a sample "
        f"of {table.columns[s]!r}, more than the {longest:.6g} s over which the last is held"
        f"{usual}; --gap {_rounded_up(needed):g} would hold it over all, or cut the log"
    )


def _rounded_up(value: float) -> float:
    """Return the next number of two digits above a value."""
    scale = 10.0 ** (math.floor(math.log10(value)) - 1)
    return math.ceil(value / scale) * scale
