"""Why was the paper's laboratory worse than its simulation? `flexsim laboratory`.

>>> result = run(LaboratoryConfig(quick=True))
>>> result.scores[0].hypothesis, result.scores[0].probability

Table 3's envelopes are 3.3, 1.5, 3.0 and 1.3 times as wide in the laboratory. Suspects, those that
the paper names and those of any bench, are added to our bench: each alone, over its size; all
together, which gives Sobol' indices; and as hypotheses, of which each has a likelihood of the four
factors. Controllers are our own: those that mirror v, as the paper's do, and PIDs that ignore it.
Beside the runs, the exact linear loop says from which size on it grows. A run that was interrupted
goes on when the same command is given again.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import ClassVar

from rich.progress import Progress

from flexsim.arm.chain_design import SEGMENTS
from flexsim.errors import ParameterError
from flexsim.loop.settings import DEFAULT_SETTING, setting
from studies.core.carry_out import Study
from studies.core.evidence.kept import Kept, forget, going_on
from studies.core.study_options import LoopOptions, Out, Perturbations, SettingName, check_each_once
from studies.laboratory.causes import cause_rows
from studies.laboratory.grounds import (
    Numbers,
    alone_rows,
    base_rows,
    check_rows,
    ground_of,
    hypotheses_of,
    index_rows,
    reach_rows,
    run_again,
)
from studies.laboratory.linear import growth_rows
from studies.laboratory.loops import KINDS
from studies.laboratory.place import Place
from studies.laboratory.rows import LaboratoryResult, SuspectRow
from studies.laboratory.scored import leading, likeliest, scores, shown_size
from studies.laboratory.showing import report
from studies.laboratory.suspects import SUSPECTS, Suspect

SIMULATED = MODES_PLANT, CHAIN = ("assumed-modes", "closed-chain")
DECIDES = (  # sources that what comes of a run depends on
    "flexsim/**/*.py",
    "controllers/**/*.py",
    *(f"studies/core/{name}.py" for name in ("paper", "evidence/repeats", "evidence/intervals")),
    *(f"studies/laboratory/{name}.py" for name in ("loops", "place")),
)
NARROW = 0.5  # of the decades: the other width that priors are tried with


@dataclass(frozen=True)
class LaboratoryConfig(LoopOptions):
    """Add what a laboratory has to our bench, and ask what explains the paper's four factors."""

    QUICK: ClassVar = {
        **{"suspects": 2, "controllers": 1, "perturbations": 2, "sizes": 2},
        **{"draws": 4, "base": 4, "synthetic": 6},
    }

    out: Out = Path("runs/laboratory")
    quick: bool = False
    """Two suspects under our default controllers only, with two runs each."""
    hardware: str = "bench"
    """What suspects are added to: ideal, delayed (a sample of delay), bench (assumed: that delay,
    10 and 5 N m, 8192 counts a turn, 0.1 mm of noise on v)."""
    setting: SettingName = DEFAULT_SETTING
    plants: tuple[str, ...] = SIMULATED
    """assumed-modes, closed-chain, or both."""
    controllers: tuple[str, ...] = tuple(KINDS)
    """default, which mirror v, or collocated, PIDs that ignore it; or both."""
    suspects: tuple[str, ...] = tuple(SUSPECTS)
    """What may be other than in the simulation; see the study's README."""
    perturbations: Perturbations = 10
    sizes: int = 7
    """Sizes of each suspect alone."""
    decades: float = 2.0
    """Decades [-] over which sizes reach down from the largest; priors are as wide, and half."""
    draws: int = 96
    """Draws of the sizes of several suspects together."""
    base: int = 128
    """Draws of all sizes behind Sobol' indices, each run twice, a power of 2; 0 for none."""
    synthetic: int = 40
    """Data sets that each hypothesis makes, to be scored in turn; 0 for none."""

    @property
    def place(self) -> Place:
        """Where nothing is suspect."""
        robot = self.robot_of()
        its = setting(self.setting, self.built)
        return Place(robot.parameters, robot.modal_damping, its, MODES_PLANT, self.modes)

    def at(self, plant: str) -> Place:
        """Return that of a plant."""
        size = self.modes if plant == MODES_PLANT else self.segments or SEGMENTS
        return replace(self.place, plant=plant, size=size)

    def numbers(self, progress: Progress | None, kept: Kept | None) -> Numbers:
        """Return how much is run, shown on a bar."""

        def bar(label: str, total: int) -> Callable[[int], None]:
            if progress is None:
                return lambda _: None
            task = progress.add_task(label, total=total)
            return lambda count: progress.advance(task, count)

        return Numbers(
            self.perturbations,
            self.sizes,
            self.decades,
            self.draws,
            self.base,
            self.seed,
            self.threads,
            bar,
            kept,
        )

    def widths(self, plant: str) -> tuple[float, ...]:
        """Return the decades that priors have on a plant: half of them are tried on the first."""
        return (self.decades, NARROW * self.decades)[: 2 if plant == self.plants[0] else 1]

    @property
    def chosen(self) -> list[Suspect]:
        """The suspects asked for."""
        return [SUSPECTS[name] for name in self.suspects]


def _check(config: LaboratoryConfig) -> None:
    """Refuse what the study cannot be run with.

    Raises:
        ParameterError: an unknown name, a number out of range, a robot's file.
    """
    if config.robot_of().given is not None:
        raise ParameterError(
            "--mjcf has no effect here: suspects change the numbers of --robot; give those"
        )
    for what, given, known in (
        ("plant", config.plants, SIMULATED),
        ("controllers", config.controllers, tuple(KINDS)),
        ("suspect", config.suspects, tuple(SUSPECTS)),
    ):
        check_each_once(what, given)
        for name in given:
            if name not in known:
                raise ParameterError(f"{what} {name!r} is unknown; choose from {', '.join(known)}")
    for name, least in (("sizes", 2), ("draws", 1), ("base", 0), ("synthetic", 0)):
        if getattr(config, name) < least:
            raise ParameterError(f"{name} is {getattr(config, name)}; give {least} or more")
    if config.base & (config.base - 1):
        raise ParameterError(f"base is {config.base}; give a power of 2, or 0")
    if not 0 < config.decades <= 6:
        raise ParameterError(f"decades is {config.decades:g}; give more than 0, up to 6")


def run(
    config: LaboratoryConfig, progress: Progress | None = None, kept: Kept | None = None
) -> LaboratoryResult:
    """Return what every suspect does alone and together, and how likely it makes the factors.

    Args:
        kept: what was run before, and is not run again; None to run it all.

    Raises:
        ParameterError, ModelError: an unknown name, or a number out of range.
    """
    config = config.asked()
    _check(config)
    suspects, numbers = config.chosen, config.numbers(progress, kept)
    result = LaboratoryResult([SuspectRow.of(each) for each in suspects])
    for controllers, plant in itertools.product(config.controllers, config.plants):
        ground = ground_of(numbers, suspects, config.at(plant), controllers)
        result.grounds.append(ground)
        result.base.extend(base_rows(ground))
        result.alone.extend(alone_rows(ground, config.seed))
        result.reach.extend(reach_rows(ground, config.seed))
    _add_growth(config, result)
    score_all(config, numbers, result)
    for ground in result.grounds:
        result.indices.extend(index_rows(numbers, suspects, ground))
    for ground in result.grounds:
        if ground.plant == CHAIN:
            name, size = likeliest(ground, config.decades)
            result.checks.extend(check_rows(ground, "bench", ground.place))
            place = SUSPECTS[name].at(ground.place, size)
            result.checks.extend(check_rows(ground, shown_size(name, size), place))
    return result


def _add_growth(config: LaboratoryConfig, result: LaboratoryResult) -> None:
    """Add where the exact linear loops grow, which know no plant."""
    for controllers in config.controllers:
        (ground, *_) = [each for each in result.grounds if each.controllers == controllers]
        its = (config.chosen, config.sizes, config.decades)
        result.growth.extend(growth_rows(ground.loops, ground.place, *its))


def score_all(config: LaboratoryConfig, numbers: Numbers, result: LaboratoryResult) -> None:
    """Add what hypotheses and causes are worth on every ground."""
    names = leading(result.grounds, config.decades)
    for ground in result.grounds:
        again = partial(run_again, numbers, ground)
        for decades in config.widths(ground.plant):
            hypotheses = hypotheses_of(numbers, config.chosen, ground, names, decades)
            synthetic = config.synthetic if decades == config.decades else 0
            own, pairs = scores(ground, hypotheses, decades, synthetic, config.seed, again)
            result.scores.extend(own)
            result.confusion.extend(pairs)
            whole = decades == config.decades
            result.causes.extend(cause_rows(ground, hypotheses, decades, varied=whole))


def carried_on(config: LaboratoryConfig, progress: Progress | None = None) -> LaboratoryResult:
    """Return what `run` does, going on from what was interrupted; a quick run keeps nothing.

    Raises:
        RunError: what is run cannot be kept; and what `run` raises.
    """
    _check(config.asked())
    if config.quick:
        return run(config, progress)
    with going_on(config.out, DECIDES, config.force) as kept:
        return run(config, progress, kept)


command = Study(
    carried_on,
    report.tables,
    report.verdict,
    report.figures,
    report.facts,
    lambda folder, config, result: forget(config.out),
    question="Why was the paper's laboratory worse than its simulation?",
    answer=report.answer,
)
