"""Do the paper's controllers behave the same on both models of the robot? The main study.

    >>> result = run(CompareConfig())
    >>> result.rows[0]["envelope"]   # [m]

Three trajectories and Figure 6's transfer, on both plants, by our controllers, which hold on a
bench, under the friction `simulink`, (47) in Simulink's blocks; if asked, by those tuned in the
paper's ideal loop, and by Table 2 under the setting `reconstructed`, a fit. Where joints stick and
slip, a change of a gain's fourth digit alters a run, so all figures are medians over small seeded
perturbations of the gains, and the plants are compared by these only.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import mujoco
import numpy as np
from rich.progress import Progress

from controllers import Filter
from flexsim.loop.settings import Setting, setting
from flexsim.loop.trajectories import reference
from flexsim.numerics.clocks import whole_substeps
from flexsim.plants.base import Plant
from flexsim.plants.chain_plant import in_closed_form
from flexsim.recording.case import Case
from flexsim.recording.traces import CHAIN
from flexsim.robot import Robot
from flexsim.shaping.feedforward import dead_zone_error
from flexsim.shaping.true_tip import shaped_reference
from studies.compare import report
from studies.compare.holding import holding_rows
from studies.compare.repeats import Repeated, Stage, repeated
from studies.compare.rows import (
    NO_OTHER,
    Against,
    CompareRow,
    Comparison,
    TipDifference,
    mjcf_texts,
)
from studies.compare.tasks import (
    DITHERED,
    MIRRORED,
    OF_IDEAL,
    TABLE,
    TRUE_TIP,
    CompareConfig,
    Task,
    hardware_name,
    settings_of,
    tasks,
)
from studies.core.carry_out import Study, ticker
from studies.core.evidence.check_sample import NO_CHECK
from studies.core.evidence.intervals import difference_interval, known_ends, ratio_interval
from studies.core.evidence.repeats import counts, perturbed, summary
from studies.core.paper import case_envelopes
from studies.tuning.found import v_gain_of

HELD_AGAIN = 159  # repeats at most of a loop with a long hold, beside the run of its own gains
Filters = tuple[Filter, Filter]


def plants_of(config: CompareConfig, setting_name: str) -> tuple[Plant, Plant]:
    """Return both plants with a setting's motors."""
    robot, motors, c = config.robot_of(), setting(setting_name), config
    one, other = (
        robot.plant(name, motors, c.modes, c.segments, c.step, c.chain_step) for name in c.plants
    )
    return one, other


def stage_of(task: Task, plant: Plant, config: CompareConfig) -> Stage:
    """Return where a task runs on one plant: its closed form, its reference."""
    ref = reference(task.trajectory, plant.parameters, config.period)
    chosen = setting(task.setting, task.hardware)
    if task.reference != MIRRORED:
        ref = shaped_reference(
            ref,
            plant,
            filters=task.controller.filters(config.period),
            friction=chosen.friction,
            dither=task.reference == DITHERED,
        )
    return Stage(plant, in_closed_form(plant)[0], ref, chosen, v_gain_of(task.controller))


def run_task(
    task: Task, plants: Sequence[Plant], config: CompareConfig
) -> tuple[list[CompareRow], list[Repeated]]:
    """Return the rows of one case, one for each plant, and what they come from."""
    nominal = task.controller.filters(config.period)
    rng = np.random.default_rng(config.seed)
    most = max(counts(config.perturbations))
    filters = [c.filters(config.period) for c in perturbed(task.controller, most, rng)]
    stages = [stage_of(task, plant, config) for plant in plants]
    found, distances = repeated(
        stages, nominal, filters, task.trajectory.hold, config.perturbations, config.threads
    )
    tips = TipDifference(*_with_ends(summary("t", distances), "t"))
    rows = [row_of(task, each, config) for each in found]
    first = found[0]
    return [
        replace(row, tips=tips, against=against(first, each, config.seed))
        for row, each in zip(rows, found, strict=True)
    ], found


def held_again(task: Task, config: CompareConfig) -> list[Filters]:
    """Return the repeats of a case that are run with a long hold, too."""
    rng = np.random.default_rng(config.seed)
    again = perturbed(task.controller, min(HELD_AGAIN, max(counts(config.perturbations))), rng)
    return [each.filters(config.period) for each in again]


def _with_ends(found: Mapping[str, float | None], name: str) -> tuple[float | None, ...]:
    return found[name], found[f"{name}_low"], found[f"{name}_high"]


def row_of(task: Task, each: Repeated, config: CompareConfig) -> CompareRow:
    """Return the row of a case on one plant, without what compares it to another."""
    plant, friction = each.stage.plant, each.stage.setting.friction
    hidden = dead_zone_error(task.controller.filters(config.period), friction)[1]
    paper = case_envelopes(task.trajectory.name, task.devised)
    simulation, laboratory = paper or (None, None)
    return CompareRow(
        controllers=task.label,
        trajectory=task.trajectory.name,
        plant=plant.name,
        setting=task.setting,
        group=task.group,
        reference=task.reference,
        found=each.found,
        paper_simulation=simulation,
        paper_laboratory=laboratory,
        dead_zone_error=float(hidden * plant.parameters.reach),
        hardware=hardware_name(task.hardware),
        zeta=plant.parameters.zeta,
        simulated=each.stage.simulated.name,
        shown=each.shown,
        check=each.check or NO_CHECK,
    )


def against(first: Repeated, other: Repeated, seed: int) -> Against:
    """Return a plant's envelope against the first plant's; nothing against itself."""
    one, mine = first.found.envelope, other.found.envelope
    if other is first or one is None or mine is None:
        return NO_OTHER
    ratio: tuple[float, float] | None = None
    difference: tuple[float, float] | None = None
    if first.stage.repeats and other.stage.repeats:
        ratio = ratio_interval(other.envelopes, first.envelopes, seed)
        difference = difference_interval(other.envelopes, first.envelopes, seed)
    return Against(mine / one, *known_ends(ratio), mine - one, *known_ends(difference))


def run(config: CompareConfig, progress: Progress | None = None) -> Comparison:
    """Return every case on both plants.

    Raises:
        ParameterError: fewer than one perturbation, a negative seed, a plant named twice, a
            control period that is no whole multiple of a physics step, or a path out of reach.
    """
    config = config.asked()
    robot = config.robot_of()
    todo = tasks(config)
    advance = ticker(progress, "compare", len(todo))
    plants = {name: plants_of(config, name) for name in settings_of(todo)}
    for plant in plants[todo[0].setting]:  # before references take memory
        whole_substeps(config.period, plant.step)
    for path in dict.fromkeys(task.trajectory for task in todo):  # before anything runs
        reference(path, robot.parameters, config.period)
    given = [each.found.facts for each in config.given.values()]
    result = Comparison([], [], robot, mjcf_texts(plants, robot), given=given)
    for task in todo:
        rows, found = run_task(task, plants[task.setting], config)
        result.rows.extend(rows)
        result.cases.append(case_of(task, found, robot, config))
        if config.holding and task.group not in (OF_IDEAL, TABLE, TRUE_TIP):
            chosen = setting(task.setting, task.hardware)
            mine = (task.trajectory, task.holder, task.controller, config.period, robot)
            result.holding.extend(holding_rows(found, chosen, *mine, held_again(task, config)))
        advance()
    return result


def case_of(task: Task, found: Sequence[Repeated], robot: Robot, config: CompareConfig) -> Case:
    """Return a task's shown runs and bands as figures and recordings have them."""
    label = task.label
    if task.group == TRUE_TIP:
        label += f" (reference: {task.reference})"
    by_name = {each.stage.plant.name: each for each in found}
    return Case(
        task.name,
        task.trajectory.name,
        label,
        task.setting,
        {name: each.motion for name, each in by_name.items()},
        drawn_model([each.stage.plant for each in found]),
        reference(task.trajectory, robot.parameters, config.period),
        task.hardware.words(),
        bands={name: each.band for name, each in by_name.items() if each.band is not None},
        shown={name: each.shown_words for name, each in by_name.items()},
        friction=setting(task.setting).friction,
        merit={name: report.merit(each.found) for name, each in by_name.items()},
        pairs=found[-1].pairs,
        torque_limit=torque_limit(found[0].stage.setting),
    )


def torque_limit(chosen: Setting) -> tuple[float, float]:
    """Return the limits of both motors [N m], the lesser of hardware's and friction's; or inf."""
    one, other = zip(chosen.hardware.torque_limit, chosen.friction.torque_limit, strict=True)
    return min(one), min(other)


def drawn_model(plants: Sequence[Plant]) -> mujoco.MjModel | None:
    """Return the compiled model of the plant 'chain', if it is there."""
    return next((plant.model for plant in plants if plant.name == CHAIN), None)


command = Study(
    run,
    report.tables,
    report.verdict,
    report.figures,
    report.facts,
    report.files,
    question="Do the same controllers behave the same on both models, and which loops hold?",
    answer=report.answer,
)
