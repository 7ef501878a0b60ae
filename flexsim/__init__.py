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

from flexsim.chain import load_chain
from flexsim.errors import DivergenceError, FlexsimError, ModelError, ParameterError, RunError
from flexsim.friction import Friction
from flexsim.metrics import envelope_half_width, measures, performance_index
from flexsim.motion import Motion
from flexsim.parameters import Parameters
from flexsim.robots import AssumedModesPlant, ChainPlant
from flexsim.settings import SETTINGS, Setting, setting
from flexsim.simulate import closed_loop, drive, evaluate
from flexsim.trajectories import TRAJECTORIES, Reference, Trajectory, reference, trajectory

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
