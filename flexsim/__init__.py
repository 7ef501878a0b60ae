"""flexsim: a flexible two-link arm, modelled twice, under fractional-order control.

>>> from controllers import TUNED
>>> from flexsim import Robot, closed_loop, measures, reference, setting, trajectory
>>> robot = Robot()                                       # or Robot.of("my.xml")
>>> circle = reference(trajectory("circle"), robot.parameters)
>>> for name in ("assumed-modes", "chain"):
...     plant = robot.plant(name, setting("simulink"))
...     (motion,) = closed_loop(plant, setting("simulink"), circle, [TUNED["circle"].filters(1e-3)])
...     print(plant.name, measures(motion, circle)["envelope"])

Importing flexsim loads nothing heavy: a public name is loaded when it is first asked for.
"""

from __future__ import annotations

import importlib
import os
from typing import TYPE_CHECKING, Any

# numba would take Intel's vector functions where they are installed, whose last bits are others;
# it looks when it is first imported
os.environ.setdefault("NUMBA_DISABLE_INTEL_SVML", "1")

if TYPE_CHECKING:
    from flexsim import errors
    from flexsim.arm.parameters import Parameters
    from flexsim.errors import DivergenceError, FlexsimError, ModelError, ParameterError, RunError
    from flexsim.loop.friction import Friction
    from flexsim.loop.hardware import HARDWARE, Hardware
    from flexsim.loop.metrics import envelope_half_width, measures, performance_index
    from flexsim.loop.motion import Motion
    from flexsim.loop.runs import closed_loop, drive, evaluate, measure
    from flexsim.loop.settings import SETTINGS, Setting, setting
    from flexsim.loop.trajectories import TRAJECTORIES, Reference, Trajectory, reference, trajectory
    from flexsim.mjcf.chain_file import load_chain
    from flexsim.mjcf.shipped import MODELS, model_path
    from flexsim.plants.base import Plant
    from flexsim.plants.chain_plant import ChainPlant
    from flexsim.plants.modes_plant import AssumedModesPlant
    from flexsim.plants.rod_plant import RodPlant
    from flexsim.robot import Robot

_HOMES = {  # name: the module that it is loaded from, as above
    "errors": "errors",
    "Parameters": "arm.parameters",
    "DivergenceError": "errors",
    "FlexsimError": "errors",
    "ModelError": "errors",
    "ParameterError": "errors",
    "RunError": "errors",
    "Friction": "loop.friction",
    "HARDWARE": "loop.hardware",
    "Hardware": "loop.hardware",
    "envelope_half_width": "loop.metrics",
    "measures": "loop.metrics",
    "performance_index": "loop.metrics",
    "Motion": "loop.motion",
    "closed_loop": "loop.runs",
    "drive": "loop.runs",
    "evaluate": "loop.runs",
    "measure": "loop.runs",
    "SETTINGS": "loop.settings",
    "Setting": "loop.settings",
    "setting": "loop.settings",
    "TRAJECTORIES": "loop.trajectories",
    "Reference": "loop.trajectories",
    "Trajectory": "loop.trajectories",
    "reference": "loop.trajectories",
    "trajectory": "loop.trajectories",
    "load_chain": "mjcf.chain_file",
    "MODELS": "mjcf.shipped",
    "model_path": "mjcf.shipped",
    "Plant": "plants.base",
    "ChainPlant": "plants.chain_plant",
    "AssumedModesPlant": "plants.modes_plant",
    "RodPlant": "plants.rod_plant",
    "Robot": "robot",
}

__all__ = [  # the type checker wants them written out
    "HARDWARE",
    "MODELS",
    "SETTINGS",
    "TRAJECTORIES",
    "AssumedModesPlant",
    "ChainPlant",
    "DivergenceError",
    "FlexsimError",
    "Friction",
    "Hardware",
    "ModelError",
    "Motion",
    "ParameterError",
    "Parameters",
    "Plant",
    "Reference",
    "Robot",
    "RodPlant",
    "RunError",
    "Setting",
    "Trajectory",
    "closed_loop",
    "drive",
    "envelope_half_width",
    "errors",
    "evaluate",
    "load_chain",
    "measure",
    "measures",
    "model_path",
    "performance_index",
    "reference",
    "setting",
    "trajectory",
]


def __getattr__(name: str) -> Any:
    """Return a public name, from now on an attribute like any other."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module = importlib.import_module(f"{__name__}.{_HOMES[name]}")
    value = module if name == _HOMES[name] else getattr(module, name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Return the public names too that are not loaded yet."""
    return sorted({*globals(), *_HOMES})
