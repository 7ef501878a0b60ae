"""How far does the closed chain part from MuJoCo's, and how far MuJoCo's from itself?

    >>> parting = parted(Robot().plant("chain"))
    >>> parting.apart < parting.limit
    True

Both run under the same random torques; a second MuJoCo run starts a hair's breadth aside. Where a
motion tells roundings apart, the first two part as those do, and no faster.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexsim.errors import FlexsimError
from flexsim.loop.runs import drive
from flexsim.loop.settings import setting
from flexsim.plants.base import Plant
from flexsim.plants.chain_plant import in_closed_form
from studies.parity.motions import POSE, fitting_torque

STEPS = 500  # after which ROUNDING holds
ROUNDING = 1e-12  # [rad]
HAIR = 1e-15  # [rad] by which the second run of MuJoCo's starts aside
NO_FASTER = 100  # times as far apart as MuJoCo's two runs: each step rounds by about a hair


@dataclass(frozen=True)
class Parting:
    """After STEPS steps: how far apart, how far MuJoCo's from itself [rad]; why neither, if so."""

    apart: float = np.nan
    itself: float = np.nan
    missing: str = ""

    @property
    def limit(self) -> float | None:
        """How far apart they may be [rad]."""
        return None if self.missing else max(ROUNDING, NO_FASTER * self.itself)

    @property
    def name(self) -> str:
        """What was found, as a check is named."""
        what = self.missing or f"{STEPS} random torques [rad]"
        return f"closed-chain to MuJoCo: {what}"


def parted(chain: Plant, seed: int = 1) -> Parting:
    """Return how far a chain parts from its closed form, where it has one."""
    closed, why = in_closed_form(chain)
    if closed is chain:
        return Parting(missing=why or f"{chain.name} is not MuJoCo's chain")
    torque = np.abs(fitting_torque(chain, 1.0)).max(axis=0)
    torques = np.random.default_rng(seed).uniform(-1, 1, (STEPS, 2)) * torque
    rest = chain.rest_state(POSE)
    m = len(rest) // 2
    aside = rest.copy()
    aside[:m] += HAIR
    try:
        own, beside, ours = (
            drive(plant, setting("none"), torques, plant.step, state=state).state[:, :m]
            for plant, state in ((chain, rest), (chain, aside), (closed, rest))
        )
    except FlexsimError as error:
        return Parting(missing=str(error))
    return Parting(float(np.abs(own - ours).max()), float(np.abs(own - beside).max()))
