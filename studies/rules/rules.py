"""What do fractional designs by rule come to on a flexible arm, and with which margins?

    >>> result = run(RulesConfig(rule=("flat-phase",)))
    >>> result.designs[0].design, result.loops[0].phase

The rules of the literature are for a rigid joint behind a dead time. Here each is designed for the
arm's own inertias at a pose, as digital controllers, and closed around the linear plant with its
beam: crossing and margin as the rule has them, the margins that are left, poles, steps.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, ClassVar

import numpy as np
import tyro
from rich.progress import Progress

from controllers.knobs import Knob
from controllers.rules import RULES, RigidJoint
from flexsim.arm.locked import LOCKED
from flexsim.errors import ParameterError
from flexsim.linear.growth import extreme_poses, loop_options
from flexsim.linear.linearise import linearise
from flexsim.linear.loop_poles import LinearLoop, LoopOptions, SampledPlant, sampled_plant
from flexsim.loop.control.stacking import stack
from flexsim.loop.settings import setting
from flexsim.loop.trajectories import reference, trajectory
from flexsim.numerics.clocks import PERIOD
from flexsim.plants.base import Plant
from studies.core.carry_out import Study, counted
from studies.core.study_options import Out, StudyOptions
from studies.rules import report
from studies.rules.loops import curves_of, loop_rows, rigid_crossing
from studies.rules.rows import DesignRow, RulesResult

Rules = Annotated[
    tuple[str, ...],
    tyro.conf.arg(
        help="Rules to design by: flat-phase (iso-damping), five (Monje and Vinagre's "
        "specifications), lead (for payloads), valerio-s, valerio-critical (Valerio and Sa da "
        "Costa's)."
    ),
]


@dataclass(frozen=True)
class RulesConfig(StudyOptions):
    """Fractional designs by rule on a plant: gains, margins, bode figures, steps."""

    QUICK: ClassVar = {"rule": 1}

    out: Out = Path("runs/rules")
    quick: bool = False
    """The first rule only."""
    rule: Rules = tuple(RULES)
    plant: str = "assumed-modes:5"
    """Plant that loops are closed around, and whose inertias designs are for: rigid,
    assumed-modes[:n], printed[:n], chain[:N], closed-chain[:N], untuned[:N], rule-of-thumb[:N],
    exudyn[:N]."""
    trajectory: str | None = None
    """Pose: the middle of line, two-loop or circle; circle unless given."""
    theta2: float | None = None
    """Pose instead of the trajectory's, unless given [rad]."""
    knobs: tuple[float, ...] = ()
    """Knobs of the one rule that is named, of joint 1 and then of joint 2, as its table has them;
    the middle of their ranges unless given [SI]."""
    v_gain: float = 0.0
    """Factor of the tip's angle in the second error: 0 ignores v, -1 is the paper's."""
    setting: str = "none"
    """Setting whose motors and small-signal friction apply: none, simulink, jump, opposing or
    reconstructed."""


def _check(config: RulesConfig) -> None:
    """Raise a ParameterError for an option that cannot be used."""
    if not config.rule or len(set(config.rule)) != len(config.rule):
        raise ParameterError(f"rules are {' '.join(config.rule) or 'empty'}; name each once")
    for name in config.rule:
        if name not in RULES:
            raise ParameterError(f"rule {name!r} is unknown; choose one of {', '.join(RULES)}")
    if config.knobs and len(config.rule) != 1:
        raise ParameterError("--knobs are of one rule; name it with --rule")
    if config.theta2 is not None and config.trajectory:
        raise ParameterError("--theta2 and --trajectory contradict each other; give one of them")


def middle(knobs: Sequence[Knob]) -> list[float]:
    """Return the middle of the ranges of knobs, by their logarithm where they are searched so."""
    return [
        math.sqrt(each.low * each.high) if each.log else (each.low + each.high) / 2
        for each in knobs
    ]


def dead_time(config: RulesConfig) -> float:
    """Return half a sample of the hold, the hardware's delay and its motors' lags [s]."""
    hardware = config.built
    return PERIOD * (0.5 + hardware.delay) + hardware.lag + hardware.effects.amplifier


def inertias_of(plant: Plant, theta2: float) -> tuple[float, float]:
    """Return the inertia of either joint, the other held and the beam straight [kg m2].

    Raises:
        ParameterError: a joint of the arm stands still.
    """
    linear = linearise(plant, theta2)
    first, second = (float(linear.M[j, j] / linear.S[j, j]) for j in (0, 1))
    if max(first, second) >= LOCKED:
        raise ParameterError("a joint of this arm stands still; the rules are for two that turn")
    return first, second


def pose_of(config: RulesConfig, plant: Plant) -> float:
    """Return theta2 of the pose [rad]."""
    if config.theta2 is not None:
        return config.theta2
    path = reference(trajectory(config.trajectory or "circle"), plant.parameters, PERIOD)
    return extreme_poses(path)[1]


def run(config: RulesConfig, progress: Progress | None = None) -> RulesResult:
    """Return designs, loops and curves.

    Raises:
        ParameterError: an option cannot be used. ControllerError: a rule is not for this.
    """
    config = config.asked()
    _check(config)
    chosen = setting(config.setting)
    plant = config.robot_of().plant(config.plant, chosen)
    theta2, delay = pose_of(config, plant), dead_time(config)
    inertias = inertias_of(plant, theta2)
    usual = loop_options(chosen.friction, PERIOD, "exact", None, config.built)
    options: LoopOptions = replace(usual, v_gain=config.v_gain)
    sampled = sampled_plant(plant, theta2, options)
    result = RulesResult([], [], [], [], plant.name, theta2, delay)
    for name in counted(progress, "rules", config.rule):
        _add(result, name, config.knobs, inertias, sampled)
    return result


def _add(
    result: RulesResult,
    name: str,
    given: Sequence[float],
    inertias: tuple[float, float],
    sampled: SampledPlant,
) -> None:
    """Put one rule's design and loop into a result."""
    rule = RULES[name]
    knobs = list(given) or middle(rule.knobs)
    pair = rule.design(knobs, inertias, PERIOD, result.delay)
    n = len(knobs) // 2
    for j, (built, inertia) in enumerate(zip(pair, inertias, strict=True)):
        mine = knobs[j * n : (j + 1) * n]
        numbers = rule.numbers(mine, inertia, PERIOD, result.delay)
        names = [each.name.removesuffix("_1") for each in rule.knobs[:n]]
        turned = dict(zip(names, mine, strict=True))
        crossing, margin = rigid_crossing(built, RigidJoint(inertia, result.delay), PERIOD)
        shown = (report.spelled_out(turned), report.spelled_out(numbers))
        result.designs.append(DesignRow(name, j + 1, inertia, *shown, crossing, margin))
        about = {"rule": name, "joint": j + 1, "knobs": turned, "design": numbers}
        result.numbers.append(about)
    loop = LinearLoop(sampled, stack([pair], PERIOD))
    curves = curves_of(name, loop)
    result.curves.append(curves)
    result.loops.extend(loop_rows(name, loop, curves.steps, np.asarray(curves.time)))


command = Study(
    run,
    report.tables,
    report.verdict,
    report.figures,
    report.facts,
    question="What do fractional designs by rule come to on a flexible arm?",
)
