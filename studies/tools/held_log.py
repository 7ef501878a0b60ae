"""A log whose every sample holds until the next: on the loop's clock, and what was done to it.

>>> log.resampled(1e-3)                       # (K, 2) from the first stamp to the last
>>> log.words(1e-3)
('log.csv: 500 rows every 4 ms from t = 0 s; resampled to 1997 of 1 ms by a zero-order hold',)
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexsim.errors import ParameterError
from flexsim.numerics.clocks import PERIOD
from flexsim.numerics.types import Array
from studies.core.text import spelled
from studies.tools.log_table import DELIMITERS, QUOTED, UNITS, LogTable

STAMP_TOLERANCE = 1e-3  # of a period: a stamp so little behind an instant counts as there
ROWS_MOST = 2_000_000  # of a resampled log: half an hour of 1 ms
GAP_FROM = 1.5  # median intervals: more is a gap, less is jitter
SLOW = 0.5  # [s] intervals above which stamps may be meant in milliseconds
NAMES_SHOWN = 8


@dataclass(frozen=True, eq=False)
class Log:
    """A log without gaps: every sample holds until the next.

    Attributes:
        table: as the file has it. time: (N,) [s], 0 first; values: (N, S), of every row that has
            been preceded by a sample of all signals.
        gaps: (G,) lengths of the gaps that are held over [s]. empty: cells that are.
        left_out: rows before the first sample of some signal. unit: of the stamps.
    """

    table: LogTable
    time: Array
    values: Array
    gaps: Array
    empty: int
    left_out: int
    unit: str

    @property
    def start(self) -> float:
        """The first row's stamp [s]."""
        return float(self.table.start) / UNITS[self.unit] + float(self.table.time[self.left_out])

    @cached_property
    def interval(self) -> float | None:
        """Median interval of the stamps [s], None of a single one."""
        return median_interval(self.table.time)

    @cached_property
    def jitter(self) -> float | None:
        """How far an interval is from the median at most, gaps aside [s]."""
        if self.interval is None:
            return None
        spans = np.diff(self.table.time)
        return float(np.abs(spans[spans <= GAP_FROM * self.interval] - self.interval).max())

    @property
    def filled(self) -> int:
        """How many samples of a median interval the gaps lack."""
        return int(np.sum(np.round(self.gaps / (self.interval or 1.0)) - 1))

    def resampled(self, period: float = PERIOD) -> Array:
        """Return the held values (K, S) at k period from the first row's stamp to the last's.

        Raises:
            ParameterError: there would be too many.
        """
        return self.values[self._last_rows(period)]

    def _last_rows(self, period: float) -> NDArray[np.intp]:
        """Return which row (K,) holds at each instant of the clock."""
        rows = self.time[-1] / period + STAMP_TOLERANCE
        if not rows < ROWS_MOST:
            raise ParameterError(
                f"{self.table.source}: first and last stamp are {self.time[-1]:.6g} s apart, more "
                f"than {ROWS_MOST:,} rows of {period:g} s; give a shorter log, a longer --period, "
                "or the --time-unit of the stamps"
            )
        instants = period * np.arange(int(rows) + 1)
        tolerated = instants + STAMP_TOLERANCE * period
        return np.searchsorted(self.time, tolerated, side="right") - 1

    def done(self, period: float = PERIOD) -> dict[str, Any]:
        """Return what was done to the log, for programs to read; times in seconds."""
        last = self._last_rows(period)
        return {
            "rows": len(self.time),
            "start": self.start,
            "duration": float(self.time[-1]),
            "interval_median": self.interval,
            "jitter": self.jitter,
            "gaps": len(self.gaps),
            "longest_gap": float(self.gaps.max(initial=0.0)),
            "filled": self.filled,
            "empty_cells": self.empty,
            "rows_without_stamp": self.table.unstamped,
            "rows_left_out": self.left_out,
            "delimiter": self.table.delimiter,
            "decimal_comma": self.table.comma,
            "ignored_columns": list(self.table.ignored),
            "resampled": not np.array_equal(last, np.arange(len(self.time))),
            "period": period,
            "rows_resampled": len(last),
            "rows_passed_over": len(self.time) - len(np.unique(last)),
        }

    def words(self, period: float = PERIOD) -> tuple[str, ...]:
        """Return what was done to the log, in a line, and another for each thing to think about."""
        done = self.done(period)
        every = "" if self.interval is None else f" every {_time(self.interval)}"
        if self.jitter is not None and self.jitter > STAMP_TOLERANCE * period:
            every += f" (within {_time(self.jitter)})"
        parts = [f"{len(self.time)} rows{every} from t = {self.start:.13g} s"]
        parts += self._missing()
        if done["resampled"]:
            parts.append(
                f"resampled to {done['rows_resampled']} of {_time(period)} by a zero-order hold"
            )
        else:
            parts.append("taken as they are")
        lines = [f"{spelled(self.table.source)}: {'; '.join(parts)}"]
        if done["rows_passed_over"] and self.interval is not None and self.interval < period:
            lines.append(
                f"Note: the log is faster than {_time(period)}: {done['rows_passed_over']} rows "
                "between its instants are passed over"
            )
        if self.interval is not None and self.interval >= SLOW and self.unit == "s":
            lines.append("Note: stamps are taken for seconds; others need --time-unit")
        return tuple(lines)

    def _missing(self) -> list[str]:
        """Return what was missing or too much, in words."""
        table, found = self.table, []
        if table.delimiter != "," or table.comma:
            found.append(DELIMITERS[table.delimiter] + ", decimal commas" * table.comma)
        if table.unstamped:
            found.append(f"{table.unstamped} without a stamp left out")
        if self.left_out:
            found.append(f"{self.left_out} before the first sample of every column left out")
        if self.empty:
            found.append(f"{self.empty} empty cell{'s' * (self.empty > 1)} held over")
        if len(self.gaps):
            found.append(
                f"{len(self.gaps)} gap{'s' * (len(self.gaps) > 1)} held over, "
                f"{self.filled} sample{'s' * (self.filled != 1)}, the longest "
                f"{_time(self.gaps.max())}"
            )
        if table.ignored:
            more = len(table.ignored) - NAMES_SHOWN
            listed = ", ".join(spelled(name[:QUOTED]) for name in table.ignored[:NAMES_SHOWN])
            found.append(f"columns left out: {listed}" + f" and {more} more" * (more > 0))
        return found


def median_interval(time: Array) -> float | None:
    """Return the median interval of stamps (N,) [s], None of a single one."""
    return float(np.median(np.diff(time))) if len(time) > 1 else None


def _time(value: float) -> str:
    """Return a time in words, in milliseconds below a second."""
    return f"{value:.4g} s" if value >= 1 else f"{1e3 * value:.4g} ms"
