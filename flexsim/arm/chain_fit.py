"""The fit behind `chain_design`: where to put N hinges, and how stiff to make them.

    >>> a, k = fitted_chain(6)        # a/L and k L/EI

Least squares over N+1 gaps and N stiffnesses; the first three frequencies are no residuals, since
every trial is brought back to exact ones by Newton's iteration. Residuals are the couplings to the
joints, the tip's compliances, the frequencies under payloads (the hinges are the same for all of
them), and the highest frequency, which bounds the integrator's step; these pull against each
other, `Weights` says how hard. The least squares are MINPACK's, plain code without BLAS, and what
they are fed is compiled scalar code, so every machine takes the same steps. What comes out is
checked: the least squares have converged, the frequencies are exact, couplings and loaded
frequencies as close as N hinges have been seen to allow. Otherwise another start is tried, and
after the last the design is refused.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.optimize import leastsq

from flexsim.arm.beam import Load, beta_lengths
from flexsim.arm.hinged_beam import (
    COUPLINGS,
    ERRORS,
    FITTED_MODES,
    beam_modes,
    fill_loaded,
    fill_modes,
    fill_shape_errors,
    frequency_sensitivity,
    loaded_frequencies,
)
from flexsim.errors import ParameterError
from flexsim.numerics.eigen import factored
from flexsim.numerics.jit import jit
from flexsim.numerics.types import Array


class Weights(NamedTuple):
    """What pulls on the fit: relative errors that weigh 1, and where the top frequency is drawn.

    Attributes:
        coupling: of a coupling to the joints, of a tip value, of the tip's deflection.
        loaded: of a frequency under a payload.
        top: omega_N / N^2, dimensionless; a plain chain has 8.9. A lower one allows a longer step
            of the integrator, a higher one closer loaded frequencies.
    """

    coupling: float = 6e-4
    loaded: float = 8e-3
    top: float = 10.0


CHOSEN = Weights()
ROTATION_SCALE = 2e-2  # relative error of the tip's rotation under a moment that weighs 1
TOP_SCALE = 0.25  # of ln(omega_N / N^2): the top frequency is drawn, not held
LOADS = (Load(0.1, 0.0), Load(0.1, 0.004), Load(1.0, 0.0), Load(1.0, 0.04))  # the corners of what
# is promised: up to the beam's mass, radius of gyration up to 0.2 L
VARIABLE_WEIGHT = 1e-3  # makes the solution unique
MISSED_SCALE = 1e-9  # error of ln omega, left by Newton, that weighs 1: such a trial is rejected
MISSED_MOST = 1.0  # so that what weighs it stays a number
DIFFERENCE = 1e-5  # of the variables, central; its error is below that of the solution
PRECISION = 1e-11  # relative change of the sum of squares at which they end; beyond MANY ...
PRECISION_OF_MANY = 1e-2  # ... a long valley leads on in which what matters no longer improves
MANY = 10  # segments
TRIALS = 1500  # 40 to 270 are usual
NEWTON_STEPS = 12  # from 1 % each squares the error, so that four are usual
NEWTON_DONE = 1e-13  # of ln omega: rounding
NEWTON_LONGEST = 1.0  # change of ln k in one step
STARTS = (0.0, 0.05, -0.05, 0.1)  # of the variables, up and down: the plain chain, then others
POSITION_DIGITS = 5  # of a/L: 5 micrometres on half a metre
STIFFNESS_DIGITS = 3  # of k L/EI, before the frequencies are made exact again ...
FITTED_DIGITS = 10  # ... and after, so that they are exact to FREQUENCY_MOST
FREQUENCY_MOST = 2e-11  # relative, by the rounding of k
COUPLING_MOST = {3: 0.26, 4: 0.005, 5: 0.0025}  # error of a coupling to the joints; from 6 ...
COUPLING_MOST_OF_MORE = 0.001
LOADED_MOST = {3: 1.0, 4: 0.06, 5: 0.02}  # error of a loaded frequency; from 6 on ...
LOADED_MOST_OF_MORE = 0.006
CONVERGED = (1, 2, 3, 4)  # MINPACK's: sum of squares or variables settled, or no slope is left


@jit
def unpack(x: Array, a: Array, k: Array) -> None:
    """Fill a/L and k L/EI (N,) of the variables (2N+1,); zero is the plain chain.

    The variables are logarithms: of N+1 gaps over (1/2, 1, ..., 1, 1/2), up to their sum, and
    of k over EI/cell, a cell reaching half-way to the neighbouring hinges.
    """
    n = a.shape[0]
    total = 0.0
    for i in range(n + 1):
        total += math.exp(x[i]) * (0.5 if i == 0 or i == n else 1.0)
        if i < n:
            a[i] = total
    for i in range(n):
        a[i] /= total
    for i in range(n):
        start = 0.5 * (a[i - 1] + a[i]) if i > 0 else 0.0
        end = 0.5 * (a[i] + a[i + 1]) if i < n - 1 else 1.0
        k[i] = math.exp(x[n + 1 + i]) / (end - start)


@jit
def exact_frequencies(a: Array, k: Array, exact: Array, omega: Array, q: Array) -> float:
    """Change k (N,) as little as possible, in ln k, until omega_1..3 are exact (3,).

    Fills omega (N,) and q (N, N) of the modes; returns the largest error of ln omega left.
    """
    n = a.shape[0]
    error, weight, product = np.empty(3), np.empty(3), np.empty((3, 3))
    least = np.empty(n)
    for step in range(NEWTON_STEPS + 1):
        if not fill_modes(a, k, omega, q):
            return np.inf
        worst = 0.0
        for i in range(FITTED_MODES):
            error[i] = math.log(omega[i] / exact[i])
            worst = max(worst, abs(error[i]))
        if not worst > NEWTON_DONE or step == NEWTON_STEPS:
            return worst
        share = frequency_sensitivity(k, omega, q)
        for i in range(FITTED_MODES):
            for j in range(FITTED_MODES):
                product[i, j] = 0.0
                for c in range(n):
                    product[i, j] += share[i, c] * share[j, c]
        if not factored(product):
            return np.inf
        _back(product, error, weight)
        longest = 0.0
        for c in range(n):
            least[c] = 0.0
            for i in range(FITTED_MODES):
                least[c] += share[i, c] * weight[i]
            longest = max(longest, abs(least[c]))
        scale = NEWTON_LONGEST / longest if longest > NEWTON_LONGEST else 1.0
        for c in range(n):
            k[c] *= math.exp(-scale * least[c])
    return np.inf


@jit
def _back(lower: Array, right: Array, x: Array) -> None:
    """Fill x (n,) with the solution of L L' x = right."""
    n = right.shape[0]
    for i in range(n):
        x[i] = right[i]
        for j in range(i):
            x[i] -= lower[i, j] * x[j]
        x[i] /= lower[i, i]
    for i in range(n - 1, -1, -1):
        for j in range(i + 1, n):
            x[i] -= lower[j, i] * x[j]
        x[i] /= lower[i, i]


@jit
def _fill_residuals(
    x: Array, n: int, exact: Array, beam: Array, loads: Array, weights: Weights, out: Array
) -> None:
    """Fill what the fit minimises, for variables (2N+1,), each scaled to matter at 1.

    loads: (P, 5) masses and inertias of payloads, and the beam's frequencies under them.
    """
    a, k, omega, q = np.empty(n), np.empty(n), np.empty(n), np.empty((n, n))
    errors, loaded = np.empty(ERRORS), np.empty(FITTED_MODES)
    unpack(x, a, k)
    missed = exact_frequencies(a, k, exact, omega, q)
    out[0] = min(missed, MISSED_MOST) / MISSED_SCALE
    row = 1
    if not missed < MISSED_MOST:
        out[1:] = 0.0
        return
    fill_shape_errors(a, k, q, beam, errors)
    for i in range(ERRORS - 1):
        out[row] = errors[i] / weights.coupling
        row += 1
    out[row] = errors[ERRORS - 1] / ROTATION_SCALE
    row += 1
    for p in range(loads.shape[0]):
        if not fill_loaded(a, omega, q, loads[p, 0], loads[p, 1], loaded):
            loaded[:] = np.inf
        for i in range(FITTED_MODES):
            out[row] = math.log(loaded[i] / loads[p, 2 + i]) / weights.loaded
            row += 1
    out[row] = math.log(omega[n - 1] / (weights.top * n * n)) / TOP_SCALE
    row += 1
    for i in range(x.shape[0]):
        out[row] = VARIABLE_WEIGHT * x[i]
        row += 1


@jit
def _fill_jacobian(
    x: Array, n: int, exact: Array, beam: Array, loads: Array, weights: Weights, out: Array
) -> None:
    """Fill the derivatives (residuals, variables); that of what Newton left is none."""
    rows = out.shape[0]
    above, below = np.empty(rows), np.empty(rows)
    moved = x.copy()
    for c in range(x.shape[0]):
        moved[c] = x[c] + DIFFERENCE
        _fill_residuals(moved, n, exact, beam, loads, weights, above)
        moved[c] = x[c] - DIFFERENCE
        _fill_residuals(moved, n, exact, beam, loads, weights, below)
        moved[c] = x[c]
        for row in range(rows):
            out[row, c] = (above[row] - below[row]) / (2.0 * DIFFERENCE)
        out[0, c] = 0.0


@lru_cache
def fitted_chain(
    segments: int, weights: Weights = CHOSEN
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return a/L and k L/EI (N,) of the fitted chain of N segments.

    Raises:
        ParameterError: no start led to a chain that keeps what is asked of it; of other weights
            than the chosen ones only convergence and exact frequencies are asked.
    """
    wrong = ""
    for shift in STARTS:
        start = np.array([shift, -shift] * segments + [shift])
        variables, converged = _least_squares(segments, start, weights)
        a, k = _rounded(variables, segments)
        wrong = flaw(a, k, weights == CHOSEN) if converged else "the least squares do not converge"
        if not wrong:
            return tuple(a.tolist()), tuple(k.tolist())
    raise ParameterError(
        f"no chain of {segments} segments was found from {len(STARTS)} starts: {wrong}; "
        "take another number of segments"
    )


def _least_squares(segments: int, start: Array, weights: Weights) -> tuple[Array, bool]:
    """Return the variables (2N+1,) that fit best, and whether MINPACK says that they do."""
    exact, beam, loads = frequencies_aimed_at(), beam_modes(), loaded_beam()
    rows, columns = 1 + ERRORS + FITTED_MODES * len(loads) + 1 + len(start), len(start)

    def residuals(x: Array) -> Array:
        out = np.empty(rows)
        _fill_residuals(x, segments, exact, beam, loads, weights, out)
        return out

    def jacobian(x: Array) -> Array:
        out = np.empty((rows, columns))
        _fill_jacobian(x, segments, exact, beam, loads, weights, out)
        return out

    precision = PRECISION if segments <= MANY else PRECISION_OF_MANY
    found, *_, status = leastsq(
        residuals,
        start,
        Dfun=jacobian,
        ftol=precision,
        xtol=precision,
        maxfev=TRIALS,
        diag=np.ones(columns),
        full_output=True,
    )
    return found, status in CONVERGED


def _rounded(variables: Array, segments: int) -> tuple[Array, Array]:
    """Return a/L and k L/EI (N,) of variables in few digits, the frequencies made exact after."""
    exact, omega, q = frequencies_aimed_at(), np.empty(segments), np.empty((segments, segments))
    a, k = np.empty(segments), np.empty(segments)
    unpack(variables, a, k)
    exact_frequencies(a, k, exact, omega, q)
    a, k = np.round(a, POSITION_DIGITS), np.round(k, STIFFNESS_DIGITS)
    exact_frequencies(a, k, exact, omega, q)
    return a, np.round(k, FITTED_DIGITS)


def flaw(a: Array, k: Array, chosen: bool = True) -> str:
    """Return what a chain lacks of what the fit promises, '' when it keeps everything.

    Args:
        a: (N,) a/L; k: (N,) k L/EI.
        chosen: with the weights chosen here, which promise couplings and loaded frequencies too.
    """
    n = len(a)
    if not (
        (np.diff(a, prepend=0.0, append=1.0) > 0).all() and (k > 0).all() and (k < np.inf).all()
    ):
        return "hinges do not follow one another, each with a spring"
    omega, q, errors = np.empty(n), np.empty((n, n)), np.empty(ERRORS)
    if not fill_modes(a, k, omega, q):
        return "the chain has no modes"
    missed = float(np.abs(omega[:FITTED_MODES] / frequencies_aimed_at() - 1).max())
    if not missed <= FREQUENCY_MOST:
        return f"a frequency is off by {missed:.2g} of itself"
    if not chosen:
        return ""
    fill_shape_errors(a, k, q, beam_modes(), errors)
    coupling = float(np.abs(errors[:COUPLINGS]).max())
    if not coupling <= COUPLING_MOST.get(n, COUPLING_MOST_OF_MORE):
        return f"a coupling to the joints is off by {coupling:.2g} of itself"
    loaded = loaded_error(a, k)
    if not loaded <= LOADED_MOST.get(n, LOADED_MOST_OF_MORE):
        return f"a frequency under a payload is off by {loaded:.2g} of itself"
    return ""


def loaded_beam() -> Array:
    """Return (P, 5) of LOADS: mass, inertia, and the beam's first three frequencies under them."""
    return np.array([[*load, *(b * b for b in beta_lengths(FITTED_MODES, load))] for load in LOADS])


def loaded_error(a: Array, k: Array) -> float:
    """Return the largest relative error of the first three frequencies under LOADS."""
    return max(
        float(np.abs(loaded_frequencies(a, k, load) / beam[2:] - 1).max())
        for load, beam in zip(LOADS, loaded_beam(), strict=True)
    )


def frequencies_aimed_at() -> Array:
    """Return (beta_i L)^2 (3,) of the first modes: omega in units of sqrt(EI/rho)/L^2."""
    return np.array([b * b for b in beta_lengths(FITTED_MODES)])
