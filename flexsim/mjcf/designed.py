"""The robot's own chain and rod, as files: what the plants run unless a file is given.

>>> designed_chain(Parameters(), segments=6).step
0.001
"""

from __future__ import annotations

import math
from contextlib import suppress

import mujoco

from flexsim.arm.chain_design import DESIGNS, SEGMENTS, TUNED
from flexsim.arm.parameters import Parameters
from flexsim.errors import ModelError, ParameterError
from flexsim.mjcf.chain_file import ChainModel, load_chain, longest_step
from flexsim.mjcf.chain_xml import chain_mjcf
from flexsim.mjcf.rod_file import RodModel, load_rod
from flexsim.mjcf.rod_xml import ELEMENTS, rod_mjcf
from flexsim.numerics.mujoco_c import quiet_warnings
from flexsim.numerics.step_limits import LONGEST_STEP, RK4_LIMIT, halved

MARGIN = 1.05  # of a designed chain to the limit of its frequencies


def designed_chain(
    parameters: Parameters, segments: int = SEGMENTS, step: float | None = None, kind: str = TUNED
) -> ChainModel:
    """Return the chain of a robot, as `flexsim chain` writes it.

    Args:
        parameters: the robot; segments: N.
        step: physics step [s]; None for 1 ms, halved until RK4 can take it.
        kind: how hinges and springs are chosen, one of DESIGNS.

    Raises:
        ParameterError, ModelError: segments or step out of range.
    """
    design = DESIGNS[kind](parameters, segments)
    if step is None:
        bound = RK4_LIMIT / (MARGIN * design.frequency[-1])
        if halved(bound) == LONGEST_STEP:  # as it is for most: compiled once only
            with suppress(ModelError):
                return load_chain(text=chain_mjcf(parameters, design, timestep=LONGEST_STEP))
        model = compiled(chain_mjcf(parameters, design))
        step = halved(min(bound, longest_step(model) or math.inf))
    return load_chain(text=chain_mjcf(parameters, design, timestep=step))


def compiled(text: str) -> mujoco.MjModel:
    """Return the model of MJCF that was written for a robot.

    Raises:
        ParameterError: MuJoCo does not take the robot's numbers.
    """
    try:
        with quiet_warnings():
            return mujoco.MjModel.from_xml_string(text)
    except (ValueError, mujoco.FatalError) as error:
        said = " ".join(str(error).split())
        raise ParameterError(
            f"the robot's parameters make no MJCF that MuJoCo compiles: {said}; change them"
        ) from None


def designed_rod(
    parameters: Parameters, elements: int = ELEMENTS, step: float | None = None
) -> RodModel:
    """Return the rod of a robot, as `flexsim.mjcf.rod_xml` writes it.

    Args:
        parameters: the robot; elements: N.
        step: physics step [s]; None for 1 ms, halved until RK4 can take it.

    Raises:
        ParameterError, ModelError: elements or step out of range.
    """
    return load_rod(text=rod_mjcf(parameters, elements, step))
