"""An arm whose link 1 bends as well: an MJCF file of two chains, read, checked and made ready.

>>> arm = load_two_chains("models/two_flexible.xml")
>>> arm.second, arm.L_R, arm.reach
(7, 0.5, 0.5)

The file may be edited as long as it stays that arm: hinges `joint1`, those of link 1, `joint2`,
those of link 2, in a row along x; sites `hub` and `tip`, motors `motor1` and `motor2`.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from flexsim.arm.arms import Arm
from flexsim.arm.chain_design import design_chain
from flexsim.arm.parameters import Parameters
from flexsim.errors import ModelError
from flexsim.mjcf.arm_file import (
    ArmFile,
    Given,
    Motion,
    given_text,
    longest_of,
    read_arm,
    require_stable_step,
)
from flexsim.mjcf.arms.two_chains_xml import two_chains_mjcf
from flexsim.mjcf.chain_file import mass_matrix
from flexsim.mjcf.designed import MARGIN, compiled
from flexsim.mjcf.own_motion import require_steady
from flexsim.mjcf.reading.elements import elements
from flexsim.mjcf.reading.geometry import straight
from flexsim.mjcf.reading.names import Names
from flexsim.numerics.step_limits import POSES, halved
from flexsim.numerics.types import Array

KIND = "two-chains"


@dataclass(frozen=True, eq=False)
class TwoChains(ArmFile):
    """A compiled MJCF file of two chains in series, with its geometry.

    Coordinates are joint 1, joint 2, then the hinges of link 1 and of link 2, whatever the file's
    order is.

    Attributes:
        model, text, source, L_R, clamp: see `ArmFile`.
        link1: lengths of link 1's pieces, from joint 1 to joint 2 [m].
        root: from joint 2 to link 2's first hinge [m]; lengths: (N,) of its segments [m].
    """

    kind = KIND

    link1: Array
    root: float
    lengths: Array

    @property
    def second(self) -> int:
        """Place of joint 2 in the file's order of joints: behind those of link 1."""
        return len(self.link1)

    @property
    def order(self) -> NDArray[np.intp]:
        """For each coordinate, which joint of the file it is (m,)."""
        rest = np.setdiff1d(np.arange(self.model.njnt), (0, self.second))
        return np.concatenate([[0, self.second], rest])

    @property
    def reach(self) -> float:
        """Distance from joint 2 to the tip of the straight link 2 [m]."""
        return self.root + float(self.lengths.sum())

    def motion(self, theta2: float) -> Motion:
        """Return M, D, K (m, m) of the coordinates; see `ArmFile`."""
        return _motion(self.model, self.order, theta2)


def _motion(model: mujoco.MjModel, order: NDArray[np.intp], theta2: float) -> Motion:
    pose = np.zeros(model.nq)
    pose[order[1]] = theta2
    M = mass_matrix(model, pose)[np.ix_(order, order)]
    return M, np.diag(model.dof_damping[order]), np.diag(model.jnt_stiffness[order])


def straight_parameters(arm: TwoChains) -> Parameters:
    """Return the robot of a file with its links straight, as far as loops ask for it.

    Lengths, and link 2's mass and static tip compliance, are the file's; masses and inertias of
    the hubs are not looked for: no plant of such a file takes them from here.

    Raises:
        ModelError: a hinge of link 2 has no stiffness.
    """
    L, lever = arm.reach - arm.clamp, np.cumsum(arm.lengths[::-1])[::-1]
    stiffness = arm.model.jnt_stiffness[arm.second + 1 :]
    if not stiffness.all():
        raise ModelError(
            f"{arm.source}: a hinge of link 2 has no stiffness, so it does not vibrate; give each "
            "one"
        )
    EI = L**3 / (3 * float(np.sum(lever**2 / stiffness)))
    bodies = arm.model.jnt_bodyid[arm.second + 1 :]
    rho = float(arm.model.body_mass[bodies].sum()) / float(arm.lengths.sum())
    return Parameters(L_R=arm.L_R, r=arm.clamp, L=L, rho=rho, EI=EI)


def bends_twice(text: str) -> bool:
    """Return whether MJCF has joints between joint1 and joint2: link 1 bends."""
    names = [
        each.attributes.get("name")
        for each in elements(text)
        if each.tag == "joint" and "joint" not in each.attributes
    ]
    if not {"joint1", "joint2"} <= set(names):
        return False
    return names.index("joint2") > names.index("joint1") + 1


def load_two_chains(
    path: str | Path | None = None, text: str | None = None, names: Names | None = None
) -> TwoChains:
    """Return the arm of an MJCF file of two chains, or of its text, checked.

    Raises:
        ModelError: the file cannot be read, does not compile, is not the arm, or its step is
            beyond what its integrator can take.
    """
    return two_chains_of(given_text(path, text, names))


def two_chains_of(given: Given) -> TwoChains:
    """Return the arm of MJCF; see `load_two_chains`."""
    source, text, _, model = read_arm(KIND, given)
    data = straight(model)
    x = np.append(data.xanchor[:, 0], data.site("tip").xpos[0])
    second = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, "joint2")
    lengths = np.diff(x)
    piece = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "root")
    clamp = float(data.xpos[piece][0] - x[second]) if piece >= 0 else float(lengths[second])
    arm = TwoChains(
        model,
        text,
        source,
        float(x[second]),
        clamp,
        lengths[:second].copy(),
        float(lengths[second]),
        lengths[second + 1 :].copy(),
    )
    require_stable_step(arm)
    require_steady(arm)
    return arm


def designed_two_chains(
    arm: Arm, segments: tuple[int, int], step: float | None = None
) -> TwoChains:
    """Return the chains of an arm whose links both bend.

    Args:
        arm: whose link 1 bends; segments: of links 1 and 2.
        step: physics step [s]; None for 1 ms, halved until RK4 can take it.

    Raises:
        ParameterError, ModelError: segments or step out of range.
    """
    designs = design_chain(arm.beam1, segments[0]), design_chain(arm.parameters, segments[1])
    if step is None:
        model = compiled(two_chains_mjcf(arm, designs))
        second = segments[0] + 1
        rest = np.setdiff1d(np.arange(model.njnt), (0, second))
        order = np.concatenate([[0, second], rest])
        motions = [_motion(model, order, float(pose)) for pose in POSES]
        step = halved(longest_of(model, motions, motions[0][1]) / MARGIN)
    return load_two_chains(text=two_chains_mjcf(arm, designs, step))
