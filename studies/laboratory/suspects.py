"""What may make a laboratory worse than its simulation: suspects, as data.

>>> SUSPECTS["payload"].at(Place(), 0.02).parameters.payload
0.02

Section 4 of the paper names three: vibration that is measured inaccurately, too few modes, friction
that depends on temperature and configuration. What it does not name, but any bench has, is beside
them. A suspect has one size, 0 for absent, which changes one number or several that belong
together; the largest size is stated with its source, and ranges reach down from it by decades. What
has no size, another estimator or another law, is there or not, and is tried alone only.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from typing import Any

from studies.laboratory.place import MORE, PER_TURN, PLUS, SET, TIMES, Change, Place

MEASURED, MODES, FRICTION, OTHERS = (
    "v measured inaccurately",
    "too few modes",
    "friction that varies",
    "not named by the paper",
)
CAUSES = (MEASURED, MODES, FRICTION, OTHERS)
ASSUMED = "assumed"
EITHER = (1, -1)
GAUGES = "assumed, far beyond the 1 % of gauge factors (Hoffmann, HBM 2012)"
WARMING = "assumed, after Bittencourt and Gunnarsson (2012): several tenths from cold to warm"
POSED = "assumed, after Armstrong-Helouvry (1991)"
GAPS = "assumed, after Nordin and Gutman (2002)"


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
        return reduce(lambda found, change: change.made(found, float(size)), self.changes, place)


def _share(
    name: str, cause: str, meaning: str, most: float, *changes: Change, **more: Any
) -> Suspect:
    """Return a suspect whose size is a share, shown in per cent."""
    usual: dict[str, Any] = {"unit": "%", "scale": 100.0, "source": ASSUMED}
    return Suspect(name, cause, meaning, most=most, changes=changes, **(usual | more))


def _strain(name: str, meaning: str, most: float, *changes: Change, **more: Any) -> Suspect:
    """Return a suspect of two strain bridges, shown in millionths of strain."""
    usual: dict[str, Any] = {"unit": "um/m", "scale": 1e6, "source": ASSUMED}
    return Suspect(
        name, MEASURED, meaning, most=most, changes=(BRIDGES, *changes), **(usual | more)
    )


def _there(name: str, cause: str, meaning: str, *changes: Change) -> Suspect:
    """Return a suspect without a size."""
    return Suspect(name, cause, meaning, "", 1.0, 1.0, ASSUMED, changes, sized=False)


MILLI = 1e3
BRIDGES = Change("sensing.estimator", SET, "two-bridges")
SHAFTS = (
    Change("effects.motor_inertia", SET, (0.03, 1.5e-3)),
    Change("effects.shaft", SET, (5e3, 5e2)),
    Change("effects.shaft_damping", SET, (5.0, 0.2)),
)
LIST = (
    Suspect(
        "noise",
        MEASURED,
        "rms of the noise on v, beyond the bench's",
        *("mm", MILLI, 3e-3, ASSUMED),
        (Change("hardware.noise_v", PLUS),),
    ),
    _share(
        "gain",
        MEASURED,
        "gain of both bridges",
        0.2,
        BRIDGES,
        Change("sensing.bridge_gain", PLUS),
        signs=EITHER,
        source=GAUGES,
    ),
    _share(
        "mismatch",
        MEASURED,
        "gain of one bridge up, of the other down",
        *(0.2, BRIDGES, Change("sensing.bridge_gain", PLUS, (1.0, -1.0))),
        signs=EITHER,
        source=GAUGES,
    ),
    _strain(
        "offset",
        "strain that both bridges read of a straight beam",
        1e-4,
        Change("sensing.bridge_offset"),
        signs=EITHER,
    ),
    _strain(
        "drift",
        "strain by which the bridges' offsets grow in a second",
        2e-5,
        Change("sensing.bridge_drift"),
        signs=EITHER,
        unit="um/m/s",
    ),
    _strain("strain-noise", "rms noise of both bridges", 1e-5, Change("sensing.bridge_noise")),
    _strain(
        "filter",
        "time constant of the bridges' filters",
        1e-2,
        Change("sensing.bridge_filter"),
        unit="ms",
        scale=MILLI,
    ),
    _strain(
        "mounting",
        "bridges farther out than the estimator knows",
        2e-2,
        Change("sensing.bridge_shift"),
        unit="mm",
        scale=MILLI,
        signs=EITHER,
    ),
    _there("two-bridges", MEASURED, "v of two exact bridges: mode 3 spills over", BRIDGES),
    _there(
        "one-bridge",
        MEASURED,
        "v of one exact bridge",
        Change("sensing.estimator", SET, "one-bridge"),
    ),
    _there(
        "quasi-static",
        MEASURED,
        "v of the shape under a force at the tip",
        Change("sensing.estimator", SET, "quasi-static"),
    ),
    _there(
        "kalman:1",
        MEASURED,
        "v of a Kalman filter of mode 1, exact bridges, the nominal robot",
        Change("sensing.estimator", SET, "kalman:1"),
    ),
    _there(
        "kalman:3",
        MEASURED,
        "v of a Kalman filter of modes 1 to 3, exact bridges, the nominal robot",
        Change("sensing.estimator", SET, "kalman:3"),
    ),
    Suspect(
        "modes",
        MODES,
        "modes of the arm, or segments, beyond the simulation's",
        *("", 1.0, 4.0, "assumed; studies/converge finds no more to tell"),
        (Change("plant.size", MORE),),
    ),
    _share(
        "temperature",
        FRICTION,
        "friction of the day, of Table 4's numbers",
        0.5,
        Change("effects.cold", PLUS),
        Change("effects.warm"),
        signs=EITHER,
        source=WARMING,
    ),
    _share(
        "warming",
        FRICTION,
        "friction at the start, gone with a time constant of 2 s",
        0.5,
        Change("effects.cold", PLUS),
        Change("effects.warming", SET, (2.0, 2.0)),
        signs=EITHER,
        source=WARMING,
    ),
    _share(
        "pose",
        FRICTION,
        "amplitude of friction over a turn",
        0.5,
        Change("effects.pose"),
        source=POSED,
    ),
    _share(
        "Coulomb", FRICTION, "tau_0 of Table 4", 0.5, Change("friction.tau_0", TIMES), signs=EITHER
    ),
    _share(
        "dead-zone",
        FRICTION,
        "edges of Table 4's dead zones",
        0.5,
        Change("friction.dead_zone", TIMES),
        signs=EITHER,
    ),
    _share("slope", FRICTION, "mu of Table 4", 0.5, Change("friction.mu", TIMES), signs=EITHER),
    _there(
        "opposing",
        FRICTION,
        "Table 4's numbers oppose the motion, not the torque",
        Change("friction.law", SET, "opposing"),
    ),
    _there("lugre", FRICTION, "the same by LuGre's bristles", Change("friction.law", SET, "lugre")),
    _there(
        "stribeck",
        FRICTION,
        "the same with Stribeck's stiction",
        Change("friction.law", SET, "stribeck"),
    ),
    _share("EI", OTHERS, "stiffness of the beam", 0.3, Change("robot.EI", TIMES), signs=EITHER),
    _share("zeta", OTHERS, "damping that is missing", 1.0, Change("robot.zeta", TIMES, -1.0)),
    Suspect(
        "payload",
        OTHERS,
        "mass at the tip",
        "g",
        MILLI,
        0.1,
        ASSUMED,
        (Change("robot.payload", PLUS),),
    ),
    Suspect(
        "delay",
        OTHERS,
        "samples of delay beyond the bench's",
        "",
        1.0,
        2.0,
        ASSUMED,
        (Change("hardware.delay", MORE),),
    ),
    Suspect(
        "lag",
        OTHERS,
        "time constant of the motors",
        "ms",
        MILLI,
        2e-3,
        ASSUMED,
        (Change("hardware.lag"),),
    ),
    Suspect(
        "amplifier",
        OTHERS,
        "time constant of the amplifiers",
        "ms",
        MILLI,
        2e-3,
        ASSUMED,
        (Change("effects.amplifier"),),
    ),
    Suspect(
        "counts",
        OTHERS,
        "angle of an encoder's count",
        "mrad",
        MILLI,
        0.0245,
        "256 counts a turn",
        (Change("hardware.counts", PER_TURN),),
    ),
    _share(
        "limit",
        OTHERS,
        "torque limits lower",
        0.6,
        Change("hardware.torque_limit", TIMES, -1.0),
        source="assumed; with more, motor 1 hardly gets out of its dead zone",
    ),
    _share("ripple", OTHERS, "amplitude of the torque ripple", 0.3, Change("effects.ripple")),
    Suspect(
        "cogging",
        OTHERS,
        "cogging torque of joint 1, a tenth at joint 2",
        "N m",
        1.0,
        1.0,
        ASSUMED,
        (Change("effects.cogging", share=(1.0, 0.1)),),
    ),
    Suspect(
        "backlash",
        OTHERS,
        "gap of both joints, motors of a tenth of the links' inertia",
        "mrad",
        MILLI,
        1e-2,
        GAPS,
        (*SHAFTS, Change("effects.backlash")),
    ),
    _there(
        "motor-encoders",
        OTHERS,
        "backlash of 5 mrad, and the encoders at the motors",
        *(*SHAFTS, Change("effects.backlash", SET, (5e-3, 5e-3))),
        Change("effects.encoder", SET, "motor"),
    ),
)
SUSPECTS = {each.name: each for each in LIST}
