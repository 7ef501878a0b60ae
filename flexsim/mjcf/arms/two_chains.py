"""An arm whose link 1 bends as well, as an MJCF file of two chains in series.

>>> arm = designed_two_chains(named_arm("two-flexible"), segments=(6, 6))
>>> arm.second, arm.L_R, arm.reach
(7, 0.5, 0.5)

Read it is as any chain's, by `flexsim.mjcf.chain_file`: hinges `joint1`, those of link 1, `joint2`,
those of link 2, in a row along x; sites `hub` and `tip`, motors `motor1` and `motor2`.
"""

from __future__ import annotations

import numpy as np

from flexsim.arm.arms import Arm
from flexsim.arm.chain_design import design_chain
from flexsim.arm.parameters import Parameters
from flexsim.errors import ModelError
from flexsim.mjcf.arms.two_chains_xml import two_chains_mjcf
from flexsim.mjcf.chain_file import ChainModel, load_chain, longest_step
from flexsim.mjcf.designed import MARGIN, compiled
from flexsim.numerics.step_limits import halved


def straight_parameters(arm: ChainModel) -> Parameters:
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


def designed_two_chains(
    arm: Arm, segments: tuple[int, int], step: float | None = None
) -> ChainModel:
    """Return the chains of an arm whose links both bend.

    Args:
        arm: whose link 1 bends; segments: of links 1 and 2.
        step: physics step [s]; None for 1 ms, halved until RK4 can take it.

    Raises:
        ParameterError, ModelError: segments or step out of range.
    """
    designs = design_chain(arm.beam1, segments[0]), design_chain(arm.parameters, segments[1])
    if step is None:
        longest = longest_step(compiled(two_chains_mjcf(arm, designs))) or np.inf
        step = halved(longest / MARGIN)
    return load_chain(text=two_chains_mjcf(arm, designs, step))
