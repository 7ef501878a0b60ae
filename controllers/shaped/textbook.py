"""Textbook PIDs with filtered derivatives, from bandwidth, angles and the filter's ratio.

c1, c2 = design(knobs, inertias=(0.35, 0.011), period=1e-3)      # knobs as KNOBS, (8,)

Their integrators are true ones: poles at z = 1. The derivative's filter is at omega_f = ratio times
omega_c.
"""

from collections.abc import Sequence

import numpy as np

from controllers.errors import check_positive
from controllers.knobs import Knob
from controllers.pid import textbook_pid
from controllers.series import Filter
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
from controllers.tuned_collocated import TextbookPid

RATIO = Knob("omega_f_over_omega_c", "-", 2.0, 30.0, True)
JOINT = (OMEGA_C, PHI_1, PHI_2, RATIO)
KNOBS = both(JOINT)


def design(
    knobs: Sequence[float], inertias: Sequence[float], period: float
) -> tuple[Filter, Filter]:
    """Return the controllers of both joints, b and a (3,) each.

    Args:
        knobs: (8,) as KNOBS: omega_c [rad/s], phi_1, phi_2 [rad], omega_f/omega_c of joint 1, then
            of joint 2. inertias: (I_1, I_2) [kg m2]. period: [s].

    Raises:
        ControllerError: an argument is out of range.
    """
    return paired(joint, JOINT, knobs, inertias, period)  # type: ignore[return-value]


def joint(knobs: Sequence[float], inertia: float, period: float) -> Filter:
    """Return the controller of one joint; arguments as of `gains_of`."""
    kd, ki, kp = gains_of(knobs, inertia, period)
    return textbook_pid(kp, ki, kd, period, _filter_time(knobs))


def gains_of(knobs: Sequence[float], inertia: float, period: float) -> Parts:
    """Return the gains of one joint from its knobs (4,).

    Raises:
        ControllerError: an argument is out of range.
    """
    omega_c, phi_1, phi_2, _ = knobs
    check_bandwidth(omega_c, period)
    return gains(omega_c, phi_1, phi_2, inertia, *_operators(omega_c, _filter_time(knobs), period))


def knobs_of(parts: Parts, filter_time: float, inertia: float, period: float) -> tuple[float, ...]:
    """Return the knobs (4,) of one joint's gains and its filter's time constant [s].

    Raises:
        ControllerError: there is no proportional part, no crossing, or no filter.
    """
    check_positive("filter_time", filter_time)
    built = textbook_pid(*parts[::-1], period, filter_time)
    omega_c = bandwidth(built, inertia, period)
    found = angles(parts, *_operators(omega_c, filter_time, period))
    return omega_c, *found, 1.0 / (filter_time * omega_c)


def knobs_of_both(
    given: TextbookPid, inertias: Sequence[float], period: float
) -> tuple[float, ...]:
    """Return the knobs (8,) of PIDs of both joints; see `knobs_of`."""
    found: tuple[float, ...] = ()
    for (kp, ki, kd), inertia in zip((given.joint1, given.joint2), inertias, strict=True):
        found += knobs_of(Parts(kd, ki, kp), given.filter_time, inertia, period)
    return found


def _filter_time(knobs: Sequence[float]) -> float:
    """Return the time constant of the derivative's filter [s]."""
    omega_c, _, _, ratio = knobs
    return 1.0 / (check_positive(RATIO.name, ratio) * omega_c)


def _operators(omega: float, filter_time: float, period: float) -> tuple[complex, complex]:
    """Return the filtered derivative and the integral at a frequency [rad/s]."""
    one = np.array([1.0, -1.0])
    derivative = (
        one / (period + filter_time),
        np.array([1.0, -filter_time / (period + filter_time)]),
    )
    return at(derivative, omega, period), at((np.array([period]), one), omega, period)
