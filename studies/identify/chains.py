"""The chain in closed form under changed numbers, without writing its file anew each time.

>>> family = ChainFamily(robot, "closed-chain", setting, step=1e-3)
>>> family.plant(values).coefficients

Its moments are linear in every mass and inertia, its springs in EI, its dampers in springs and eta:
so the coefficients of a changed robot are those of the nominal one's file and of one file for each
mass or inertia that changes. A test holds them against the changed robot's own file.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from flexsim.arm.parameters import Parameters
from flexsim.loop.settings import Setting
from flexsim.numerics.types import Array
from flexsim.plants.chain_plant import ClosedChainPlant
from flexsim.plants.closed_form_chain import ClosedChain
from flexsim.plants.curvature import curvature_of_chain
from flexsim.robot import Robot

MASSES = ("I_R0", "I_H", "m_H", "I_m1", "I_m2", "rho", "payload", "payload_inertia")
CHANGED = 0.5  # of a number, or of its unit at zero, between the two files
OTHERS = ("EI", "zeta", "F_1", "F_2")  # that are taken in closed form
SIZES = {"I_m1": 1e-2, "I_m2": 1e-3, "payload": 1e-2, "payload_inertia": 1e-4}  # at zero


@dataclass(frozen=True, eq=False)
class _OfFamily(ClosedChainPlant):
    """A closed chain whose coefficients are given; EI: that the chain's own springs are of."""

    given: ClosedChain | None = None
    EI: float = 0.0

    def curvature_rows(self, places: ArrayLike) -> Array:
        """Return the rows (P, m) of the beam's curvature at places; see `Plant`."""
        bent = curvature_of_chain(self.chain, replace(self.parameters, EI=self.EI), places)
        return np.hstack([np.zeros((len(bent), 2)), bent])

    @property
    def coefficients(self) -> ClosedChain:
        """Coefficients of the equations."""
        assert self.given is not None
        return self.given


@dataclass(frozen=True, eq=False)
class ChainFamily:
    """The closed chains of a robot whose numbers change.

    Attributes:
        robot: without a file. name: of the plant. setting: as named. step: physics step [s].
    """

    robot: Robot
    name: str
    setting: Setting
    step: float
    _kept: dict[str, ClosedChainPlant] = field(default_factory=dict)

    def covers(self, values: Mapping[str, float]) -> bool:
        """Return whether these are numbers that it can change."""
        own = [name for name in values if "." not in name]
        return all(name in (*MASSES, *OTHERS) for name in own)

    def plant(self, values: Mapping[str, float]) -> ClosedChainPlant:
        """Return the chain with these numbers in place of the nominal ones.

        Raises:
            ParameterError: no robot has them.
        """
        base = self._built("")
        own = {name: value for name, value in values.items() if "." not in name}
        before = base.parameters
        now = replace(before, **own)
        given = base.coefficients
        arrays = {"J": given.J, "h_x": given.h_x, "h_y": given.h_y, "armature": given.armature}
        for name in MASSES:
            change = getattr(now, name) - getattr(before, name)
            if change != 0.0:
                self._add(arrays, name, change)
        stiffness = given.stiffness * (now.EI / before.EI)
        damping = now.eta * stiffness
        damping[0], damping[1] = now.F_1 * now.r_1**2, now.F_2 * now.r_2**2
        changes: dict[str, Any] = {"stiffness": stiffness, "damping": damping, **arrays}
        found = given._replace(**changes)
        return _OfFamily(now, base.chain, self.name, found, before.EI)

    def _add(self, arrays: dict[str, Array], name: str, change: float) -> None:
        """Add to moments (m,) what a change of a mass or inertia gives."""
        base, other = self._built(""), self._built(name)
        share = change / (getattr(other.parameters, name) - getattr(base.parameters, name))
        for key in arrays:
            before = getattr(base.coefficients, key)
            arrays[key] = arrays[key] + share * (getattr(other.coefficients, key) - before)

    def _built(self, name: str) -> ClosedChainPlant:
        """Return the chain of the nominal robot's file, or with one number changed."""
        if name not in self._kept:
            own: Parameters = self.setting.applied(self.robot.parameters)
            if name:
                value = getattr(own, name)
                own = replace(own, **{name: value + CHANGED * (value or SIZES[name])})
            chosen = replace(self.setting, I_m1=None, I_m2=None)
            robot = replace(self.robot, parameters=own)
            plant = robot.plant(self.name, chosen, chain_step=self.step)
            assert isinstance(plant, ClosedChainPlant)
            self._kept[name] = plant
        return self._kept[name]
