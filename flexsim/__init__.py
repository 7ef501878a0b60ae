"""flexsim: a flexible two-link arm, modelled twice, under fractional-order control.

>>> from controllers import TUNED
>>> from flexsim import (
...     AssumedModesPlant, ChainPlant, Parameters, closed_loop, measures, reference, setting,
...     trajectory,
... )
>>> robot = Parameters()
>>> circle = reference(trajectory("circle"), robot)
>>> for plant in (AssumedModesPlant(robot), ChainPlant.designed(robot)):
...     (motion,) = closed_loop(plant, setting("print"), circle, [TUNED["circle"].filters(1e-3)])
...     print(plant.name, measures(motion, circle)["envelope"])
"""

from flexsim.arm.parameters import Parameters
from flexsim.errors import DivergenceError, FlexsimError, ModelError, ParameterError, RunError
from flexsim.loop.friction import Friction
from flexsim.loop.metrics import envelope_half_width, measures, performance_index
from flexsim.loop.motion import Motion
from flexsim.loop.runs import closed_loop, drive, evaluate
from flexsim.loop.settings import SETTINGS, Setting, setting
from flexsim.loop.trajectories import TRAJECTORIES, Reference, Trajectory, reference, trajectory
from flexsim.mjcf.chain_file import load_chain
from flexsim.plants.chain_plant import ChainPlant
from flexsim.plants.modes_plant import AssumedModesPlant

__all__ = [
    "SETTINGS",
    "TRAJECTORIES",
    "AssumedModesPlant",
    "ChainPlant",
    "DivergenceError",
    "FlexsimError",
    "Friction",
    "ModelError",
    "Motion",
    "ParameterError",
    "Parameters",
    "Reference",
    "RunError",
    "Setting",
    "Trajectory",
    "closed_loop",
    "drive",
    "envelope_half_width",
    "evaluate",
    "load_chain",
    "measures",
    "performance_index",
    "reference",
    "setting",
    "trajectory",
]
