"""Robots by their names: the paper's arm, one flexible link, and two flexible links.

    >>> arm = named_arm("two-flexible")
    >>> arm.parameters.L_R, arm.link1.EI
    (0.5, 1.0)

`one-link` is a beam on a motor whose base stands still: the arm with joint 1 locked. In
`two-flexible` link 1 bends as well; of a straight link 1 the parameters say all, `FirstLink` what
share of it is the beam.

Source of both: the arm of A. De Luca and B. Siciliano, Closed-form dynamic model of planar
multilink lightweight robots, IEEE Transactions on Systems, Man, and Cybernetics 21 (1991) 826-839;
its numbers as J. A. Perez has them in a public simulation of it. Its frequencies with the joints
locked, link 1 carrying link 2 as a rigid body, are `PUBLISHED_HZ`; from these numbers the beams'
equations give them to the last digit. Motor 2 of `two-flexible` has an inertia of ours, `MOTOR_2`,
which no locked joint knows of.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

from flexsim.arm.beam import Load
from flexsim.arm.locked import LOCKED, motors_locking
from flexsim.arm.parameters import FIRST_ROOT, Parameters
from flexsim.errors import ParameterError

PUBLISHED_HZ = ((0.48, 1.80), (2.18, 15.91))  # of links 1 and 2, two modes each
ZETA = 1e-3  # assumed, as the paper's robot here has it; the published arm is undamped
MOTOR_2 = 0.01  # [kg m2] assumed: a tenth of its hub's, as seen at the joint
"""Of motor 2 where link 1 bends. The published arm has none: its motor pushes off the bare end of
link 1, of which but the beam's last centimetres move within a millisecond. Sampled at that, a PD
controller at joint 2 grows with a derivative gain of 0.02 N m s/rad."""


@dataclass(frozen=True)
class FirstLink:
    """What bends of link 1: a uniform beam, clamped to hub 1 at r, that ends in joint 2.

    Attributes:
        EI: bending stiffness [N m2]. rho: linear density [kg/m]. r: radius of hub 1 [m].
        zeta: damping ratio of its mode 1, clamped and without what it carries [-].

    Raises:
        ParameterError: a number out of range.
    """

    EI: float
    rho: float
    r: float = 0.0
    zeta: float = ZETA

    def __post_init__(self) -> None:
        for name, unit, least in (("EI", "N m2", 0.0), ("rho", "kg/m", 0.0)):
            value = getattr(self, name)
            if not least < value < math.inf:
                raise ParameterError(
                    f"link 1 has {name} {value!r}; give a finite number, more than 0 [{unit}]"
                )
        if not 0 <= self.r < math.inf:
            raise ParameterError(f"link 1 has r {self.r!r}; give a finite number, 0 or more [m]")
        if not 0 <= self.zeta < 1:
            raise ParameterError(f"link 1 has zeta {self.zeta!r}; give a fraction from 0, below 1")


@dataclass(frozen=True)
class Arm:
    """A robot: its parameters, and the beam that link 1 is if it bends.

    Raises:
        ParameterError: link 1's beam is longer, or heavier, than link 1.
    """

    parameters: Parameters
    link1: FirstLink | None = None

    def __post_init__(self) -> None:
        if self.link1 is None:
            return
        p = self.parameters
        if not self.link1.r < p.L_R:
            raise ParameterError(
                f"link 1's hub has the radius {self.link1.r:g} m; give less than its length "
                f"L_R = {p.L_R:g} m"
            )
        if not self.hub_inertia >= 0:
            most = 3 * p.I_R0 / (p.L_R**3 - self.link1.r**3)
            raise ParameterError(
                f"link 1's beam of {self.link1.rho:g} kg/m has more inertia about joint 1 than "
                f"all of link 1, I_R0 = {p.I_R0:g} kg m2; give {most:.3g} kg/m at most"
            )

    @property
    def first(self) -> FirstLink:
        """Link 1's beam.

        Raises:
            ParameterError: it is rigid.
        """
        if self.link1 is None:
            raise ParameterError("link 1 is rigid; the arm two-flexible has one that bends")
        return self.link1

    @property
    def hub_inertia(self) -> float:
        """What of I_R0 is hub 1, beside the beam [kg m2]."""
        one, p = self.first, self.parameters
        return p.I_R0 - one.rho * (p.L_R**3 - one.r**3) / 3

    @property
    def beam1(self) -> Parameters:
        """Link 1's beam on hub 1, alone: r, L, rho, EI, zeta are its; nothing is carried."""
        one, p = self.first, self.parameters
        return replace(
            p,
            r=one.r,
            L=p.L_R - one.r,
            rho=one.rho,
            EI=one.EI,
            zeta=one.zeta,
            payload=0.0,
            payload_inertia=0.0,
        )

    @property
    def load1(self) -> Load:
        """What link 1's beam carries, with joint 2 locked at a right angle, as one body.

        Source: M_L1, J_L1 of De Luca and Siciliano; their MD_L1 is zero at that angle.
        """
        p, b = self.parameters, self.beam1
        mass = p.m_H + p.m_b + p.payload
        inertia = p.I_H + p.I_b + p.payload * p.reach**2 + p.payload_inertia
        return Load(mass / b.m_b, inertia / (b.m_b * b.L**2))

    def eta1(self) -> float:
        """Kelvin-Voigt time of link 1's beam: damping is that times stiffness [s]."""
        b = self.beam1
        return 2 * b.zeta / (FIRST_ROOT**2 / b.L**2 * math.sqrt(b.EI / b.rho))

    def undamped(self) -> Arm:
        """Return the arm without friction at its joints or damping in its beams."""
        one = None if self.link1 is None else replace(self.link1, zeta=0.0)
        return Arm(replace(self.parameters, F_1=0.0, F_2=0.0, zeta=0.0), one)

    def locked(self, joints: Iterable[str]) -> Arm:
        """Return the arm with joints that do not move.

        Raises:
            ParameterError: there is no joint of that name.
        """
        return replace(self, parameters=replace(self.parameters, **motors_locking(joints)))


_HUB = 0.1  # [kg m2] J_h1 = J_h2
_BEAM = 0.2  # [kg/m] rho of both
_LENGTH = 0.5  # [m] of both
_TWO = Parameters(
    L_R=_LENGTH,
    I_R0=_HUB + _BEAM * _LENGTH**3 / 3,
    I_H=_HUB,
    m_H=1.0,
    r=0.0,
    L=_LENGTH,
    rho=_BEAM,
    EI=1.0,
    F_1=0.0,
    F_2=0.0,
    zeta=ZETA,
    payload=0.1,
    payload_inertia=5e-4,
)
ARMS = {
    "paper": Arm(Parameters()),
    "one-link": Arm(replace(_TWO, I_m1=LOCKED)),
    "two-flexible": Arm(replace(_TWO, I_m2=MOTOR_2), FirstLink(EI=1.0, rho=_BEAM)),
}


def named_arm(name: str) -> Arm:
    """Return the arm of a name.

    Raises:
        ParameterError: there is none of that name.
    """
    if name not in ARMS:
        raise ParameterError(f"arm {name!r} is unknown; choose one of {', '.join(ARMS)}")
    return ARMS[name]
