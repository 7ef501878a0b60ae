"""Where a run happens, as values, and how one number of it is changed.

>>> place = Place(setting=setting("simulink", HARDWARE["bench"]))
>>> Change("hardware.noise_v", PLUS).made(place, 1e-3).setting.hardware.noise_v
0.0011

Equal places are one: their runs are made once.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any, NamedTuple

from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.loop.hardware import IDEAL, Sensing
from flexsim.loop.settings import DEFAULT_SETTING, Setting, setting
from flexsim.plants.base import Plant
from flexsim.robot import Robot

PLANTS_KEPT = 2048


@dataclass(frozen=True)
class Place:
    """Where a run happens.

    Attributes:
        parameters, modal_damping: of a `Robot` without a file. setting: friction and hardware.
        plant: its name. size: modes or segments.
    """

    parameters: Parameters = field(default_factory=Parameters)
    modal_damping: tuple[float, ...] = ()
    setting: Setting = field(default_factory=lambda: setting(DEFAULT_SETTING))
    plant: str = "assumed-modes"
    size: int = 3

    @property
    def without_v(self) -> Place:
        """The same with v as it is: what is measured of it matters in no loop that ignores it."""
        hardware = self.setting.hardware
        its = replace(hardware, noise_v=0.0, sensing=Sensing(gear=hardware.sensing.gear))
        return replace(self, setting=replace(self.setting, hardware=its))

    def built(self) -> Plant:
        """Return the plant.

        Raises:
            ParameterError, ModelError: a robot without such a plant.
        """
        own = self.setting
        if own.steepest == (0.0, 0.0):  # nothing of the hardware bounds the step
            own = replace(own, hardware=IDEAL)
        return _plant(self.parameters, self.modal_damping, f"{self.plant}:{self.size}", own)


@lru_cache(maxsize=PLANTS_KEPT)
def _plant(
    parameters: Parameters, modal_damping: tuple[float, ...], name: str, own: Setting
) -> Plant:
    return Robot(parameters, modal_damping=modal_damping).plant(name, own)


class How(NamedTuple):
    """How a size changes a number: the new one from the old and the share of the size."""

    made: Callable[[Any, float], Any]
    words: str


IS = How(lambda old, x: x, "is the size")
PLUS = How(lambda old, x: old + x, "plus the size")
TIMES = How(lambda old, x: old * (1 + x), "times 1 + the size")
MORE = How(lambda old, x: old + round(x), "plus the size, whole")
PER_TURN = How(lambda old, x: max(1, round(2 * math.pi / x)) if x else old, "2 pi / the size")
SET = How(lambda old, x: old, "is the share itself, whatever the size")


class Change(NamedTuple):
    """What a size does to one number, or to a word, of a place.

    Attributes:
        path: hardware.X, sensing.X, effects.X, friction.X, robot.X or plant.size.
        how: as above. share: of the size that counts, one for each of a pair if they differ; or,
            under SET, what the number or word is.
    """

    path: str
    how: How = IS
    share: Any = 1.0

    def made(self, place: Place, size: float) -> Place:
        """Return a place with the number changed.

        Raises:
            ParameterError: a number that the place cannot have; there is no such path.
        """
        room, _, name = self.path.partition(".")
        hardware, friction = place.setting.hardware, place.setting.friction
        if room == "plant":
            return replace(place, **self._of(place, name, size))
        if room == "robot":
            own = replace(place.parameters, **self._of(place.parameters, name, size))
            return replace(place, parameters=own)
        if room == "friction":
            its = replace(
                place.setting, friction=replace(friction, **self._of(friction, name, size))
            )
            return replace(place, setting=its)
        if room == "hardware":
            built = replace(hardware, **self._of(hardware, name, size))
        elif room in ("sensing", "effects"):
            part = getattr(hardware, room)
            built = replace(hardware, **{room: replace(part, **self._of(part, name, size))})
        else:
            raise ParameterError(f"{self.path!r} is no path of a place")
        return replace(place, setting=replace(place.setting, hardware=built))

    def _of(self, owner: Any, name: str, size: float) -> dict[str, Any]:
        """Return the changed number by its name."""
        if self.how is SET:
            return {name: self.share}
        return {name: _spread(getattr(owner, name), self.share, size, self.how)}


def _spread(old: Any, share: Any, size: float, how: How) -> Any:
    """Return a number, or a tuple of them, changed; a tuple may have a share for each."""
    if not isinstance(old, tuple):
        return how.made(old, share * size)
    shares = share if isinstance(share, tuple) else (share,) * len(old)
    return tuple(_spread(each, part, size, how) for each, part in zip(old, shares, strict=True))
