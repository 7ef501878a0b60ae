"""EXUDYN's beam for a robot, its step short enough for a setting's friction."""

from __future__ import annotations

from dataclasses import replace

from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.loop.settings import Setting
from flexsim.numerics.step_limits import halved
from flexsim.plants.exudyn_beam.plant import ELEMENTS, STEP, ExudynPlant
from flexsim.robot.held_friction import steepest, too_long


def exudyn_plant(
    parameters: Parameters,
    setting: Setting | None = None,
    elements: int | None = None,
    step: float | None = None,
    name: str = "exudyn",
) -> ExudynPlant:
    """Return the plant `exudyn`; elements, step: None for what the tip is converged with.

    Raises:
        ParameterError: EXUDYN is not installed, elements or step are out of range, or the step is
            too long for the friction that is held over it.
    """
    plant = ExudynPlant(
        parameters,
        ELEMENTS if elements is None else elements,
        STEP if step is None else step,
        name,
    )
    longest = plant.longest_held_step(steepest(setting))
    if plant.step < longest:
        return plant
    if step is not None:
        raise ParameterError(too_long(f"physics step {step:g} s", name, longest))
    return replace(plant, step=halved(longest))
