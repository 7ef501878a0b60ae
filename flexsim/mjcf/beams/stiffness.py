"""The bending stiffness of a compiled chain's beam, and the damping of its material.

>>> bending = bending_of(load_chain("models/chain6.xml"), lengths=(0.5,))
>>> bending.EI, bending.eta            # (N,) [N m2], [s] of the cells of the hinges

A hinge stands for a cell of the beam. Where the hinges are those of a chain that `flexsim chain`
writes, tuned or plain, each one's stiffness over the designed one of a beam with EI = 1 is the EI
of its cell. Cells are cut so that each has its hinge's share in the deflection under a force at
the tip: whatever hinge is edited, that deflection is the chain's own.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from flexsim.arm.chain_design import SEGMENTS_LEAST, SEGMENTS_MOST
from flexsim.arm.chain_fit import fitted_chain
from flexsim.mjcf.beams.masses import alike
from flexsim.mjcf.chain_file import ChainModel
from flexsim.numerics.elementary import cbrt, cubed
from flexsim.numerics.types import Array

SAME_PLACE = 1e-7  # of the length: hinges nearer to the design's are those; files have 12 digits


@dataclass(frozen=True, eq=False)
class Bending:
    """What bends: cells from the clamp on, one for each hinge.

    Attributes:
        ends: (N+1,) of the cells [m]. EI: (N,) [N m2]. eta: (N,) damping over stiffness [s].
        design: 'tuned' or 'plain' as `flexsim chain` writes it, '' where hinges are elsewhere.
    """

    ends: Array
    EI: Array
    eta: Array
    design: str

    @property
    def uniform(self) -> bool:
        """Whether EI is one number."""
        return alike(self.EI)


def bending_of(chain: ChainModel, lengths: Sequence[float]) -> Bending:
    """Return what bends of a chain whose every hinge has a spring.

    Args:
        lengths: of the beam for which the chain may have been designed, its own tried last [m].
    """
    model, L, place = chain.model, chain.reach - chain.clamp, chain.hinges
    stiffness = model.jnt_stiffness[2:].copy()
    eta = model.dof_damping[2:] / stiffness
    for length in (*lengths, L):
        for design, a, k in _designs(len(place)):
            if np.abs(place - length * a).max() <= SAME_PLACE * length:
                share = np.cumsum((1 - a) ** 2 / k)
                ends = np.append(0.0, length * (1 - cbrt(1 - share / share[-1])))
                ends[-1] = L
                return Bending(ends, stiffness * length / k, eta, design)
    middles = (place[:-1] + place[1:]) / 2
    ends = np.concatenate([[0.0], middles, [L]])
    EI = stiffness * np.diff(ends)
    lever = L - place  # so that a force at the tip deflects as far
    own = np.sum((cubed(L - ends[:-1]) - cubed(L - ends[1:])) / (3 * EI))
    return Bending(ends, EI * own / np.sum(lever**2 / stiffness), eta, "")


def _designs(segments: int) -> Iterator[tuple[str, Array, Array]]:
    """Give name, a/L and k L/EI (N,) of the chains that `flexsim chain` writes."""
    middle = (np.arange(segments) + 0.5) / segments
    yield "plain", middle, np.full(segments, float(segments))
    if SEGMENTS_LEAST <= segments <= SEGMENTS_MOST:
        a, k = fitted_chain(segments)
        yield "tuned", np.array(a), np.array(k)
