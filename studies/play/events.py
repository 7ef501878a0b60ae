"""What was done to a loop while it ran, period by period: kept, written, and done again.

    >>> events = read_events(Path("play.json"), facts)
    >>> write_events(Path("play.json"), events, periods=5000, facts=facts)

The same events on the same loop make the same motion, to the bit.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flexsim.errors import ParameterError
from flexsim.files.atomic import write_text
from flexsim.files.reading import MIB, read_text
from studies.core.folder import to_json
from studies.core.text import spelled
from studies.play.pushes import Point

FORMAT = "flexsim-play-events-1"
EVENTS_MOST = 64 * MIB
PERIODS_MOST = 10**8  # a day at 1 kHz
FORCE_MOST = 1e3  # [N], and [N m]


@dataclass(frozen=True)
class Turn:
    """A knob is set from a period on."""

    period: int
    knob: str
    value: float


@dataclass(frozen=True)
class Shove:
    """A force is on a point from a period on, until the next one; of nothing, it ends.

    Attributes:
        force: (fx, fy) [N], torque about z [N m], in the world.
        point: where; None for the tip.
    """

    period: int
    force: tuple[float, float]
    torque: float = 0.0
    point: Point | None = None

    @property
    def ends(self) -> bool:
        """Whether it is none."""
        return self.force == (0.0, 0.0) and self.torque == 0.0


Event = Turn | Shove


def plain_event(event: Event) -> dict[str, Any]:
    """Return an event as JSON has it."""
    if isinstance(event, Turn):
        return {"period": event.period, "knob": event.knob, "value": event.value}
    found: dict[str, Any] = {"period": event.period, "push": list(event.force)}
    if event.torque:
        found["torque"] = event.torque
    if event.point is not None:
        found |= {"body": event.point.body, "at": list(event.point.at)}
    return found


def write_events(
    path: Path, events: Sequence[Event], periods: int, facts: Mapping[str, Any], force: bool = True
) -> None:
    """Write what was done, for how long, and in which loop.

    Raises:
        RunError: the file cannot be written.
    """
    plain = [plain_event(event) for event in events]
    content = {"format": FORMAT, "loop": dict(facts), "periods": periods, "events": plain}
    write_text(path, to_json(content) + "\n", "the events", force)


def read_events(path: Path, facts: Mapping[str, Any]) -> tuple[list[Event], int]:
    """Return what was done, in order, and for how many periods.

    Args:
        facts: of the loop that is to have it done again; those that the file has must be the same.

    Raises:
        RunError: the file cannot be read. ParameterError: it holds something else, or is of
            another loop.
    """
    text = read_text(path, EVENTS_MOST, "file of events")
    name = spelled(path)
    try:
        content = json.loads(text)
    except (ValueError, RecursionError):
        raise ParameterError(f"{name} is no JSON; give a file that flexsim play wrote") from None
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise ParameterError(f"{name} has not the format {FORMAT!r}; give one of flexsim play's")
    loop = content.get("loop", {})
    for key, value in (loop if isinstance(loop, dict) else {}).items():
        if key in facts and facts[key] != value:
            raise ParameterError(
                f"{name} is of a loop whose {spelled(key)} is {spelled(str(value))}, not "
                f"{spelled(str(facts[key]))}; give the same"
            )
    for key in ("events", "periods"):
        if key not in content:
            raise ParameterError(f"{name} is damaged: it has no {key}")
    if not isinstance(content["events"], list):
        raise ParameterError(f"{name} is damaged: its events are no list")
    events = [
        _read_event(each, f"{name}: event {i + 1}") for i, each in enumerate(content["events"])
    ]
    try:
        periods = _whole(content["periods"])
    except (TypeError, ValueError) as error:
        raise ParameterError(f"{name} is damaged: {spelled(str(error))}") from None
    order = [event.period for event in events]
    if order != sorted(order):
        raise ParameterError(f"{name} is damaged: its events are not in order")
    return events, periods


def _read_event(plain: Any, name: str) -> Event:
    """Return an event from JSON.

    Raises:
        ParameterError: it is none; `name` says which.
    """
    if not isinstance(plain, dict):
        raise ParameterError(f"{name} is damaged: it is {spelled(str(plain))}, no object")
    try:
        return _event(plain)
    except KeyError as error:
        raise ParameterError(f"{name} is damaged: it has no {error.args[0]}") from None
    except (TypeError, ValueError, OverflowError) as error:
        raise ParameterError(f"{name} is damaged: {spelled(str(error))}") from None


def _whole(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= PERIODS_MOST:
        raise ValueError(f"{value!r} is no number of periods")
    return value


def _number(value: Any, most: float) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= most:
        raise ValueError(f"{value!r} is no number up to {most:g}")
    return float(value)


def _event(plain: Any) -> Event:
    """Return an event from JSON.

    Raises:
        KeyError, TypeError, ValueError: it is none.
    """
    period = _whole(plain["period"])
    if "knob" in plain:
        return Turn(period, str(plain["knob"]), _number(plain["value"], PERIODS_MOST))
    fx, fy = (_number(each, FORCE_MOST) for each in plain["push"])
    torque = _number(plain.get("torque", 0.0), FORCE_MOST)
    if "body" not in plain:
        return Shove(period, (fx, fy), torque)
    body = plain["body"]
    if isinstance(body, bool) or not isinstance(body, str | int):
        raise ValueError(f"{body!r} is no body")
    x, y, z = (_number(each, FORCE_MOST) for each in plain["at"])
    return Shove(period, (fx, fy), torque, Point(body, (x, y, z)))


def push_events(given: Sequence[float], period: float) -> list[Event]:
    """Return the events of a push at the tip that is given as numbers.

    Args:
        given: none, or start [s], fx, fy [N] and, unless 0.1 s, duration [s]. period: [s].

    Raises:
        ParameterError: another number of them, or one that cannot be used.
    """
    if not given:
        return []
    if len(given) not in (3, 4):
        raise ParameterError(
            f"--push has {len(given)} numbers; give when [s], FX, FY [N] and perhaps how long [s]"
        )
    start, fx, fy, duration = (*given, 0.1)[:4]
    late = PERIODS_MOST * period
    if not (0 <= start <= late and 0 < duration <= late and max(abs(fx), abs(fy)) <= FORCE_MOST):
        raise ParameterError(
            f"--push is {' '.join(f'{each:g}' for each in given)}; give a time from 0, forces "
            f"up to {FORCE_MOST:g} N and a duration above 0"
        )
    first, periods = round(start / period), max(1, round(duration / period))
    return [Shove(first, (float(fx), float(fy))), Shove(first + periods, (0.0, 0.0))]
