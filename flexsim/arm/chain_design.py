"""Where to cut the beam, and how stiff to make each hinge, so that a chain bends like the beam.

    >>> from flexsim import Parameters
    >>> from flexsim.arm.chain_design import design_chain
    >>> design_chain(Parameters(), 6).frequency[:3] / 6.283185307179586   # [Hz], exact
    array([ 3.33728858, 20.91443054, 58.56101111])

A chain is a rigid piece fixed to the hub, then N rigid segments joined by hinges with springs.
Each piece has the mass, the centre and the inertia of the uniform beam it replaces, so only the
hinges' positions and stiffnesses are free; `flexsim.arm.hinged_beam` has the chain's linear
dynamics. With hinges at the centres of N equal cells and stiffness EI/h (`plain_chain`) the
frequencies converge with order 2 only, with hinges between N + 1 equal cells, MuJoCo's rule of
thumb (`thumb_chain`), with order 1. `flexsim.arm.chain_fit` moves the hinges and tunes the
springs until the first three clamped frequencies are exact, and the modes' couplings to the joints
and the frequencies under any payload as close as N hinges allow. Hinges and springs do not depend
on the payload. Couplings, loaded frequencies and the step pull against each other: see `front`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexsim.arm.beam import beta_lengths, load_of
from flexsim.arm.chain_fit import (
    CHOSEN,
    Weights,
    fitted_chain,
    frequencies_aimed_at,
    loaded_error,
)
from flexsim.arm.hinged_beam import (
    FITTED_MODES,
    chain_modes,
    loaded_frequencies,
    shape_errors,
    shapes_at_nodes,
)
from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.numerics.types import Array

TUNED, UNTUNED, THUMB = "chain", "untuned", "rule-of-thumb"  # kinds of chains, as plants
SEGMENTS = 6  # unless told otherwise
SEGMENTS_LEAST = 3  # a spring for each frequency; none is left for the couplings, off by up to
# 25 % (with 4: 0.4 %), so that 3 is a rung to compare with, not a model of the beam
SEGMENTS_MOST = 16  # the couplings are within 0.002 %, and fitting takes a second
PLAIN_MOST = 200
FRONT_LEAST = 4
FRONT = (  # weights that lead from a low top frequency to close loaded frequencies
    Weights(loaded=3e-2, top=6.0),
    Weights(loaded=1.6e-2, top=8.0),
    CHOSEN,
    Weights(loaded=4e-3, top=13.0),
    Weights(loaded=2e-3, top=16.0),
    Weights(loaded=1e-3, top=20.0),
)


@dataclass(frozen=True, eq=False)
class ChainDesign:
    """A chain of N hinged segments and how well it stands for the beam.

    Attributes:
        segments: N.
        kind: 'chain' with exact frequencies, 'untuned' or 'rule-of-thumb': one of DESIGNS.
        position: (N,) distance of the hinges from the clamp [m].
        stiffness: (N,) of the hinges [N m/rad].
        frequency: (N,) of the clamped chain, without a payload [rad/s].
        frequency_error: (3,) relative to the beam's, (15).
        loaded, loaded_error: (3,) frequencies with the robot's payload [rad/s], and relative to
            the beam's with it.
        Phi_error, moment_error, tip_error: (3,) relative errors of the modes' integral (14), of
            their first moment about the clamp, and of their value at the tip.
        compliance_error: relative error of the static deflection under a force at the tip.
        rotation_error: relative error of the tip's static rotation under a moment there.
        payload_error: largest relative error of the first three frequencies under any payload up
            to the beam's mass, its radius of gyration up to 0.2 L.
        mac: (3,) modal assurance criterion against (15) at the hinges and the tip.
    """

    segments: int
    kind: str
    position: Array
    stiffness: Array
    frequency: Array
    frequency_error: Array
    loaded: Array
    loaded_error: Array
    Phi_error: Array
    moment_error: Array
    tip_error: Array
    compliance_error: float
    rotation_error: float
    payload_error: float
    mac: Array

    @property
    def fitted(self) -> bool:
        """Whether the frequencies have been made exact."""
        return self.kind == TUNED

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
    segments = whole_segments(segments, SEGMENTS_LEAST, SEGMENTS_MOST, reason)
    a, k = fitted_chain(segments)
    return _report(parameters, np.array(a), np.array(k), TUNED)


def front(parameters: Parameters, segments: int = SEGMENTS) -> list[ChainDesign]:
    """Return the chains that other weights lead to, by rising top frequency; ours is among them.

    Raises:
        ParameterError: segments is not a whole number from 4 to 16, or a fit fails.
    """
    segments = whole_segments(
        segments, FRONT_LEAST, SEGMENTS_MOST, "three hinges leave nothing to choose"
    )
    fits = [fitted_chain(segments, weights) for weights in FRONT]
    found = [_report(parameters, np.array(a), np.array(k), TUNED) for a, k in fits]
    return sorted(found, key=lambda design: design.frequency[-1])


def plain_chain(parameters: Parameters, segments: int) -> ChainDesign:
    """Return the untuned chain, for comparison: hinges at cell centres, k = EI/h.

    Raises:
        ParameterError: segments is not a whole number from 3 to 200.
    """
    segments = whole_segments(segments, FITTED_MODES, PLAIN_MOST, "the report compares three modes")
    a = (np.arange(segments) + 0.5) / segments
    return _report(parameters, a, np.full(segments, float(segments)), UNTUNED)


def thumb_chain(parameters: Parameters, segments: int) -> ChainDesign:
    """Return the chain by MuJoCo's rule of thumb: hinges between N + 1 equal cells h, k = EI/h.

    The first cell is fixed to the hub. Nothing bends within half a cell of the clamp and of the
    tip, so that it is too stiff by terms of first order: a moment at the tip turns it by
    N/(N + 1) of what it turns the beam.

    Source: MuJoCo 2.2 to 3.x, `composite` of type cable with initial="none", and its plugin
    mujoco.elasticity.cable: E I over the distance of the bodies, at the joint between them. (The
    former has none at the clamp.) MuJoCo 4 has dropped both.

    Raises:
        ParameterError: segments is not a whole number from 3 to 200.
    """
    segments = whole_segments(segments, FITTED_MODES, PLAIN_MOST, "the report compares three modes")
    a = np.arange(1, segments + 1) / (segments + 1)
    return _report(parameters, a, np.full(segments, segments + 1.0), THUMB)


DESIGNS: dict[str, Callable[[Parameters, int], ChainDesign]] = {  # by the kind of plant
    TUNED: design_chain,
    UNTUNED: plain_chain,
    THUMB: thumb_chain,
}


def whole_segments(segments: Any, least: int, most: int, reason: str) -> int:
    """Return a number of segments, or raise a ParameterError unless it is whole and in range."""
    is_number = isinstance(segments, (int, np.integer)) and not isinstance(segments, bool)
    if not is_number or not least <= segments <= most:
        raise ParameterError(
            f"number of segments is {segments!r}; give a whole number from {least} to {most} "
            f"({reason})"
        )
    return int(segments)


def _report(parameters: Parameters, a: Array, k: Array, kind: str) -> ChainDesign:
    """Return a dimensionless chain in metres and N m/rad, with its errors."""
    p = parameters
    omega, q = chain_modes(a, k)
    load, unit = load_of(p), np.sqrt(p.EI / p.rho) / p.L**2
    loaded = loaded_frequencies(a, k, load)
    exact = np.array([b * b for b in beta_lengths(FITTED_MODES, load)])
    errors = shape_errors(a, k, q)
    chain, beam = shapes_at_nodes(a, q)  # unit columns
    return ChainDesign(
        segments=len(a),
        kind=kind,
        position=p.L * a,
        stiffness=p.EI / p.L * k,
        frequency=omega * unit,
        frequency_error=omega[:FITTED_MODES] / frequencies_aimed_at() - 1,
        loaded=loaded * unit,
        loaded_error=loaded / exact - 1,
        Phi_error=errors[:3],
        moment_error=errors[3:6],
        tip_error=errors[6:9],
        compliance_error=float(errors[9]),
        rotation_error=float(errors[10]),
        payload_error=loaded_error(a, k),
        mac=np.sum(chain * beam, axis=0) ** 2,
    )
