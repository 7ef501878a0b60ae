"""The plants of a robot whose links both bend: assumed modes of two beams, or two chains.

>>> two_flexible_plant("assumed-modes:3", Arm(parameters, link1), None, setting("none"))
"""

from __future__ import annotations

from dataclasses import replace

from flexsim.arm.arms import Arm, FirstLink
from flexsim.arm.chain_design import SEGMENTS
from flexsim.errors import ParameterError
from flexsim.loop.settings import Setting
from flexsim.mjcf.arms.two_chains import designed_two_chains
from flexsim.mjcf.chain_file import ChainModel
from flexsim.numerics.step_limits import SHORTEST_STEP, halved
from flexsim.plants.base import Plant
from flexsim.plants.chain_plant import ChainPlant, ClosedChainPlant
from flexsim.plants.two_flexible.beams_plant import TwoBeamsPlant
from flexsim.robot.held_friction import shortened, steepest, too_long
from flexsim.robot.plant_names import plant_kind

PLANTS = "assumed-modes[:n], chain[:N] or closed-chain[:N]"


def two_flexible_plant(
    name: str,
    arm: Arm,
    file: ChainModel | None,
    setting: Setting | None,
    sizes: tuple[int, int | None],
    steps: tuple[float | None, float | None],
) -> Plant:
    """Return a plant of an arm whose links both bend, by its name.

    Args:
        name: as `flexsim.robot.Robot.plant`. arm: with a setting's motors. file: its chains.
        setting: whose friction is held over a step. sizes: modes, segments of each link where the
            name has no size. steps: of assumed modes and of chains [s], None for what they take.

    Raises:
        ParameterError: there is no such plant of it, or a number is out of range.
    """
    kind, size = plant_kind(name)
    if kind not in ("assumed-modes", "chain", "closed-chain"):
        raise ParameterError(
            f"plant {name!r} has a rigid link 1, and this arm's bends; choose {PLANTS}"
        )
    if kind == "assumed-modes":
        if file is not None:
            raise ParameterError(
                f"plant {name!r} is made from two uniform beams, not from {file.source}; choose "
                "chain or closed-chain, or --arm two-flexible"
            )
        return _beams(name, arm, size or sizes[0], setting, steps[0])
    its = ChainPlant if kind == "chain" else ClosedChainPlant
    if file is not None:
        _require_its_own(file, size or sizes[1], steps[1])
        shortened(file, setting, file.step)
        return its(arm.parameters, file, name)
    segments = size or sizes[1] or SEGMENTS
    chain = designed_two_chains(arm, (segments, segments), steps[1])
    shorter = shortened(chain, setting, steps[1])
    if shorter is not None:
        chain = designed_two_chains(arm, (segments, segments), shorter)
    return its(arm.parameters, chain, name)


def _beams(
    name: str, arm: Arm, modes: int, setting: Setting | None, step: float | None
) -> TwoBeamsPlant:
    """Return the assumed modes, by default at 1 ms, halved until RK4 can take them."""
    plant = TwoBeamsPlant(arm, modes, SHORTEST_STEP if step is None else step, name)
    longest = plant.longest_held_step(steepest(setting))
    if step is None:
        return replace(plant, step=halved(longest))
    if step >= longest:
        raise ParameterError(too_long(f"physics step {step:g} s", name, longest))
    return plant


def _require_its_own(file: ChainModel, segments: int | None, step: float | None) -> None:
    """Refuse numbers that are given otherwise than a file has them; None is not given."""
    for what, value, its in (
        ("segments", segments, len(file.lengths)),
        ("step", step, file.step),
    ):
        if value is not None and value != its:
            raise ParameterError(
                f"{file.source} has {what} {its:g}, not {value:g}; leave it out, or edit the file"
            )


def changed_arm(arm: Arm, stiffness: float, density: float, payload: float) -> Arm:
    """Return an arm with the stiffness and density of both beams times a factor, and a payload.

    The damping ratios and hub 1 stay.
    """
    p, one = arm.parameters, arm.first
    heavier = FirstLink(stiffness * one.EI, density * one.rho, one.r, one.zeta)
    more = (density - 1) * one.rho * (p.L_R**3 - one.r**3) / 3
    beam = {"EI": stiffness * p.EI, "rho": density * p.rho, "I_R0": p.I_R0 + more}
    return Arm(replace(p, payload=p.payload + payload, **beam), heavier)
