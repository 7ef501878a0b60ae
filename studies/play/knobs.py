"""What one may turn while the loop runs, within which limits, and what it makes of a controller.

    >>> knobs = Knobs().turned("gain", 1.2)
    >>> retuned(controller, knobs).filters(1e-3)

All at their usual values, the controller, friction and hardware are those given, to the bit.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from numbers import Real
from typing import Any

import numpy as np

from controllers import Controller, Gains, TextbookPid
from flexsim.errors import ParameterError
from flexsim.loop.friction import LAWS, RESISTING, Friction
from studies.tuning.distributions import NAMES
from studies.tuning.found import AnyController, FoundController

PIVOT = 50.0  # [rad/s] where an operator's gain stays when its order changes: about the crossover
MS = 1e-3  # [s] the unit of time of a tuned controller's gains


@dataclass(frozen=True)
class Knob:
    """One of them: usual value, limits, what a key adds to it or multiplies it by, what it is."""

    usual: float
    low: float
    high: float
    by: float
    times: bool
    meaning: str

    def stepped(self, value: float, up: bool) -> float:
        """Return the value that a key makes of another, within the limits."""
        if self.times:
            moved = value * self.by if up else value / self.by
            if value == 0.0:
                moved = 0.1 if up else 0.0
            elif moved < 0.1 * self.usual and self.low == 0.0:
                moved = 0.0
        else:
            moved = round((value + self.by if up else value - self.by) / self.by) * self.by
        return float(min(max(moved, self.low), self.high))


LAW = "law"
KNOBS = {
    "gain": Knob(1.0, 0.0, 5.0, 1.05, True, "factor of all gains"),
    "proportional": Knob(1.0, 0.0, 5.0, 1.05, True, "factor of k3 and k6"),
    "differential": Knob(
        1.0, 0.0, 5.0, 1.05, True, "factor of k1, k2, k4 and k5, of the operators"
    ),
    "order": Knob(0.0, -0.5, 0.5, 0.02, False, "added to the orders of the operators"),
    "damping": Knob(1.0, 0.0, 20.0, 1.25, True, "factor of the beam's damping"),
    "delay": Knob(0.0, 0.0, 20.0, 1.0, False, "samples from measurement to torque"),
    LAW: Knob(
        0.0,
        0.0,
        len(LAWS) - 1.0,
        1.0,
        False,
        "friction: 0 none, 1 simulink, 2 jump, 3 oppos., 4 strib., 5 lugre",
    ),
    "friction": Knob(1.0, 0.0, 3.0, 1.1, True, "factor of dead zone and friction"),
    "payload": Knob(0.0, 0.0, 1.0, 0.01, False, "carried at the tip [kg]"),
}


@dataclass(frozen=True)
class Knobs:
    """Where they stand; names as in `KNOBS`."""

    gain: float = 1.0
    proportional: float = 1.0
    differential: float = 1.0
    order: float = 0.0
    damping: float = 1.0
    delay: float = 0.0
    law: float = 0.0
    friction: float = 1.0
    payload: float = 0.0

    def turned(self, name: str, value: Any) -> Knobs:
        """Return the same with one of them elsewhere.

        Raises:
            ParameterError: there is none of that name, or the value is no number within its limits.
        """
        if name not in KNOBS:
            raise ParameterError(f"knob {name!r} is unknown; choose one of {', '.join(KNOBS)}")
        knob = KNOBS[name]
        good = isinstance(value, Real) and not isinstance(value, bool)
        if not good or not knob.low <= value <= knob.high:
            raise ParameterError(
                f"{name} is {value!r}; give a number from {knob.low:g} to {knob.high:g}"
            )
        if name in ("delay", LAW) and value != int(value):
            raise ParameterError(f"{name} is {value!r}; give a whole number")
        return replace(self, **{name: float(value)})


def retuned(controller: AnyController, knobs: Knobs) -> AnyController:
    """Return a controller as the knobs make it.

    Raises:
        ParameterError: its orders are whole numbers that cannot be moved.
    """
    p, d = knobs.gain * knobs.proportional, knobs.gain * knobs.differential
    scaled: AnyController = controller
    if p != 1.0 or d != 1.0:
        scaled = _scaled(controller, (d, d, p, d, d, p))
    if knobs.order == 0.0:
        return scaled
    if isinstance(scaled, FoundController):
        return _found_shifted(scaled, knobs.order)
    if isinstance(scaled, TextbookPid):
        raise ParameterError(f"controller {scaled.name!r} is a PID, whose orders are whole numbers")
    return _shifted(scaled, knobs.order)


def _scaled(controller: AnyController, factors: tuple[float, ...]) -> AnyController:
    if isinstance(controller, FoundController):
        return controller.scaled(np.array(factors))
    return controller.scaled(factors)


def _shifted(controller: Controller, order: float) -> Controller:
    """Return a controller whose operators' orders are another, equal in size at PIVOT."""
    factor = PIVOT**-order

    def moved(gains: Gains) -> Gains:
        nu1, nu2 = (None if nu is None else nu + order for nu in (gains.nu1, gains.nu2))
        return replace(gains, k1=factor * gains.k1, nu1=nu1, k2=factor * gains.k2, nu2=nu2)

    return replace(controller, joint1=moved(controller.joint1), joint2=moved(controller.joint2))


def _found_shifted(controller: FoundController, order: float) -> FoundController:
    """Return the same of a run's controller, whose time is in milliseconds."""
    if controller.tuning.controller == "pid":
        raise ParameterError(
            f"controller {controller.name!r} is a PID, whose orders are whole numbers"
        )
    parameters = controller.parameters.copy()
    for i, name in enumerate(NAMES):
        if name.startswith("nu"):
            parameters[i] += order
            parameters[i - 1] *= (PIVOT * MS) ** -order
    return replace(controller, parameters=parameters)


def friction_at(own: Friction, knobs: Knobs) -> Friction:
    """Return friction as the knobs have it: another law, dead zone and friction times a factor.

    mu is friction under laws that oppose motion only; under 'simulink' and 'jump' it is the
    torque's gain, and stays.
    """
    law, f = LAWS[int(knobs.law)], knobs.friction
    if law == own.law and f == 1.0:
        return own
    zone = tuple((f * low, f * high) for low, high in own.dead_zone)
    mu = tuple(f * each for each in own.mu) if law in RESISTING else own.mu
    tau_0 = tuple(f * each for each in own.tau_0)
    return replace(own, law=law, dead_zone=zone, tau_0=tau_0, mu=mu)  # type: ignore[arg-type]


def told(name: str, value: float) -> str:
    """Return a knob's value in words."""
    if name == LAW:
        return LAWS[int(value)]
    if name == "delay":
        return f"{int(value)} samples"
    if name == "payload":
        return f"{1e3 * value:.0f} g"
    return f"{value:+.2f}" if name == "order" else f"x {value:.3g}"
