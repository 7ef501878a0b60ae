"""What may make a laboratory worse than its simulation: suspects, as data.

>>> SUSPECTS["payload"].at(Place(), 0.02).parameters.payload
0.02

Section 4 of the paper names three: vibration that is measured inaccurately, too few modes, friction
that depends on temperature and configuration. What it does not name, but any bench has, is beside
them. A suspect has one size, 0 for absent, which changes one number or several that belong
together; the largest size is stated with its source, and ranges reach down from it by decades.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce

from studies.laboratory.place import MORE, PER_TURN, PLUS, TIMES, Change, Place

MEASURED, MODES, FRICTION, OTHERS = (
    "v measured inaccurately",
    "too few modes",
    "friction that varies",
    "not named by the paper",
)
CAUSES = (MEASURED, MODES, FRICTION, OTHERS)
ASSUMED = "assumed"


@dataclass(frozen=True)
class Suspect:
    """One thing that may be other than in the simulation.

    Attributes:
        name: a word. cause: one of `CAUSES`. meaning: of the size, a line.
        unit, scale: of sizes as they are shown, from SI to that.
        most: the largest size [SI]. source: of that.
        changes: what a size does. signs: of the sizes, (1, -1) where either may be.
        sized: whether there is more than being there or not.
    """

    name: str
    cause: str
    meaning: str
    unit: str
    scale: float
    most: float
    source: str
    changes: tuple[Change, ...]
    signs: tuple[int, ...] = (1,)
    sized: bool = True

    def at(self, place: Place, size: float) -> Place:
        """Return a place with this of a size [SI], of either sign."""
        return reduce(lambda found, change: change.made(found, size), self.changes, place)


def _one(name: str, cause: str, meaning: str, most: float, *changes: Change, **more: object) -> Suspect:
    """Return a suspect whose size is a share in per cent unless told otherwise."""
    usual: dict[str, object] = {"unit": "%", "scale": 100.0, "source": ASSUMED}
    return Suspect(name, cause, meaning, most=most, changes=changes, **(usual | more))  # type: ignore[arg-type]


EITHER = (1, -1)
LIST = (
    _one(
        "noise", MEASURED, "rms of the noise on v, beyond the bench's", 3e-3,
        Change("hardware.noise_v", PLUS), unit="mm", scale=1e3,
    ),
    _one(
        "modes", MODES, "modes of the arm, or segments, beyond the simulation's", 4.0,
        Change("plant.size", MORE), unit="", scale=1.0,
    ),
    _one("Coulomb", FRICTION, "tau_0 of Table 4", 0.5, Change("friction.tau_0", TIMES), signs=EITHER),
    _one(
        "dead-zone", FRICTION, "edges of Table 4's dead zones", 0.5,
        Change("friction.dead_zone", TIMES), signs=EITHER,
    ),
    _one("slope", FRICTION, "mu of Table 4", 0.5, Change("friction.mu", TIMES), signs=EITHER),
    _one("EI", OTHERS, "stiffness of the beam", 0.3, Change("robot.EI", TIMES), signs=EITHER),
    _one("zeta", OTHERS, "damping that is missing", 1.0, Change("robot.zeta", TIMES, -1.0)),
    _one(
        "payload", OTHERS, "mass at the tip", 0.1, Change("robot.payload", PLUS),
        unit="g", scale=1e3,
    ),
    _one(
        "delay", OTHERS, "samples of delay beyond the bench's", 2.0,
        Change("hardware.delay", MORE), unit="", scale=1.0,
    ),
    _one("lag", OTHERS, "time constant of the motors", 1e-3, Change("hardware.lag"), unit="ms", scale=1e3),
    _one(
        "counts", OTHERS, "angle of an encoder's count", 0.0245,
        Change("hardware.counts", PER_TURN), unit="mrad", scale=1e3,
    ),
    _one("ripple", OTHERS, "amplitude of the torque ripple", 0.3, Change("effects.ripple")),
)
SUSPECTS = {each.name: each for each in LIST}
