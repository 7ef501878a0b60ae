"""flexsim: a flexible two-link arm, modelled twice, under fractional-order control."""

from flexsim.errors import DivergenceError, FlexsimError, ModelError, ParameterError, RunError
from flexsim.motion import Motion
from flexsim.parameters import Parameters

__all__ = [
    "DivergenceError",
    "FlexsimError",
    "ModelError",
    "Motion",
    "ParameterError",
    "Parameters",
    "RunError",
]
