"""Where to cut the beam, and how stiff to make each hinge, so that a chain bends like the beam.

    >>> from flexsim import Parameters
    >>> from flexsim.arm.chain_design import design_chain
    >>> design_chain(Parameters(), 6).frequency[:3] / 6.283185307179586   # [Hz], exact
    array([ 3.33728858, 20.91443054, 58.56101111])

A chain is a rigid piece fixed to the hub, then N rigid segments joined by hinges with springs.
Each piece has the mass, the centre and the inertia of the uniform beam it replaces, so only the
hinges' positions and stiffnesses are free; `flexsim.arm.hinged_beam` has the chain's linear
dynamics. With hinges at the centres of N equal cells and stiffness EI/h (`plain_chain`) the
frequencies converge with order 2 only. `design_chain` moves the hinges and tunes the springs
until the first three clamped frequencies are exact and the modes' couplings to the joints are as
close as N hinges allow.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from flexsim.arm.beam import beta_lengths
from flexsim.arm.hinged_beam import (
    TUNED_MODES,
    chain_modes,
    frequency_sensitivity,
    shape_errors,
    shapes_at_nodes,
)
from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.numerics.types import Array

SEGMENTS_LEAST = 3  # a spring for each frequency; none is left for the couplings, off by up to
# 25 % (with 4: 0.4 %), so that 3 is a rung to compare with, not a model of the beam
SEGMENTS_MOST = 16  # the couplings are within 0.002 %, and tuning takes 6 s
PLAIN_MOST = 200

COUPLING_SCALE = 5e-4  # relative error of a coupling that weighs 1 in the least squares
SHAPE_SCALE = 0.07  # error of a unit mode shape that weighs 1
TOP_TARGET = 4.0  # omega_N / N^2, dimensionless, to which the highest frequency is drawn; a plain
# chain has 8.9. A lower one allows a longer step of the integrator
VARIABLE_WEIGHT = 1e-3  # makes the solution unique
DIFFERENCE = 1e-5  # of the variables, central; its error is below that of the solution
TRIALS = 300  # enough up to N = 10; beyond, the last of them no longer move the couplings
NEWTON_STEPS = 5  # each squares the error, from at most 1 %
POSITION_DIGITS = 5  # of a/L: 5 micrometres on half a metre; with STIFFNESS_DIGITS of k L/EI ...
STIFFNESS_DIGITS = 3  # ... so that every machine rounds to the same design, then tunes it exactly
TUNED_DIGITS = 10  # of k L/EI in the end: the frequencies are exact to 1e-11


@dataclass(frozen=True, eq=False)
class ChainDesign:
    """A chain of N hinged segments and how well it stands for the beam.

    Attributes:
        segments: N.
        tuned: whether the frequencies have been made exact.
        position: (N,) distance of the hinges from the clamp [m].
        stiffness: (N,) of the hinges [N m/rad].
        frequency: (N,) of the clamped chain [rad/s].
        frequency_error: (3,) relative to the beam's, (15).
        Phi_error, moment_error, tip_error: (3,) relative errors of the modes' integral (14), of
            their first moment about the clamp, and of their value at the tip.
        compliance_error: relative error of the static deflection under a force at the tip.
        mac: (3,) modal assurance criterion against (15) at the hinges and the tip.
    """

    segments: int
    tuned: bool
    position: Array
    stiffness: Array
    frequency: Array
    frequency_error: Array
    Phi_error: Array
    moment_error: Array
    tip_error: Array
    compliance_error: float
    mac: Array

    @property
    def coupling_error(self) -> float:
        """Largest relative error of the modes' couplings to the joints, Phi_i and moment."""
        return float(np.abs([self.Phi_error, self.moment_error]).max())


def design_chain(parameters: Parameters, segments: int = 6) -> ChainDesign:
    """Return the chain with exact frequencies and the closest couplings to the joints.

    Raises:
        ParameterError: segments is not a whole number from 3 to 16.
    """
    reason = "three frequencies need three hinges, their couplings four; past 16 nothing is gained"
    segments = _whole(segments, SEGMENTS_LEAST, SEGMENTS_MOST, reason)
    a, k = _tuned(segments)
    return _report(parameters, np.array(a), np.array(k), tuned=True)


def plain_chain(parameters: Parameters, segments: int) -> ChainDesign:
    """Return the untuned chain, for comparison: hinges at cell centres, k = EI/h.

    Raises:
        ParameterError: segments is not a whole number from 3 to 200.
    """
    segments = _whole(segments, TUNED_MODES, PLAIN_MOST, "the report compares three modes")
    a = (np.arange(segments) + 0.5) / segments
    return _report(parameters, a, np.full(segments, float(segments)), tuned=False)


def _whole(segments: Any, least: int, most: int, reason: str) -> int:
    is_number = isinstance(segments, (int, np.integer)) and not isinstance(segments, bool)
    if not is_number or not least <= segments <= most:
        raise ParameterError(
            f"number of segments is {segments!r}; give a whole number from {least} to {most} "
            f"({reason})"
        )
    return int(segments)


def _report(parameters: Parameters, a: Array, k: Array, tuned: bool) -> ChainDesign:
    """Return a dimensionless chain in metres and N m/rad, with its errors."""
    p = parameters
    omega, q = chain_modes(a, k)
    errors = shape_errors(a, k, q)
    chain, beam = shapes_at_nodes(a, q)  # unit columns
    return ChainDesign(
        segments=len(a),
        tuned=tuned,
        position=p.L * a,
        stiffness=p.EI / p.L * k,
        frequency=omega * np.sqrt(p.EI / p.rho) / p.L**2,
        frequency_error=omega[:TUNED_MODES] / _exact_frequencies() - 1,
        Phi_error=errors[:3],
        moment_error=errors[3:6],
        tip_error=errors[6:9],
        compliance_error=float(errors[9]),
        mac=np.sum(chain * beam, axis=0) ** 2,
    )


@lru_cache
def _tuned(segments: int) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return a/L and k L/EI of the tuned chain.

    Least squares over N+1 gaps and N stiffnesses; the frequencies are no residuals, since
    every trial is brought back to exact ones. Starts at the plain chain; deterministic.
    """

    def jacobian(x: Array, segments: int) -> Array:
        step = DIFFERENCE * np.eye(len(x))
        rise = _residuals(x + step, segments) - _residuals(x - step, segments)
        return (rise / (2 * DIFFERENCE)).T  # (residuals, variables)

    start, precision = np.zeros(2 * segments + 1), {"xtol": 1e-11, "ftol": 1e-11, "gtol": 1e-11}
    found = least_squares(
        _residuals, start, jacobian, args=(segments,), max_nfev=TRIALS, **precision
    )
    a, k = _unpack(found.x, segments)
    k = np.round(_with_exact_frequencies(a, k), STIFFNESS_DIGITS)
    a = np.round(a, POSITION_DIGITS)
    k = np.round(_with_exact_frequencies(a, k), TUNED_DIGITS)
    return tuple(a.tolist()), tuple(k.tolist())


def _residuals(x: Array, segments: int) -> Array:
    """Return what the tuning minimises, for variables (..., 2N+1), each scaled to matter at 1."""
    a, k = _unpack(x, segments)
    k = _with_exact_frequencies(a, k)
    omega, q = chain_modes(a, k)
    chain, beam = shapes_at_nodes(a, q)
    shape = (chain - beam).reshape(*x.shape[:-1], -1)
    top = np.log(omega[..., -1:] / (TOP_TARGET * segments**2))
    parts = (shape_errors(a, k, q) / COUPLING_SCALE, shape / SHAPE_SCALE, top, VARIABLE_WEIGHT * x)
    return np.concatenate(parts, axis=-1)


def _unpack(x: Array, segments: int) -> tuple[Array, Array]:
    """Return a/L and k L/EI (..., N) of the variables; zero is the plain chain.

    The variables are logarithms: of N+1 gaps over (1/2, 1, ..., 1, 1/2), up to their sum, and
    of k over EI/cell, a cell reaching half-way to the neighbouring hinges.
    """
    plain = np.ones(segments + 1)
    plain[[0, -1]] = 0.5
    gap = plain * np.exp(x[..., : segments + 1])
    gap = gap / gap.sum(axis=-1, keepdims=True)
    a = np.cumsum(gap[..., :-1], axis=-1)
    between = (a[..., 1:] + a[..., :-1]) / 2
    zero, one = np.zeros_like(a[..., :1]), np.ones_like(a[..., :1])
    cell = np.diff(np.concatenate([zero, between, one], axis=-1), axis=-1)
    return a, np.exp(x[..., segments + 1 :]) / cell


def _with_exact_frequencies(a: Array, k: Array) -> Array:
    """Return k (..., N) changed as little as possible, in log k, until omega_1..3 are exact."""
    for _ in range(NEWTON_STEPS):
        omega, q = chain_modes(a, k)
        error = np.log(omega[..., :TUNED_MODES] / _exact_frequencies())
        least = np.linalg.pinv(frequency_sensitivity(k, omega, q)) @ error[..., None]
        k = k * np.exp(-least[..., 0])
    return k


def _exact_frequencies() -> Array:
    """Return (beta_i L)^2 of the first three modes: omega in units of sqrt(EI/rho)/L^2."""
    return np.array(beta_lengths(TUNED_MODES)) ** 2
