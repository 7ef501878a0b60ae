"""Fractional PIDs by (2), the paper's, from bandwidth, angles and orders.

c1, c2 = design(knobs, inertias=(0.35, 0.011), period=1e-3)      # knobs as KNOBS, (10,)
"""

from collections.abc import Sequence

from controllers.knobs import Knob
from controllers.pid import Controller, Gains, fractional_pid
from controllers.series import Filter, tustin
from controllers.shaped.normalised import (
    OMEGA_C,
    PHI_1,
    PHI_2,
    Parts,
    angles,
    at,
    bandwidth,
    both,
    check_bandwidth,
    gains,
    paired,
)

TERMS = 10
"""p in (2), the paper's."""
NU_1 = Knob("nu_1", "-", 0.1, 1.0, False)
NU_2 = Knob("nu_2", "-", -1.0, 1.0, False)
JOINT = (OMEGA_C, PHI_1, PHI_2, NU_1, NU_2)
KNOBS = both(JOINT)


def design(
    knobs: Sequence[float], inertias: Sequence[float], period: float
) -> tuple[Filter, Filter]:
    """Return the controllers of both joints, b (11,) and a = [1] each.

    Args:
        knobs: (10,) as KNOBS: omega_c [rad/s], phi_1, phi_2 [rad], nu_1, nu_2 of joint 1, then of
            joint 2. inertias: (I_1, I_2) [kg m2]. period: [s].

    Raises:
        ControllerError: an argument is out of range.

    Source: (2)-(4), p = 10.
    """
    return paired(joint, JOINT, knobs, inertias, period)  # type: ignore[return-value]


def joint(knobs: Sequence[float], inertia: float, period: float) -> Filter:
    """Return the controller of one joint; arguments as of `gains_of`."""
    omega_c, phi_1, phi_2, nu_1, nu_2 = knobs
    check_bandwidth(omega_c, period)
    derivative, integral = _taps(nu_1, nu_2, period)
    responses = at(derivative, omega_c, period), at(integral, omega_c, period)
    k1, k2, k3 = gains(omega_c, phi_1, phi_2, inertia, *responses)
    b = k1 * derivative[0] + k2 * integral[0]  # as `fractional_pid`, each operator built once
    b[0] += k3
    return b, derivative[1]


def gains_of(knobs: Sequence[float], inertia: float, period: float) -> Gains:
    """Return the gains of one joint from its knobs (5,).

    Raises:
        ControllerError: an argument is out of range.
    """
    omega_c, phi_1, phi_2, nu_1, nu_2 = knobs
    responses = _operators(check_bandwidth(omega_c, period), nu_1, nu_2, period)
    k1, k2, k3 = gains(omega_c, phi_1, phi_2, inertia, *responses)
    return Gains(k1, nu_1, k2, nu_2, k3)


def knobs_of(given: Gains, inertia: float, period: float) -> tuple[float, ...]:
    """Return the knobs (5,) of one joint's gains; omega_c is the lowest crossing.

    Raises:
        ControllerError: there is no proportional part, or no crossing.
    """
    omega_c = bandwidth(fractional_pid(given, period, "tustin", TERMS), inertia, period)
    nu_1, nu_2 = given.nu1 or 0.0, given.nu2 or 0.0
    parts = Parts(given.k1, given.k2, given.k3)
    return (omega_c, *angles(parts, *_operators(omega_c, nu_1, nu_2, period)), nu_1, nu_2)


def knobs_of_both(given: Controller, inertias: Sequence[float], period: float) -> tuple[float, ...]:
    """Return the knobs (10,) of a controller of both joints; see `knobs_of`."""
    first, second = inertias
    return knobs_of(given.joint1, first, period) + knobs_of(given.joint2, second, period)


def _taps(nu_1: float, nu_2: float, period: float) -> tuple[Filter, Filter]:
    """Return D^nu_1 and D^nu_2 by (2)."""
    return tustin(nu_1, period, TERMS), tustin(nu_2, period, TERMS)


def _operators(omega: float, nu_1: float, nu_2: float, period: float) -> tuple[complex, complex]:
    """Return D^nu_1 and D^nu_2 at a frequency [rad/s], as the digital filters have them."""
    first, second = (at(each, omega, period) for each in _taps(nu_1, nu_2, period))
    return first, second
