"""Iso-damping: a fractional PD whose loop's phase is flat where it crosses.

    flat_phase(phase, slope, magnitude, omega_c=10.0, phi_m=1.22)    # of the plant at omega_c
    c1, c2 = design(knobs, inertias=(0.35, 0.011), period=1e-3)

Kp (1 + Kd s^mu) with a wanted crossing, phase margin, and a phase that does not change with
frequency there, so that a plant of another gain, as a joint with another load, has the same phase
margin and overshoots as much. Without a lag in the plant there is none that is flat; a joint has
one, its dead time. With psi the lead wanted at omega_c and x = Kd omega_c^mu,

    x = sin(psi) / sin(mu pi/2 - psi)
    d(lead)/d(omega) = mu x sin(mu pi/2) / (omega_c (1 + 2 x cos(mu pi/2) + x^2)),

which is the slope wanted for one mu.

Source: H. Li, Y. Luo, Y. Q. Chen, A fractional order proportional and derivative (FOPD) motion
controller: tuning rule and experiments, IEEE Trans. Control Syst. Technol. 18 (2010) 516-520: the
conditions; the closed form above is ours from them. Their example, 1/(s (0.4 s + 1)) at 10 rad/s
and 70 degrees, is remembered as mu 0.844, Kd 0.369, Kp 13.86, not checked against the print; solved
exactly it is 0.8350, 0.3686, 14.02.
"""

import math
from collections.abc import Sequence

from scipy.optimize import brentq

from controllers.errors import ControllerError, check_finite, check_positive
from controllers.pid import Gains
from controllers.rules.joint import PHI_M, check_knobs, digital, rigid_joint
from controllers.sections import Sections
from controllers.shaped.normalised import OMEGA_C, both, paired, shortened

JOINT = (OMEGA_C, PHI_M)
KNOBS = both(JOINT)
MOST = 1.9
"""Order up to which one is looked for; at 2 both parts of a lead cancel."""
NEAR = 1e-9
"""How near to the ends of its range [-]."""
PLACES = 9
"""Decimals of an order that is returned, fewer than a root's last ones."""


def flat_phase(phase: float, slope: float, magnitude: float, omega_c: float, phi_m: float) -> Gains:
    """Return Kp (1 + Kd s^mu) for a plant of which three numbers at omega_c are known.

    Args:
        phase: of the plant at omega_c, unwrapped [rad]. slope: its derivative over omega [s].
        magnitude: the plant's there. omega_c: crossing wanted [rad/s]. phi_m: phase margin [rad].

    Raises:
        ControllerError: a number is out of range, the plant needs no lead or more than a turn's
            half, or no order makes the phase flat.
    """
    w, size = check_positive("omega_c", omega_c), check_positive("magnitude", magnitude)
    psi = check_finite("phi_m", phi_m) - math.pi - check_finite("phase", phase)
    if not 0.0 < psi < math.pi * (1.0 - NEAR):
        raise ControllerError(
            f"the plant needs {math.degrees(psi):.3g} degrees of lead for this margin; a "
            "fractional PD gives from 0 to 180: choose another omega_c or phi_m"
        )

    def steepness(mu: float) -> float:
        angle, x = mu * math.pi / 2.0, _ratio(mu, psi)
        return mu * math.sin(angle) / (1.0 / x + 2.0 * math.cos(angle) + x) + w * slope

    low, high = 2.0 * psi / math.pi + NEAR, MOST
    if low >= high or steepness(low) * steepness(high) >= 0.0:
        raise ControllerError(
            f"no order up to {MOST:g} makes the phase flat at {w:g} rad/s: the plant's falls by "
            f"{-slope:.3g} s, which no lead of {math.degrees(psi):.3g} degrees rises by"
        )
    mu = round(float(brentq(steepness, low, high, xtol=1e-13)), PLACES)
    x = _ratio(mu, psi)
    angle = mu * math.pi / 2.0
    k = 1.0 / (size * math.sqrt(1.0 + 2.0 * x * math.cos(angle) + x * x))
    return Gains(shortened(k * x / w**mu), mu, 0.0, None, shortened(k))


def _ratio(mu: float, psi: float) -> float:
    """Return Kd omega^mu with which 1 + Kd (j omega)^mu leads by psi [rad]."""
    return math.sin(psi) / math.sin(mu * math.pi / 2.0 - psi)


def design(
    knobs: Sequence[float],
    inertias: Sequence[float],
    period: float,
    delay: float | None = None,
) -> tuple[Sections, Sections]:
    """Return the controllers of both joints.

    Args:
        knobs: (4,) as KNOBS: omega_c [rad/s] and phase margin phi_m [rad] of joint 1, then of
            joint 2. inertias: (I_1, I_2) [kg m2]. period: [s].
        delay: the loop's dead time [s]; one and a half samples unless given.

    Raises:
        ControllerError: an argument is out of range, or there is no such controller.
    """

    def joint(mine: Sequence[float], inertia: float, T: float) -> Sections:
        return digital(joint_gains(mine, inertia, T, delay), mine[0], T)

    return paired(joint, JOINT, knobs, inertias, period)  # type: ignore[return-value]


def joint_gains(
    knobs: Sequence[float], inertia: float, period: float, delay: float | None = None
) -> Gains:
    """Return one joint's gains from its knobs (2,); see `design`."""
    omega_c, phi_m = check_knobs(knobs, JOINT)
    plant = rigid_joint(inertia, period, delay)
    size = abs(complex(plant.response(omega_c)))
    return flat_phase(plant.phase(omega_c), plant.slope(omega_c), size, omega_c, phi_m)


def numbers(
    knobs: Sequence[float], inertia: float, period: float, delay: float | None = None
) -> dict[str, float]:
    """Return what one joint's design comes to, by name [SI]."""
    found = joint_gains(knobs, inertia, period, delay)
    return {"Kp": found.k3, "Kd": found.k1 / found.k3, "mu": found.nu1 or 0.0}
