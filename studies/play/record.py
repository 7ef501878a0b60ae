"""What was seen of both arms since the start, as a recording; what was done to them beside it.

>>> write_play(Path("play.rrd"), live, about)     # and play.json, which --replay takes
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from flexsim.errors import ParameterError
from flexsim.loop.trajectories import Reference
from flexsim.numerics.types import Array
from flexsim.recording.case import Case
from flexsim.recording.rrd import write_recording
from studies.core.folder import to_json
from studies.core.text import plain
from studies.core.version import version
from studies.play.events import plain_event, write_events
from studies.play.live import Live
from studies.play.periods import row_of

EVENTS_SHOWN = 200  # in the recording's text; the file beside it has all


def events_path(path: Path) -> Path:
    """Return where the events of a recording go.

    Raises:
        ParameterError: the recording has no name of its own, or that of its events.
    """
    if path.suffix != ".rrd":
        raise ParameterError(f"--record {path}: give a name that ends in .rrd")
    return path.with_suffix(".json")


def write_play(path: Path, live: Live, facts: Mapping[str, Any]) -> None:
    """Write a recording of both arms, and the events beside it, whole or not at all.

    Args:
        path: ends in .rrd. facts: about the loop.

    Raises:
        ParameterError: nothing was seen yet. RunError: a file cannot be written.
    """
    beside = events_path(path)
    if live.period == 0:
        raise ParameterError("nothing has moved yet; let it run before it is recorded")
    stage = live.stage
    motions = {arm.body.plant.name: arm.motion(stage.reference) for arm in live.arms}
    case = Case(
        name="play",
        trajectory=str(facts["trajectory"]),
        controllers=str(facts["controller"]),
        setting=str(facts["setting"]),
        motions=motions,
        chain_model=stage.mujoco.model if stage.mujoco.name == "chain" else None,
        reference=_seen_reference(live),
        hardware=str(facts["hardware"]),
    )
    events = [to_json(plain_event(event)) for event in live.done]
    more = f" and {len(events) - EVENTS_SHOWN} more" if len(events) > EVENTS_SHOWN else ""
    said = [plain(" ".join(event.split()), 200) for event in events[:EVENTS_SHOWN]]
    metadata = {
        "flexsim": version(),
        "events": "; ".join(said) + more if said else "none",
        "seed": str(facts["seed"]),
    }
    write_events(beside, live.done, live.period, facts)
    write_recording(path, [case], metadata, stage.modes.parameters)


def _seen_reference(live: Live) -> Reference:
    """Return the reference as the loop had it, for as long as it ran."""
    ref = live.stage.reference
    first = min(arm.blocks[0].first for arm in live.arms)
    periods = np.arange(first, live.period, dtype=float)
    rows = [row_of(int(k), len(ref.time), live.stage.again) for k in periods]
    time: Array = live.length * periods
    return Reference(time, ref.tip[rows], ref.joint[rows])
