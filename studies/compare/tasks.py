"""The cases of a comparison: which controllers on which trajectory, setting and hardware.

>>> [task.label for task in tasks(CompareConfig())]
['tuned line', 'tuned two-loop', 'tuned circle', 'tuned two-loop']
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import ClassVar

from controllers import TABLE_2, TUNED, TUNED_IDEAL
from flexsim.errors import ParameterError
from flexsim.loop.hardware import HARDWARE, IDEAL, Hardware, overridden
from flexsim.loop.settings import DEFAULT_SETTING, setting
from flexsim.loop.trajectories import TRAJECTORIES, Trajectory, trajectory
from flexsim.numerics.clocks import PERIOD
from studies.compare.given import Given, given_runs
from studies.core.paper import CASES, FIGURE_OF, PLANTS
from studies.core.study_options import Controllers, LoopOptions, Out
from studies.core.text import word
from studies.tuning.found import DEVISED, AnyController

OURS, OF_IDEAL, TABLE, TRUE_TIP = "ours", "ideal", "table2", "true tip"  # groups of cases
SETS = (OURS, OF_IDEAL, TABLE)
SET_OF = {
    each.name: group
    for group, table in zip(SETS, (TUNED, TUNED_IDEAL, TABLE_2), strict=True)
    for each in table.values()
}
BENCH = "bench"
OWN = "own"  # hardware: that which each set of controllers is for
MIRRORED, TO_TIP, DITHERED = "mirrored tip", "true tip", "true tip, dithered"  # references
FILE_OF = {MIRRORED: "plain", TO_TIP: "true_tip", DITHERED: "true_tip_dithered"}


@dataclass(frozen=True)
class CompareConfig(LoopOptions):
    """Run controllers on two plants: tables with intervals, figures and a recording."""

    QUICK: ClassVar = {"perturbations": 2, "holding": False}

    out: Out = Path("runs/compare")
    quick: bool = False
    """Two runs behind each median only: no intervals, and nothing on holding."""
    controllers: Controllers = (OURS,)
    """Sets: ours, which hold on a bench; ideal, tuned in the paper's ideal loop; table2, the
    paper's own, in the setting reconstructed. And on all three trajectories: one of a set, by its
    name as in flexsim stability, or folders of runs of flexsim tune."""
    hardware: str = OWN
    """ideal, delayed (a sample of delay), bench (assumed: that delay, 10 and 5 N m, 8192 counts a
    turn, 0.1 mm of noise on v); or own: bench for our controllers, the last of these that a run of
    flexsim tune had, else ideal."""
    plants: tuple[str, str] = PLANTS
    """Two of rigid, assumed-modes[:n], printed[:n], chain[:N], closed-chain[:N],
    untuned[:N], rule-of-thumb[:N], rod, exudyn[:N]: the last slow, for one nominal run
    (--perturbations 1)."""
    perturbations: int | None = None
    """Runs behind each median, the gains' fourth digits perturbed; unless given 20, doubled to at
    most 320 until the envelope's 95 % interval is +-0.05 mm, or 1 %."""
    setting: str = DEFAULT_SETTING
    """Friction, limits and motors of our controllers: none, simulink, jump, opposing or
    reconstructed."""
    period: float = PERIOD
    """Control period [s], the paper's; a whole multiple of the physics steps."""
    step: float | None = None
    """Physics step of assumed modes [s]; 1 ms, halved until RK4 can take it, unless given."""
    chain_step: float | None = None
    """Physics step of chains [s]; 1 ms, halved until RK4 can take it, unless given."""
    line: Trajectory = TRAJECTORIES["line"]
    """Our line; the reconstructed one is part of its fit."""
    two_loop: Trajectory = TRAJECTORIES["two-loop"]
    """Our two-loop."""
    circle: Trajectory = TRAJECTORIES["circle"]
    """Our circle."""
    holding: bool = True
    """Say which of our loops hold: a run with a hold of 20 s, growth of the exact linear loop."""
    true_tip: bool = False
    """Add runs on references shaped so that the true tip follows, not the mirrored one."""

    @property
    def shapes(self) -> dict[str, Trajectory]:
        """Our trajectories by their names."""
        return {"line": self.line, "two-loop": self.two_loop, "circle": self.circle}

    @cached_property
    def given(self) -> dict[str, Given]:
        """Runs of flexsim tune, by what they are called in `controllers`; read once.

        Raises:
            ParameterError: one is neither a set, nor a controller, nor such a run.
            RunError: a run has no controller.
        """
        runs = [name for name in self.controllers if name not in SETS and name not in SET_OF]
        return given_runs(runs, SETS)

    @property
    def built(self) -> Hardware:
        """The hardware of the first set of controllers asked for."""
        return self.built_for(self.groups()[0] if self.controllers else OURS)

    @property
    def hardware_words(self) -> str:
        """The hardware in words, set by set where they differ."""
        each = {group: self.built_for(group).words() for group in self.groups()}
        if len(set(each.values())) == 1:
            return self.built.words()
        return "; ".join(f"{group}: {words}" for group, words in each.items())

    def built_for(self, group: str) -> Hardware:
        """Return the hardware in the loop of a group of cases.

        Raises:
            ParameterError: there is none of that name, or a number is out of range.
        """
        numbers, name = self.hardware_numbers, self.hardware
        if name == OWN:
            name = "ideal" if group in (OF_IDEAL, TABLE) else BENCH
            for each in self.given.values():
                if each.group == group:
                    name, own = each.hardware
                    numbers |= {key: own[key] for key in own if numbers[key] is None}
        return overridden(seed=self.seed, **numbers | {"hardware": name})

    def groups(self) -> tuple[str, ...]:
        """Return the groups of cases asked for: sets of controllers, runs of flexsim tune."""
        return tuple(dict.fromkeys(self.group_of(name) for name in self.controllers))

    def group_of(self, name: str) -> str:
        """Return the group of what `controllers` names: a set, one of a set, or a run."""
        if name in SETS:
            return name
        return SET_OF[name] if name in SET_OF else self.given[name].group


@dataclass(frozen=True)
class Task:
    """One case to run: which controllers on which trajectory, setting and hardware."""

    trajectory: Trajectory
    label: str
    controller: AnyController
    setting: str
    name: str
    group: str = OURS
    reference: str = MIRRORED
    hardware: Hardware = IDEAL

    @property
    def devised(self) -> str:
        """The trajectory that the controllers are for, the last word of their label."""
        return self.label.rsplit(" ", 1)[1]

    @property
    def holder(self) -> str:
        """Whose loop it is, where it is said which hold: what a set has it for, or the run."""
        return self.devised if self.group in SETS else self.group


def hardware_name(hardware: Hardware) -> str:
    """Return the name of hardware whose every number is as named, else its numbers in words."""
    for name, named in HARDWARE.items():
        if replace(hardware, seed=named.seed) == named:
            return name
    return hardware.words()


def tasks(config: CompareConfig) -> list[Task]:
    """Return the cases: of the controllers asked for, each once, then those for the true tip.

    Raises:
        ParameterError: controllers are unknown, or for another control period.
        RunError: a run has no controller.
    """
    found = [each for name in config.controllers for each in _tasks_of(config, name)]
    once = {each.name: each for each in reversed(found)}  # the first of a name
    mine = [each for each in found if once[each.name] is each]
    return mine + (true_tip_tasks(config) if config.true_tip else [])


def _tasks_of(config: CompareConfig, name: str) -> list[Task]:
    """Return the cases of a set; or of one controller, on all trajectories."""
    if name in SETS:
        return [_task(config, name, shape, devised) for shape, devised in CASES]
    if name in SET_OF:
        return [_task(config, SET_OF[name], shape, DEVISED[name]) for shape in TRAJECTORIES]
    given = config.given[name]
    try:
        given.found.filters(config.period)
    except ParameterError as error:
        raise ParameterError(f"{error}, with --period {given.found.period:g}") from None
    return [
        Task(
            path,
            f"{given.group} {given.found.tuning.trajectory}",
            given.found,
            config.setting,
            f"{word(given.group)}_{shape}",
            given.group,
            hardware=config.built_for(given.group),
        )
        for shape, path in config.shapes.items()
    ]


def _task(config: CompareConfig, group: str, shape: str, devised: str) -> Task:
    """Return one trajectory by the controllers that a set has for another or the same."""
    suffix = shape if shape == devised else f"{shape}_by_{devised}"
    built = config.built_for(group)
    if group == TABLE:
        return Task(
            trajectory(shape, reconstructed=True),
            f"Table 2 {devised}",
            TABLE_2[FIGURE_OF[devised]],
            "reconstructed",
            f"table2_{suffix}",
            group,
            hardware=built,
        )
    own, words = (TUNED, "tuned") if group == OURS else (TUNED_IDEAL, "ideal")
    return Task(
        config.shapes[shape],
        f"{words} {devised}",
        own[devised],
        config.setting,
        f"{words}_{suffix}",
        group,
        hardware=built,
    )


def true_tip_tasks(config: CompareConfig) -> list[Task]:
    """Return runs on every kind of reference: without friction, then under our setting.

    A dither is for friction only.
    """
    return [
        Task(
            path,
            f"tuned {shape}",
            TUNED[shape],
            name,
            f"{FILE_OF[kind]}_{name}_{shape}",
            group=TRUE_TIP,
            reference=kind,
            hardware=config.built,
        )
        for name in dict.fromkeys(("none", config.setting))
        for shape, path in config.shapes.items()
        for kind in FILE_OF
        if kind != DITHERED or setting(name).friction.law != "none"
    ]


def settings_of(todo: Sequence[Task]) -> list[str]:
    """Return the names of the settings that cases are run in, each once."""
    return list(dict.fromkeys(task.setting for task in todo))
