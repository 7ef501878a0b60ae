"""What is written of filters for elsewhere: sections, sampling period, units, in plain words.

>>> exported = of_controller(controller_of("circle"), filters, 1e-3)
>>> exported.parts[0].sections.cascades

All text is plain (`studies.core.text.plain`), so that a folder's name, which may be anything, can
be written into a comment or a string of any language.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from controllers import Factored, Filter, Sections, factored
from controllers.factored import SECOND, TOLERANCE
from studies.core.text import plain
from studies.tuning.found import (
    AnyController,
    FoundController,
    devised_for,
    label_of,
    v_gain_of,
)
from studies.tuning.kept import described

LONG = 300  # characters of a line that says where a controller is from
TORQUE, ERROR = "N m", "rad"


@dataclass(frozen=True, eq=False)
class Part:
    """One filter: of a joint, or of an operator.

    Attributes:
        name: an identifier in every language. takes, gives: in words. units: of both.
        factored: its sections.
    """

    name: str
    takes: str
    gives: str
    units: tuple[str, str]
    factored: Factored

    @property
    def sections(self) -> Sections:
        """A sum of cascades."""
        return self.factored.sections

    @property
    def words(self) -> str:
        """What its sections are, in words."""
        parts = [each for cascade in self.sections.cascades for each in cascade]
        small = sum(max(b.size, a.size) - 1 <= SECOND for b, a in parts)
        taps = [b.size for b, a in parts if a.size == 1 and b.size - 1 > SECOND]
        said = [f"{small} section{'s' * (small > 1)} of second order at most"] if small else []
        said += [f"{count} taps" for count in taps]
        said += [f"one section of order {order}" for order in self.factored.whole]
        return ", ".join(said)

    @property
    def note(self) -> str:
        """Why a section is of high order; empty if none is."""
        if not self.factored.whole:
            return ""
        orders = " and ".join(map(str, self.factored.whole))
        return (
            f"{self.name}: the polynomials of order {orders} are kept whole: sections of second "
            f"order would change the response by more than {TOLERANCE:g} of itself"
        )


@dataclass(frozen=True, eq=False)
class Exported:
    """Filters of one sampling period.

    Attributes:
        title, source: what they are, and where from. period: [s]. parts: the filters.
        facts: what else JSON has.
    """

    title: str
    source: str
    period: float
    parts: tuple[Part, ...]
    facts: dict[str, Any] = field(default_factory=dict)

    @property
    def notes(self) -> list[str]:
        """What is to be known of sections that are none of second order."""
        return [part.note for part in self.parts if part.note]

    @property
    def about(self) -> list[str]:
        """Lines for the head of a file."""
        return [
            self.title,
            *([self.source] if self.source else []),
            f"Sampling period: {self.period:.17g} s",
            *(
                f"{part.name}: takes {part.takes} [{part.units[0]}], gives {part.gives} "
                f"[{part.units[1]}]: {part.words}"
                for part in self.parts
            ),
            *self.notes,
        ]


def of_controller(
    controller: AnyController, filters: Sequence[Filter | Sections], period: float
) -> Exported:
    """Return what is written of a controller's two filters.

    Raises:
        ControllerError: a filter is none.
    """
    v_gain = v_gain_of(controller)
    second = f"theta2_ref - (theta2 + ({v_gain:g}) atan(v / (r + L)))"
    errors = ("theta1_ref - theta1", second if v_gain else "theta2_ref - theta2")
    parts = tuple(
        Part(
            f"joint{j}",
            f"the error {error}",
            f"the torque of joint {j}",
            (ERROR, TORQUE),
            factored(each),
        )
        for j, (error, each) in enumerate(zip(errors, filters, strict=True), start=1)
    )
    return Exported(
        f"Controller: {label_of(controller)}, tuned for the {devised_for(controller)}",
        plain(_source(controller), LONG),
        period,
        parts,
        {"controller": controller.name, "v_gain": v_gain},
    )


def _source(controller: AnyController) -> str:
    """Return in one line where a controller is from."""
    if isinstance(controller, FoundController):
        return f"Found by flexsim tune: {described(controller.tuning)}"
    return controller.source


def of_operator(given: Filter, words: str, order: float, period: float) -> Exported:
    """Return what is written of the filter of one operator.

    Args:
        given: `(b, a)`. words: what it is. order: of the operator. period: [s].

    Raises:
        ControllerError: the filter is none.
    """
    part = Part("operator", "any signal", "its derivative", ("1", f"s^{-order:g}"), factored(given))
    return Exported(plain(f"Operator: {words}", LONG), "", period, (part,), {"order": order})
