"""What can no controller of the loop's errors move? The zeros between torques and errors.

    >>> linear = linearise(plant, theta2=1.5)
    >>> held_motions(linear, plant.parameters.reach)       # (m-2,) of s [1/s], one of each pair
    >>> mirrored_frequency(Parameters())                   # [rad/s], of the beam itself: 2.2 Hz

A transmission zero is a motion during which both errors stay zero, theta1 = 0 and
theta2 + v_gain v/(r+L) = 0, whatever torques that takes. High gain drives poles to the zeros, and a
pole at one cannot be seen in the errors: the controllers have nothing to damp it with.

With theta1 held the link is a fixed wall and the torque of joint 2 is whatever holds the error, so
neither pose nor link nor hub nor motors matter. With w = x theta2 + v across the beam, b = beta L,
k = r/L and g = v_gain: EI w'''' = -rho w_tt, w(r) = r w'(r), w'' = w''' = 0 at the tip, and there
w = (1 - 1/g)(r+L) w'(r). Written with the functions cosh + cos and sinh + sin from the free end,

    sinh b + sin b = b [(1 - 1/g)(1 + k)(1 + cosh b cos b) - k (cosh b + cos b)].

With g = -1, the mirrored tip, the roots are real: vibrations, of which the beam's own damping, eta
times stiffness, is all the damping. With g = 0 they are those of the clamped beam; with g = 1, the
true tip, b = |b| e^(i pi/4): real pairs +-s, one of which grows.
"""

from __future__ import annotations

import cmath
import math

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space
from scipy.optimize import brentq

from flexsim.arm.beam import UNLOADED, load_of
from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.linear.loop_poles import SampledPlant
from flexsim.loop.settings import V_GAIN
from flexsim.numerics.eigenvalues import eigenvalues
from flexsim.numerics.state_matrix import state_matrix
from flexsim.numerics.types import Array
from flexsim.plants.linear_plant import LinearPlant

Complex = NDArray[np.complex128]


def error_rows(linear: LinearPlant, reach: float, v_gain: float = V_GAIN) -> Array:
    """Return the rows (2, m) that make the measured angles of both joints of a position [rad].

    Args:
        reach: r + L [m].
    """
    rows = np.eye(2, len(linear.M))
    rows[1] += v_gain / reach * linear.tip
    return rows


def transmission_zeros(linear: LinearPlant, reach: float, v_gain: float = V_GAIN) -> Complex:
    """Return the zeros (2 (m-2),) between both torques and both errors [1/s], slowest first.

    The motions q = N p that the errors do not see, under those equations that hold no torque.

    Args:
        linear: plant of m positions. reach: r + L [m]. v_gain: -1 for the mirrored tip.
    """
    unseen = null_space(error_rows(linear, reach, v_gain))  # (m, m-2)
    untouched = null_space(linear.S.T).T  # (m-2, m)
    M, D, K = (untouched @ part @ unseen for part in (linear.M, linear.D, linear.K))
    found = np.asarray(eigenvalues(state_matrix(M, D, K)), dtype=complex)
    return found[np.lexsort((found.imag, np.round(np.abs(found), 6)))]


def held_motions(linear: LinearPlant, reach: float, v_gain: float = V_GAIN) -> Complex:
    """Return the zeros with an imaginary part above 0 [1/s], slowest first."""
    found = transmission_zeros(linear, reach, v_gain)
    return found[found.imag > 0]


def sampled_zeros(sampled: SampledPlant) -> Complex:
    """Return the zeros (n-2,) of the plant over one period, in z, nearest to 1 first.

    Beside e^(sT) of the plant's own zeros there are those that sampling brings, near -1 and below.
    Errors of the next sample are held at zero by u = -(C B)^-1 C A x.

    Args:
        sampled: without delay, of n states.

    Raises:
        ParameterError: the plant has a delay, with which no torque reaches the next sample.
    """
    if sampled.options.hardware.delay:
        raise ParameterError("zeros are of a plant without delay; a delay adds none but at z = 0")
    if sampled.memory:
        raise ParameterError(
            "zeros are of what is measured at a sample; leave out the bridges' filter, and take an "
            "estimator without memory"
        )
    A, B, C = sampled.A, sampled.B, sampled.C[:2]
    held = A - B @ np.linalg.solve(C @ B, C @ A)
    found = np.linalg.eigvals(held)
    found = found[np.argsort(np.abs(found))][2:]  # the errors themselves, at z = 0
    return np.asarray(found[np.argsort(np.abs(found - 1))], dtype=complex)


def held_equation(b: complex, ratio: float, v_gain: float = V_GAIN) -> complex:
    """Return what is zero where b = beta L belongs to a motion with both errors held at zero [-].

    The module's equation times g e^-Re(b). Args: ratio: r/L.
    """
    C, S, c, s = cmath.cosh(b), cmath.sinh(b), cmath.cos(b), cmath.sin(b)
    tip = (v_gain - 1) * (1 + ratio) * (1 + C * c)
    return (b * (tip - v_gain * ratio * (C + c)) - v_gain * (S + s)) * math.exp(-abs(b.real))


def mirrored_frequency(parameters: Parameters) -> float:
    """Return the slowest vibration [rad/s] with theta1 and the mirrored tip held, undamped.

    It is below the clamped beam's first, where the equation has the other sign.

    Raises:
        ParameterError: the robot has a payload, for which the equation does not hold.
    """
    if load_of(parameters) != UNLOADED:
        raise ParameterError(
            "the closed form of the mirrored tip's zero is of a beam without payload; "
            "use transmission_zeros, or leave the payload out"
        )
    p = parameters
    b = brentq(lambda x: held_equation(complex(x), p.r / p.L).real, 0.5, 1.8751, xtol=1e-14)
    return float((b / p.L) ** 2 * math.sqrt(p.EI / p.rho))


def damped_rate(parameters: Parameters, omega: float) -> complex:
    """Return s [1/s] of a motion held at frequency omega [rad/s] with the beam's own damping.

    s^2 + eta omega^2 s + omega^2 = 0: damping is eta times stiffness, so it decays at
    eta omega^2 / 2 = zeta omega^2 / omega_1.
    """
    decay = parameters.eta * omega**2 / 2
    return complex(-decay, math.sqrt(max(omega**2 - decay**2, 0.0)))
