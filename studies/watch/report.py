"""What does a save of a watched file bring? As a line of JSON, as a table, in words.

>>> print_save(save, before)                            # doctest: +SKIP
"""

from __future__ import annotations

import json
from datetime import datetime
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from studies.core.folder import to_json
from studies.core.options import show_differences

if TYPE_CHECKING:
    from studies.watch.watch import Save

PLANTS = ("assumed_modes", "chain")
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
    }
    if save is not None:
        content |= {
            "save": save.number,
            "clamped_hz": {plant: save.modes.clamped_hz[plant] for plant in PLANTS},
            "joint_free_hz": {plant: save.modes.joint_free_hz[plant] for plant in PLANTS},
            "damping_ratio": save.modes.damping_ratio,
            "tip_rms": save.tip_rms,
            "differences": [row._asdict() for row in save.changes],
        }
    return json.dumps(json.loads(to_json(content)))


def print_save(save: Save, before: Save | None) -> None:
    """Print what a save changes from the default, and from the one before."""
    console = Console(highlight=False)
    show_differences(save.robot, console)
    since = f"; change: since save {before.number}" if before else ""
    table = Table(title=f"{save.when:%H:%M:%S} save {save.number}{since}", title_justify="left")
    table.add_column("")
    for heading in ("assumed modes", "change", "chain", "change"):
        table.add_column(heading, justify="right")
    for row in frequency_rows(save, before):
        table.add_row(*row[:5])
    console.print(table)
    console.print(f"{tip_line(save, before)}\n")


def frequency_rows(save: Save, before: Save | None) -> list[list[str]]:
    """Return a row per mode: name, assumed modes and change, chain and change, the paper's beam."""
    found = []
    for name, by_plant in save.rows().items():
        earlier = before.rows().get(name) if before else None
        for i in range(len(by_plant["chain"])):
            cells = [name.replace(" [", f" {i + 1} [")]
            for plant in PLANTS:
                value = by_plant[plant][i]
                cells += [number(value), change(value, earlier[plant][i] if earlier else None)]
            found.append([*cells, number(by_plant["exact"][i]) if "exact" in by_plant else ""])
    return found


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
