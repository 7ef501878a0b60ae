"""What does a save of a watched file bring? As a line of JSON, as a table, in words.

>>> show_save(save, before)                            # doctest: +SKIP
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime

from studies.core.console import console
from studies.core.folder import to_json
from studies.core.options import show_differences
from studies.core.paper import PLANT_KEYS
from studies.core.table import Column, Table
from studies.core.text import spelled
from studies.watch.loop_report import loop_json, loop_table
from studies.watch.save import Save

SAME = 5e-4  # [%] of a number, and less, is no change


def json_line(when: datetime, save: Save | None = None, error: str | None = None) -> str:
    """Return one line of JSON about a save; without one, about what is wrong."""
    content: dict[str, object] = {
        "time": when.isoformat(timespec="seconds"),
        "ok": save is not None,
        "error": error,
        "save": None,
        "clamped_hz": None,
        "joint_free_hz": None,
        "damping_ratio": None,
        "tip_rms": None,
        "differences": None,
        **loop_json(save.loop if save is not None else None),
    }
    if save is not None:
        content |= {
            "save": save.number,
            "clamped_hz": {plant: save.modes.clamped_hz[plant] for plant in PLANT_KEYS},
            "joint_free_hz": {plant: save.modes.joint_free_hz[plant] for plant in PLANT_KEYS},
            "damping_ratio": save.modes.damping_ratio,
            "tip_rms": save.tip_rms,
            "differences": [row._asdict() for row in save.changes],
        }
    return json.dumps(json.loads(to_json(content)))


def show_save(save: Save, before: Save | None) -> None:
    """Print what a save changes from the default, and from the one before."""
    out = console()
    show_differences(save.robot, out)
    since = f"; change: since save {before.number}" if before else ""
    title = f"{save.when:%H:%M:%S} save {save.number}{since}"
    out.print(Table(frequency_rows(save, before), COLUMNS, title).render())
    out.print(f"{tip_line(save, before)}\n")
    if save.loop is not None and save.loop.problem:
        out.print(f"No loop could be closed: {spelled(save.loop.problem)}\n")
    elif save.loop is not None:
        out.print(loop_table(save.loop, before.loop if before else None).render())


@dataclass(frozen=True)
class FrequencyRow:
    """One frequency or damping ratio of both plants, now and before, and of the paper's beam."""

    name: str
    now: Mapping[str, float]
    before: Mapping[str, float]
    beam: float | None


def frequency_rows(save: Save, before: Save | None) -> list[FrequencyRow]:
    """Return a row per mode and kind."""
    found = []
    for name, by_plant in save.rows().items():
        earlier = before.rows().get(name, {}) if before else {}
        for i in range(len(by_plant["chain"])):
            now, past = (
                {plant: float(figures[i]) for plant, figures in each.items()}
                for each in (by_plant, earlier)
            )
            label = name.replace(" [", f" {i + 1} [")
            found.append(FrequencyRow(label, now, past, now.get("exact")))
    return found


def _figure(plant: str) -> Column:
    """Return the column of a plant's figures."""
    return Column(plant, form=lambda row: number(row.now[plant]))


def _change(plant: str) -> Column:
    """Return the column of what has changed since the save before."""
    return Column("change", form=lambda row: change(row.now[plant], row.before.get(plant)))


COLUMNS = (
    Column("name", ""),
    *(column(plant) for plant in PLANT_KEYS for column in (_figure, _change)),
)
BEAM = Column("beam", "paper's beam", form=lambda row: number(row.beam) if row.beam else "")


def number(value: float) -> str:
    """Return a frequency or a damping ratio with six digits, or less where it is small."""
    return f"{value:#.6g}" if value >= 1 else f"{value:.6f}"


def change(value: float, before: float | None) -> str:
    """Return by how much a value has changed, in percent; nothing without one before."""
    if before is None or before == 0:
        return ""
    percent = 100 * (value / before - 1)
    return "=" if abs(percent) < SAME else f"{percent:+.3f} %"


def tip_line(save: Save, before: Save | None) -> str:
    """Return in words how far apart the two tips move in open loop."""
    was = f" (before: {1e6 * before.tip_rms:.2f})" if before else ""
    return (
        f"Open loop, 2 s: tips {1e6 * save.tip_rms:.2f} um apart, rms{was}; "
        f"|v| to {1e3 * save.v_max:.2f} mm"
    )
