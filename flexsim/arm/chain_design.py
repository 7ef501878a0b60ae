"""Where to cut the beam, and how stiff to make each hinge, so that a chain bends like the beam.

    >>> from flexsim import Parameters
    >>> from flexsim.arm.chain_design import design_chain
    >>> design_chain(Parameters(), 6).frequency[:3] / 6.283185307179586   # [Hz], exact
    array([ 3.33728858, 20.91443054, 58.56101111])

A chain is a rigid piece fixed to the hub, then N rigid segments joined by hinges with springs.
Each piece has the mass, the centre and the inertia of the uniform beam it replaces, so only the
hinges' positions and stiffnesses are free; `flexsim.arm.hinged_beam` has the chain's linear
dynamics. With hinges at the centres of N equal cells and stiffness EI/h (`plain_chain`) the
frequencies converge with order 2 only. `flexsim.arm.chain_fit` moves the hinges and tunes the
springs until the first three clamped frequencies are exact and the modes' couplings to the joints
are as close as N hinges allow.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from flexsim.arm.chain_fit import fitted_chain, frequencies_aimed_at
from flexsim.arm.hinged_beam import FITTED_MODES, chain_modes, shape_errors, shapes_at_nodes
from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.numerics.types import Array

SEGMENTS = 6  # unless told otherwise
SEGMENTS_LEAST = 3  # a spring for each frequency; none is left for the couplings, off by up to
# 25 % (with 4: 0.4 %), so that 3 is a rung to compare with, not a model of the beam
SEGMENTS_MOST = 16  # the couplings are within 0.002 %, and fitting takes 3 s
PLAIN_MOST = 200


@dataclass(frozen=True, eq=False)
class ChainDesign:
    """A chain of N hinged segments and how well it stands for the beam.

    Attributes:
        segments: N.
        fitted: whether the frequencies have been made exact.
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
    fitted: bool
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


def design_chain(parameters: Parameters, segments: int = SEGMENTS) -> ChainDesign:
    """Return the chain with exact frequencies and the closest couplings to the joints.

    Raises:
        ParameterError: segments is not a whole number from 3 to 16, or no chain was found that
            passes its own checks.
    """
    reason = "three frequencies need three hinges, their couplings four; past 16 nothing is gained"
    segments = _whole(segments, SEGMENTS_LEAST, SEGMENTS_MOST, reason)
    a, k = fitted_chain(segments)
    return _report(parameters, np.array(a), np.array(k), fitted=True)


def plain_chain(parameters: Parameters, segments: int) -> ChainDesign:
    """Return the untuned chain, for comparison: hinges at cell centres, k = EI/h.

    Raises:
        ParameterError: segments is not a whole number from 3 to 200.
    """
    segments = _whole(segments, FITTED_MODES, PLAIN_MOST, "the report compares three modes")
    a = (np.arange(segments) + 0.5) / segments
    return _report(parameters, a, np.full(segments, float(segments)), fitted=False)


def _whole(segments: Any, least: int, most: int, reason: str) -> int:
    is_number = isinstance(segments, (int, np.integer)) and not isinstance(segments, bool)
    if not is_number or not least <= segments <= most:
        raise ParameterError(
            f"number of segments is {segments!r}; give a whole number from {least} to {most} "
            f"({reason})"
        )
    return int(segments)


def _report(parameters: Parameters, a: Array, k: Array, fitted: bool) -> ChainDesign:
    """Return a dimensionless chain in metres and N m/rad, with its errors."""
    p = parameters
    omega, q = chain_modes(a, k)
    errors = shape_errors(a, k, q)
    chain, beam = shapes_at_nodes(a, q)  # unit columns
    return ChainDesign(
        segments=len(a),
        fitted=fitted,
        position=p.L * a,
        stiffness=p.EI / p.L * k,
        frequency=omega * np.sqrt(p.EI / p.rho) / p.L**2,
        frequency_error=omega[:FITTED_MODES] / frequencies_aimed_at() - 1,
        Phi_error=errors[:3],
        moment_error=errors[3:6],
        tip_error=errors[6:9],
        compliance_error=float(errors[9]),
        mac=np.sum(chain * beam, axis=0) ** 2,
    )
