"""Five specifications for a fractional PID: Monje, Vinagre and co-workers' method.

    found = five(plant, Specifications(omega_c=0.008, phi_m=1.047, ...))
    found.gains, found.met
    c1, c2 = design(knobs, inertias=(0.35, 0.011), period=1e-3)

(i) the loop crosses at omega_c, (ii) with a phase margin phi_m, (iii) its phase is flat there
(robust against the plant's gain), (iv) the complementary sensitivity is at most A at omega_h and
beyond (noise), (v) the sensitivity at most B at omega_l and below (disturbances).

The authors hand all five to a general minimiser. Here (i) to (iii) are solved exactly: for given
orders they are three linear equations in the three gains, since C(j omega_c) is known and the slope
of its phase then linear in C'. Two orders are left, and are those that leave most room to (iv) and
(v): the least of the larger of |T(j omega_h)|/A and |S(j omega_l)|/B, the gains not negative.
Whether both are met is said. They are tested at omega_h and omega_l only.

Source: C. A. Monje, B. M. Vinagre, V. Feliu, Y. Q. Chen, Tuning and auto-tuning of fractional order
controllers for industry applications, Control Eng. Practice 16 (2008) 798-812. Their liquid level,
3.13 e^(-50 s)/(433.33 s + 1), and controller, 0.6152 + 0.0100 s^-0.8968 + 4.3867 s^0.4773, are from
memory, not checked against the print: they meet all five conditions to the printed digits.
"""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from controllers.errors import ControllerError, check_positive
from controllers.pid import Gains
from controllers.rules.joint import PHI_M, check_knobs, digital, rigid_joint
from controllers.sections import Sections
from controllers.shaped.normalised import OMEGA_C, both, paired, shortened

JOINT = (OMEGA_C, PHI_M)
KNOBS = both(JOINT)
DECADE = 10.0
"""omega_h over omega_c, and omega_c over omega_l, of a joint."""
LEVEL = 0.1
"""A and B of a joint: -20 dB."""
ORDERS = (0.1, 1.6)
"""Range of lambda and mu."""
LAMBDAS, MUS, BEYOND = 16, 31, 20
"""Orders that are tried first; of mu also so many just beyond the least that leads enough."""
PLACES = 3
"""Decimals of an order that is returned."""
TRIES = 60
"""Orders that are tried then."""
STEP = 1e-5
"""Relative, of the difference that a plant's phase slope is taken by."""

Response = Callable[[NDArray[np.float64]], NDArray[np.complex128]]
Numbers = NDArray[np.float64]


class Specifications(NamedTuple):
    """What a loop is to do."""

    omega_c: float
    """Crossing [rad/s]."""
    phi_m: float
    """Phase margin [rad]."""
    omega_h: float
    """From where noise is to be kept out [rad/s]."""
    A: float
    """Largest complementary sensitivity there."""
    omega_l: float
    """Up to where disturbances are to be kept out [rad/s]."""
    B: float
    """Largest sensitivity there."""


class Five(NamedTuple):
    """A controller, and by how much it meets what is not met exactly."""

    gains: Gains
    """k1 = kd, nu1 = mu, k2 = ki, nu2 = -lambda, k3 = kp."""
    noise: float
    """|T(j omega_h)| / A, at most 1 if (iv) is met."""
    disturbance: float
    """|S(j omega_l)| / B, at most 1 if (v) is met."""

    @property
    def met(self) -> bool:
        """Whether (iv) and (v) are met; (i) to (iii) are."""
        return max(self.noise, self.disturbance) <= 1.0


def five(plant: Response, wanted: Specifications) -> Five:
    """Return the fractional PID of five specifications.

    Args:
        plant: its response at frequencies [rad/s] (n,), as an array (n,).
        wanted: the specifications.

    Raises:
        ControllerError: a number is out of range, or no gains of zero or more meet (i) to (iii).
    """
    problem = _problem(plant, wanted)
    lam, mu = _grid(problem)
    worst = _worst(problem, lam, mu)
    if not np.isfinite(worst).any():
        raise ControllerError(
            f"no gains of zero or more make the loop cross at {wanted.omega_c:g} rad/s with "
            f"{math.degrees(wanted.phi_m):.3g} degrees and a flat phase, whatever the orders from "
            f"{ORDERS[0]:g} to {ORDERS[1]:g}; choose another omega_c or phi_m"
        )
    best = int(np.argmin(worst))
    start = np.array([lam[best], mu[best]])

    def cost(x: Numbers) -> float:
        inside = (x >= ORDERS[0]).all() and (x <= ORDERS[1]).all()
        return float(_worst(problem, x[:1], x[1:])[0]) if inside else math.inf

    refined = minimize(cost, start, method="Nelder-Mead", options={"xatol": 1e-4, "maxfev": TRIES})
    candidates = [np.round(refined.x, PLACES), np.round(start, PLACES)]
    chosen = min(candidates, key=cost)
    if not math.isfinite(cost(chosen)):  # on the edge of what has such gains
        chosen = start
    return _found(problem, float(chosen[0]), float(chosen[1]))


def _grid(problem: "_Problem") -> tuple[Numbers, Numbers]:
    """Return the orders (n,), (n,) that are tried first."""
    mus = np.linspace(*ORDERS, MUS)
    least = 2.0 / math.pi * math.atan2(problem.needed.imag, problem.needed.real)
    near = least + np.geomspace(1e-3, 0.3, BEYOND)  # where the integral part is small
    mus = np.concatenate([mus, near[(near > ORDERS[0]) & (near < ORDERS[1])]])
    lam, mu = np.meshgrid(np.linspace(*ORDERS, LAMBDAS), mus)
    return lam.ravel(), mu.ravel()


class _Problem(NamedTuple):
    wanted: Specifications
    needed: complex  # C(j omega_c)
    slope: float  # of C's phase there [s]
    at_high: complex  # the plant's
    at_low: complex


def _problem(plant: Response, wanted: Specifications) -> _Problem:
    for name, value in zip(Specifications._fields, wanted, strict=True):
        check_positive(name, value)
    w = wanted.omega_c
    points = np.array([w, w * (1 - STEP), w * (1 + STEP), wanted.omega_h, wanted.omega_l])
    found = np.asarray(plant(points), dtype=complex)
    if found.shape != points.shape or not np.isfinite(found).all() or found[0] == 0.0:
        raise ControllerError("the plant must give a finite response at every frequency asked for")
    slope = float(np.angle(found[2] / found[1])) / (2.0 * STEP * w)
    needed = complex(-np.exp(1j * wanted.phi_m) / found[0])
    return _Problem(wanted, needed, -slope, complex(found[3]), complex(found[4]))


def _gains(problem: _Problem, lam: Numbers, mu: Numbers) -> tuple[Numbers, Numbers, Numbers]:
    """Return kp, ki, kd (n,) that meet (i) to (iii) with orders (n,); nan where none do.

    With i and d the sizes of both parts at omega_c and c = C(j omega_c):
        i sin(-a) + d sin(b) = Im c,              a = lambda pi/2, b = mu pi/2
        Im[(-lambda i e^(-ja) + mu d e^(jb)) / c] = omega_c slope,
        kp = Re c - i cos(a) - d cos(b).
    """
    w, c = problem.wanted.omega_c, problem.needed
    a, b = lam * math.pi / 2.0, mu * math.pi / 2.0
    turn = np.conj(c) / abs(c) ** 2
    row_i, row_d = (-lam * np.exp(-1j * a) * turn).imag, (mu * np.exp(1j * b) * turn).imag
    right = w * problem.slope
    with np.errstate(divide="ignore", invalid="ignore"):
        determinant = -np.sin(a) * row_d - np.sin(b) * row_i
        i = (c.imag * row_d - np.sin(b) * right) / determinant
        d = (-np.sin(a) * right - row_i * c.imag) / determinant
        kp = c.real - i * np.cos(a) - d * np.cos(b)
        return kp, i * w**lam, d * w**-mu


def _worst(problem: _Problem, lam: Numbers, mu: Numbers) -> Numbers:
    """Return the larger of both excesses (n,), inf where a gain is negative or none exist."""
    kp, ki, kd = _gains(problem, lam, mu)
    with np.errstate(all="ignore"):
        worst = np.maximum(*_excesses(problem, lam, mu, kp, ki, kd))
        able = (kp >= 0.0) & (ki >= 0.0) & (kd >= 0.0) & np.isfinite(worst)
    return np.where(able, worst, np.inf)


def _excesses(
    problem: _Problem, lam: Numbers, mu: Numbers, kp: Numbers, ki: Numbers, kd: Numbers
) -> tuple[Numbers, Numbers]:
    """Return |T(j omega_h)|/A and |S(j omega_l)|/B (n,)."""
    wanted = problem.wanted
    high, low = 1j * wanted.omega_h, 1j * wanted.omega_l
    loop = problem.at_high * (kp + ki * high**-lam + kd * high**mu)
    slow = problem.at_low * (kp + ki * low**-lam + kd * low**mu)
    noise, disturbance = np.abs(loop / (1.0 + loop)), np.abs(1.0 / (1.0 + slow))
    return np.asarray(noise / wanted.A, float), np.asarray(disturbance / wanted.B, float)


def _found(problem: _Problem, lam: float, mu: float) -> Five:
    orders = np.array([lam]), np.array([mu])
    kp, ki, kd = _gains(problem, *orders)
    noise, disturbance = _excesses(problem, *orders, kp, ki, kd)
    shorter = [shortened(float(each[0])) for each in (kd, ki, kp)]
    gains = Gains(shorter[0], mu, shorter[1], -lam, shorter[2])
    return Five(gains, float(noise[0]), float(disturbance[0]))


def design(
    knobs: Sequence[float],
    inertias: Sequence[float],
    period: float,
    delay: float | None = None,
) -> tuple[Sections, Sections]:
    """Return the controllers of both joints.

    Args:
        knobs: (4,) as KNOBS: omega_c [rad/s] and phase margin phi_m [rad] of joint 1, then of
            joint 2; (iv) and (v) ask for -20 dB a decade beyond and before omega_c.
        inertias: (I_1, I_2) [kg m2]. period: [s].
        delay: the loop's dead time [s]; one and a half samples unless given.

    Raises:
        ControllerError: an argument is out of range, or there is no such controller. That (iv) or
            (v) is not met is no error.
    """

    def joint(mine: Sequence[float], inertia: float, T: float) -> Sections:
        return digital(joint_five(mine, inertia, T, delay).gains, mine[0], T)

    return paired(joint, JOINT, knobs, inertias, period)  # type: ignore[return-value]


def joint_five(
    knobs: Sequence[float], inertia: float, period: float, delay: float | None = None
) -> Five:
    """Return what is found for one joint from its knobs (2,); see `design`."""
    omega_c, phi_m = check_knobs(knobs, JOINT)
    plant = rigid_joint(inertia, period, delay)
    wanted = Specifications(omega_c, phi_m, DECADE * omega_c, LEVEL, omega_c / DECADE, LEVEL)
    return five(plant.response, wanted)


def numbers(
    knobs: Sequence[float], inertia: float, period: float, delay: float | None = None
) -> dict[str, float]:
    """Return what one joint's design comes to, by name [SI]; noise and disturbance are excesses."""
    gains, noise, disturbance = joint_five(knobs, inertia, period, delay)
    orders = {"lambda": -(gains.nu2 or 0.0), "mu": gains.nu1 or 0.0}
    parts = {"kp": gains.k3, "ki": gains.k2, "kd": gains.k1}
    return parts | orders | {"noise": noise, "disturbance": disturbance}
