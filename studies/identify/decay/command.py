"""Frequencies and damping of a log's free decay, beside those of the robot's beam."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from flexsim.arm.free_arm import clamped_frequencies, joint_free_frequencies
from flexsim.errors import ParameterError
from studies import headings
from studies.core.carry_out import show_tables
from studies.core.console import console
from studies.core.folder import to_json
from studies.core.options import RobotOptions
from studies.core.table import Column, Table
from studies.core.text import spelled
from studies.identify.decay.pencil import Decay, decay
from studies.identify.records import NEEDED, RATES, SIGNALS, STRAINS
from studies.tools.log_table import names_in
from studies.tools.logs import TORQUES, LogOptions, read_log

MODES_MOST = 8


@dataclass(frozen=True, kw_only=True)
class DecayOptions(LogOptions, RobotOptions):
    """What of a decay is looked at."""

    PANEL: ClassVar = headings.MAIN

    signal: str = "v"
    """With --method decay, the column that decays."""
    modes: int = 1
    """With --method decay, the modes that it has."""
    begin: float | None = None
    """With --method decay, when the decay begins [s]; after the last torque unless given."""


@dataclass(frozen=True)
class ModeRow:
    """A mode of the decay, and the robot's frequencies of that number, clamped and free [Hz]."""

    mode: int
    frequency: float
    frequency_half: float
    ratio: float
    ratio_half: float
    amplitude: float
    clamped: float
    free: float


COLUMNS = (
    Column("mode", form="d"),
    Column("frequency", unit="Hz", form=".5f"),
    Column("frequency_half", "+-", "Hz", ".1g"),
    Column("ratio", "damping ratio", form=".3g"),
    Column("ratio_half", "+-", form=".1g"),
    Column("amplitude", form=".3g"),
    Column("clamped", "robot, clamped", "Hz", ".5f"),
    Column("free", "robot, joints free", "Hz", ".5f"),
)


def analysed(config: DecayOptions, logs: Sequence[Path]) -> tuple[Decay, list[ModeRow], float, str]:
    """Return the decay of a log's signal, its rows, when it begins [s], and which it is
    in words.

    Raises:
        ParameterError: a signal, number of modes or beginning that there is not.
    """
    if len(logs) != 1:
        raise ParameterError(f"--method decay takes one log, not {len(logs)}")
    if not 1 <= config.modes <= MODES_MOST:
        raise ParameterError(f"modes is {config.modes}; give 1 to {MODES_MOST}")
    if config.signal not in SIGNALS:
        raise ParameterError(
            f"--signal {config.signal} is none; choose of {', '.join((*NEEDED, *RATES, *STRAINS))}"
        )
    (path,) = logs
    names = config.columns_of((*TORQUES, *SIGNALS))
    there = names_in(path, set(names.values()))
    driven = all(names[each] in there for each in TORQUES)
    wanted = (config.signal, *(TORQUES if driven else ()))
    kept = ",".join(f"{each}={names[each]}" for each in ("t", *wanted))
    own = LogOptions(columns=kept, time_unit=config.time_unit, gap=config.gap, period=config.period)
    log = read_log(path, own, wanted)
    period = log.interval or config.period
    rows = log.resampled(period)
    over = 0.0
    if driven:
        pushed = np.flatnonzero(np.any(rows[:, 1:] != 0.0, axis=1))
        over = period * (pushed[-1] + 1) if len(pushed) else 0.0
    first = over if config.begin is None else config.begin
    if not 0 <= first < period * len(rows):
        raise ParameterError(
            f"the decay would begin at {first:.4g} s of {period * len(rows):.4g} s; give another "
            "--begin, or a log that goes on after the last torque"
        )
    signal = rows[round(first / period) :, 0]
    found = decay(signal, period, config.modes)
    words = f"from {first:.4g} s" + (f", torques until {over:.4g} s" if over > first else "")
    return found, _rows(config, found), first, f"{spelled(path)} {words}"


def _rows(config: DecayOptions, found: Decay) -> list[ModeRow]:
    turn = 2 * math.pi
    p = config.robot_of().parameters
    clamped = clamped_frequencies(p, len(found.frequency)) / turn
    free = joint_free_frequencies(p, len(found.frequency)) / turn
    return [
        ModeRow(
            i + 1,
            float(found.frequency[i]) / turn,
            float(found.frequency_half[i]) / turn,
            float(found.ratio[i]),
            float(found.ratio_half[i]),
            float(found.amplitude[i]),
            float(clamped[i]),
            float(free[i]),
        )
        for i in range(len(found.frequency))
    ]


def show(config: DecayOptions, logs: Sequence[Path], json: bool) -> None:
    """Print the modes of a decay, as a table or one JSON object.

    Raises:
        ParameterError: as `analysed`.
    """
    found, rows, first, source = analysed(config, logs)
    if json:
        halves = {
            f"frequency_{row.mode}": (row.frequency, row.frequency_half, "Hz") for row in rows
        } | {f"ratio_{row.mode}": (row.ratio, row.ratio_half, "-") for row in rows}
        estimates = {
            name: {"value": value, "low": value - half, "high": value + half, "unit": unit}
            for name, (value, half, unit) in halves.items()
        }
        about = {"signal": config.signal, "begin": first, "left": found.left}
        print(to_json({"estimates": estimates, "rows": list(map(asdict, rows)), **about}))
        return
    title = f"Free decay of {config.signal} in {source}"
    note = f"what the modes leave: {100 * found.left:.3g} % of the signal; +-: 95 %"
    show_tables([Table(rows, COLUMNS, title, note)], console())
