"""Fractional designs by rule, each of a few knobs, for the joints of a robot.

    rule = RULES["flat-phase"]
    c1, c2 = rule.design([30.0, 0.8, 30.0, 0.8], inertias=(0.3177, 0.0112), period=1e-3)
    rule.knobs                                  # names, units, ranges

Every rule's own module has its source, what it assumes, and the rule itself for plants other than a
joint. Their plant is `controllers.rules.joint.RigidJoint`.

Ranges are those of `controllers.shaped` where knobs are the same. Of 200 random draws these hold in
the loop that `controllers.shaped` tells, in %, line, two-loop and circle: valerio-s 65, 62, 65 with
v ignored and 69, 65, 66 with it mirrored, valerio-critical 69, 63, 67 and 82, 79, 80, of the others
all. Designs take 0.3 to 2 ms, `five` 20.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import NamedTuple

from controllers.knobs import Knob
from controllers.rules import five, flat, lead, valerio
from controllers.rules.joint import RigidJoint
from controllers.sections import Sections


class Rule(NamedTuple):
    """A rule as a search uses it."""

    text: str
    """What it is, in a line."""
    knobs: tuple[Knob, ...]
    """Of both joints."""
    design: Callable[..., tuple[Sections, Sections]]
    """Of (knobs, inertias [kg m2], period [s], delay [s])."""
    numbers: Callable[..., dict[str, float]]
    """What one joint's design comes to, of (its knobs, inertia, period, delay)."""


RULES: Mapping[str, Rule] = MappingProxyType(
    {
        "flat-phase": Rule(
            "Luo and Chen's fractional PD whose phase is flat at the crossing (iso-damping)",
            flat.KNOBS,
            flat.design,
            flat.numbers,
        ),
        "five": Rule(
            "Monje and Vinagre's five specifications: crossing, margin, flat phase, both ends",
            five.KNOBS,
            five.design,
            five.numbers,
        ),
        "lead": Rule(
            "a fractional lead by its phase margin over a range of payloads",
            lead.KNOBS,
            lead.design,
            lead.numbers,
        ),
        "valerio-s": Rule(
            "Valerio and Sa da Costa's, by the S-shaped response of the joint in a rate loop",
            valerio.KNOBS,
            valerio.design,
            valerio.numbers,
        ),
        "valerio-critical": Rule(
            "Valerio and Sa da Costa's, by the critical gain of the joint in a rate loop",
            valerio.KNOBS,
            valerio.design_critical,
            valerio.numbers_critical,
        ),
    }
)
"""Name -> rule."""

__all__ = ["RULES", "RigidJoint", "Rule", "five", "flat", "lead", "valerio"]
