"""The checks that need no motion: frequencies and couplings of the models, and of the exact beam.

>>> beam_checks(stands_for(robot), robot.chain_plant(), DEFAULT_LIMITS)
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from flexsim.arm.beam import MODES
from flexsim.arm.chain_design import design_chain, plain_chain
from flexsim.arm.finite_beam import flexible_modes
from flexsim.errors import FlexsimError
from flexsim.mjcf.beams.beam_of import StandsFor
from flexsim.numerics.types import Array
from flexsim.plants.chain_as_modes import vibration
from flexsim.plants.chain_plant import ChainPlant
from flexsim.plants.modes_plant import AssumedModesPlant
from studies.parity.side_by_side import couplings_of, error

CLAMPED_LIMIT = 1e-9  # relative: the design tunes these to rounding, files have twelve digits
LEFT_OUT = 1.5  # times what three modes of the beam itself leave out; the chain has an error, too
DESIGN_MARGIN = 1.02  # of a chain to the errors that its design has in closed form


class BeamLimits(NamedTuple):
    """What a chain is held to beside its beam, relative; None: stated only."""

    static: float | None
    clamped: float | None
    joint_free: float | None
    coupling: float | None


class Limits(NamedTuple):
    """What the two models of a robot are held to beside each other, relative but for the tips.

    A tip [m rms over 2 s] of None is held to TIP_SHARE and the square of v/L, times the largest v:
    the equations keep terms of second order in v/L.
    """

    joint_free: float
    coupling: float
    acceleration: float
    small_tip: float | None
    large_tip: float | None
    energy: float


# the paper's robot: what six hinges and three modes are off it, measured, with a margin
DEFAULT_BEAM = BeamLimits(5e-4, CLAMPED_LIMIT, 3e-4, 8e-4)
DEFAULT_LIMITS = Limits(2e-3, 5e-4, 5e-3, 1e-5, 1.5e-4, 1e-11)
# a file's modes are its own chain's: three of them leave 1e-3 of the joint-free frequencies of the
# edits that the tests try, beyond what as many modes of the beam itself do, and nothing of
# couplings; a soft or loaded beam accelerates less, which makes the same differences larger shares;
# a stiff one is damped more by RK4
EDITED_LIMITS = Limits(2e-3, 3e-3, 5e-2, None, None, 1e-10)
# a payload of up to the beam's mass, for which six hinges and more are tuned
LOADED_BEAM = BeamLimits(5e-4, 6e-3, 6e-3, 1e-2)
STATED = BeamLimits(None, None, None, None)


@dataclass(frozen=True)
class Check:
    """One check: its figure, the limit it is held to (None: stated only) and the verdict."""

    name: str
    value: float
    limit: float | None
    ok: bool
    unit: str = "relative"
    beyond: str = ""  # which model was used beyond itself, in words

    @property
    def verdict(self) -> str:
        """In a word."""
        return "" if self.limit is None else "holds" if self.ok else "FAILS"


def check(name: str, value: float, limit: float | None = None, unit: str = "relative") -> Check:
    """Return a check; a figure that is no number fails."""
    return Check(name, float(value), limit, limit is None or bool(value <= limit), unit)


def tried(name: str, checks: Callable[[], Iterable[Check]]) -> list[Check]:
    """Return checks, or one that fails and says why they could not be made."""
    try:
        return list(checks())
    except FlexsimError as refusal:
        return [check(f"{name}: {refusal}", np.inf, 0.0)]


def limits_beside(stands: StandsFor, segments: int, default: bool) -> BeamLimits:
    """Return what a chain is held to beside its beam: what its design promises, if it has one.

    An edited hinge stands for a cell, and where in it the edit is nobody knows: a beam in pieces is
    followed as well as a plain chain of as many cells follows a uniform one.

    Args:
        stands: for which beam. segments: N. default: whether it is the paper's robot's chain of 6.
    """
    p = stands.reference.parameters
    if default:
        return DEFAULT_BEAM
    if not stands.design:
        return STATED
    found = LOADED_BEAM if p.payload or p.payload_inertia else DEFAULT_BEAM
    design = (design_chain if stands.design == "tuned" else plain_chain)(p, segments)
    clamped = float(np.abs(design.frequency_error).max())
    shapes = max(clamped, design.coupling_error, float(np.abs(design.tip_error).max()))
    free = shapes + stands.reference.truncation(MODES)  # modes 1 to 3 are what was fitted
    own = (abs(design.compliance_error), clamped, free, shapes)
    return BeamLimits(
        *(max(a, DESIGN_MARGIN * b) for a, b in zip(found, own, strict=True) if a is not None)
    )


def beam_checks(stands: StandsFor, chain: ChainPlant, limits: BeamLimits) -> list[Check]:
    """Return static deflection, frequencies and couplings of the chain against its beam."""
    beam = stands.reference
    found = vibration(chain.chain, beam.parameters, MODES)
    static = abs(found.compliance / beam.compliance - 1)
    exact = beam.couplings(MODES)
    shapes = zip((found.Phi, found.moment, found.tip), exact, strict=True)
    loaded = bool(beam.parameters.payload or beam.parameters.payload_inertia)
    couplings = max(  # a payload keeps tips of higher modes still: of nothing there is no share
        float(np.abs(own - its).max() / np.abs(its).max()) if loaded else error(own, its)
        for own, its in shapes
    )
    against = "exact" if beam.uniform else "beam of pieces"
    clamped, free = beam.clamped(MODES), beam.joint_free(MODES)
    return [
        check(f"static tip deflection, chain to {against}", static, limits.static),
        check(
            f"clamped frequencies 1-3, chain to {against}",
            error(found.clamped, clamped),
            limits.clamped,
        ),
        check("joint-free frequencies 1-3", error(found.joint_free, free), limits.joint_free),
        check("couplings and tip values 1-3", max(couplings, static), limits.coupling),
    ]


def model_checks(
    stands: StandsFor, modes: AssumedModesPlant, chain: ChainPlant, limits: Limits
) -> list[Check]:
    """Return frequencies and couplings of the assumed modes against the chain's."""
    found = vibration(chain.chain, stands.reference.parameters, MODES)
    linear, own = modes.linearised(0.0), modes.coefficients
    clamped: Array = np.sqrt(own.stiffness / own.mass)
    free = flexible_modes(linear.M, linear.D, linear.K)[0][:MODES]
    table = couplings_of(stands.reference, modes, found)
    couplings = max(error(each["assumed_modes"], each["chain"]) for each in table.values())
    left_out = limits.joint_free + LEFT_OUT * stands.reference.truncation(MODES)
    return [
        check("assumed modes to chain: clamped 1-3", error(clamped, found.clamped), CLAMPED_LIMIT),
        check("  joint-free frequencies 1-3", error(free, found.joint_free), left_out),
        check("  couplings and tip values 1-3", couplings, limits.coupling),
    ]
