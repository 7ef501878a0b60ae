"""The robot's physical numbers, (17)-(31), each with its unit, its source and what we assumed.

    >>> from flexsim import Parameters
    >>> Parameters().m_b
    0.0785

Everything else in the project, the MJCF included, is computed from here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from numbers import Real
from typing import Any

from flexsim.errors import ParameterError

PRINTED_BETA_L = (1.8751, 4.6941, 7.8548)  # (28)-(30), five digits; the plants use exact roots
PRINTED_I_b = 99e-4  # (23) [kg m2], two digits; the plants use rho((r+L)^3 - r^3)/3

FIRST_ROOT = 1.8751040687119611  # beta_1 L, (28) in full; `flexsim.arm.beam` computes all roots
# zeta, by default 1e-3, ranges from 1e-4 to 3e-4 for iron in bending (half the loss factors of
# Cremer and Heckl, Structure-Borne Sound, 1988) over less than 1e-2 for metals to 3e-2 to 7e-2 for
# metal structures with joints (Adams and Askenazi, Building Better Products with Finite Element
# Analysis, 1999); a strip of steel in a clamp lies towards the low end. The paper's has none
MAY_BE_ZERO = ("r", "F_1", "F_2", "I_m1", "I_m2", "zeta", "payload", "payload_inertia")
SMALLEST, LARGEST = 1e-30, 1e30  # SI: beyond, products and powers of them leave doubles


def _number(default: Any, unit: str, source: str, meaning: str, assumed: bool = False) -> Any:
    """Return a dataclass field that carries its unit, equation and meaning."""
    metadata = {"unit": unit, "source": source, "meaning": meaning, "assumed": assumed}
    return field(default=default, metadata=metadata)


@dataclass(frozen=True)
class Parameters:
    """Physical parameters of the arm, in SI units and the paper's symbols.

    The moment of inertia and the mass of the flexible link follow from `rho`, `r` and `L`;
    the paper prints them rounded, (23) and (25).

    Raises:
        ParameterError: a value is not finite, or negative, or zero where it must not be.
    """

    L_R: float = _number(0.32, "m", "(17)", "length of the rigid link")
    I_R0: float = _number(0.25, "kg m2", "(18)", "inertia of the rigid link about joint 1")
    I_H: float = _number(13.22e-4, "kg m2", "(19)", "inertia of the hub about joint 2")
    m_H: float = _number(0.47, "kg", "(20)", "mass of the hub")
    r: float = _number(0.075, "m", "(21)", "radius of the hub, where the beam is clamped")
    L: float = _number(0.5, "m", "(22)", "length of the flexible link")
    rho: float = _number(0.157, "kg/m", "(24)", "linear density of the flexible link")
    EI: float = _number(0.349, "N m2", "(26)", "bending stiffness of the flexible link")
    F_1: float = _number(2.0e-4, "N m s/rad", "(31)", "viscous friction of joint 1")
    F_2: float = _number(2.3e-4, "N m s/rad", "(31)", "viscous friction of joint 2")
    I_m1: float = _number(0.0, "kg m2", "(36)", "inertia of motor 1, at the joint", assumed=True)
    I_m2: float = _number(0.0, "kg m2", "(38)", "inertia of motor 2, at the joint", assumed=True)
    r_1: float = _number(1.0, "-", "(36)", "transmission relation of joint 1", assumed=True)
    r_2: float = _number(1.0, "-", "(37)", "transmission relation of joint 2", assumed=True)
    zeta: float = _number(
        1e-3, "-", "structural", "damping ratio of the clamped beam's mode 1, without payload", True
    )
    payload: float = _number(0.0, "kg", "none", "mass of a payload at the tip", assumed=True)
    payload_inertia: float = _number(
        0.0, "kg m2", "none", "inertia of the payload about the tip", assumed=True
    )

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if type(value) is float and SMALLEST <= value <= LARGEST:
                continue  # as nearly all are
            lowest = "0 or more" if item.name in MAY_BE_ZERO else "more than 0"
            number = isinstance(value, Real) and not isinstance(value, bool)
            good = number and math.isfinite(value)
            if not good or value < 0 or (value == 0 and item.name not in MAY_BE_ZERO):
                meaning, unit = item.metadata["meaning"], item.metadata["unit"]
                raise ParameterError(
                    f"parameter {item.name} ({meaning}) is {value!r}; give a finite number, "
                    f"{lowest} [{unit}]"
                )
            if value > LARGEST or (value < SMALLEST and item.name not in MAY_BE_ZERO):
                meaning, unit = item.metadata["meaning"], item.metadata["unit"]
                raise ParameterError(
                    f"parameter {item.name} ({meaning}) is {value:g}; give {SMALLEST:g} to "
                    f"{LARGEST:g} [{unit}]"
                )

    @property
    def m_b(self) -> float:
        """Mass of the flexible link [kg], (25)."""
        return self.rho * self.L

    @property
    def I_b(self) -> float:
        """Moment of inertia of the straight flexible link about joint 2 [kg m2]; (23) rounds it."""
        return self.rho * ((self.r + self.L) ** 3 - self.r**3) / 3

    @property
    def reach(self) -> float:
        """Distance from joint 2 to the tip of the straight flexible link [m]."""
        return self.r + self.L

    @property
    def eta(self) -> float:
        """Kelvin-Voigt time of the beam's material: damping is `eta` times stiffness [s].

        2 zeta / omega_1 with the first clamped-free frequency without payload, (15) and (28), so
        that mode i has the damping ratio zeta omega_i / omega_1.
        """
        omega_1 = FIRST_ROOT**2 / self.L**2 * math.sqrt(self.EI / self.rho)
        return 2 * self.zeta / omega_1

    @property
    def static_compliance(self) -> float:
        """Tip deflection of the clamped beam per unit tip force [m/N]."""
        return self.L**3 / (3 * self.EI)


# what `describe` says, so that the options --robot.* say it too
Parameters.__doc__ = f"{Parameters.__doc__}\n    Attributes:\n" + "".join(
    f"        {item.name}: {item.metadata['meaning']} [{item.metadata['unit']}]"
    f"{', assumed' if item.metadata['assumed'] else ''}.\n"
    for item in fields(Parameters)
)


def paper() -> Parameters:
    """Return the robot as the paper has it: its beam is without damping."""
    return Parameters(zeta=0.0)


def describe(parameters: Parameters) -> list[dict[str, Any]]:
    """Return one row per parameter: name, value, unit, source, meaning, assumed."""
    return [
        {"name": item.name, "value": getattr(parameters, item.name), **item.metadata}
        for item in fields(parameters)
    ]
