"""The cases of a comparison: which controllers on which trajectory, setting and hardware.

>>> [task.label for task in tasks(CompareConfig())]
['tuned line', 'tuned two-loop', 'tuned circle', 'tuned two-loop']
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

from controllers import TABLE_2, TUNED, TUNED_IDEAL, Controller
from flexsim.errors import ParameterError
from flexsim.loop.hardware import HARDWARE, IDEAL, Hardware, overridden
from flexsim.loop.settings import DEFAULT_SETTING, setting
from flexsim.loop.trajectories import TRAJECTORIES, Trajectory, trajectory
from flexsim.numerics.clocks import PERIOD
from studies.core.paper import CASES, FIGURE_OF, PLANTS
from studies.core.study_options import LoopOptions, Out

OURS, OF_IDEAL, TABLE, TRUE_TIP = "ours", "ideal", "table2", "true tip"  # groups of cases
SETS = (OURS, OF_IDEAL, TABLE)
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
    controllers: tuple[str, ...] = (OURS,)
    """ours, which hold on a bench; ideal, tuned in the paper's ideal loop; table2, the paper's
    own, in the setting reconstructed."""
    hardware: str = OWN
    """ideal, delayed (a sample of delay), bench (assumed: that delay, 10 and 5 N m, 8192 counts a
    turn, 0.1 mm of noise on v); or own: bench for our controllers, else ideal."""
    plants: tuple[str, str] = PLANTS
    """Two of rigid, assumed-modes[:n], printed[:n], chain[:N], closed-chain[:N],
    untuned[:N], rod, exudyn[:N]: the last slow, for one nominal run (--perturbations 1)."""
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

    @property
    def built(self) -> Hardware:
        """The hardware of the first set of controllers asked for."""
        return self.built_for(self.sets()[0] if self.controllers else OURS)

    @property
    def hardware_words(self) -> str:
        """The hardware in words, set by set where they differ."""
        each = {group: self.built_for(group).words() for group in self.sets()}
        if len(set(each.values())) == 1:
            return self.built.words()
        return "; ".join(f"{group}: {words}" for group, words in each.items())

    def built_for(self, group: str) -> Hardware:
        """Return the hardware in the loop of a group of cases.

        Raises:
            ParameterError: there is none of that name, or a number is out of range.
        """
        name = self.hardware
        if name == OWN:
            name = "ideal" if group in (OF_IDEAL, TABLE) else BENCH
        return overridden(seed=self.seed, **self.hardware_numbers | {"hardware": name})

    def sets(self) -> tuple[str, ...]:
        """Return the sets of controllers asked for.

        Raises:
            ParameterError: one of them is none.
        """
        for each in self.controllers:
            if each not in SETS:
                raise ParameterError(
                    f"controllers {each!r} are unknown; choose of {', '.join(SETS)}"
                )
        return self.controllers


@dataclass(frozen=True)
class Task:
    """One case to run: which controllers on which trajectory, setting and hardware."""

    trajectory: Trajectory
    label: str
    controller: Controller
    setting: str
    name: str
    group: str = OURS
    reference: str = MIRRORED
    hardware: Hardware = IDEAL


def hardware_name(hardware: Hardware) -> str:
    """Return the name of hardware whose every number is as named, else its numbers in words."""
    for name, named in HARDWARE.items():
        if replace(hardware, seed=named.seed) == named:
            return name
    return hardware.words()


def tasks(config: CompareConfig) -> list[Task]:
    """Return the cases: of the sets of controllers asked for, then those for the true tip.

    Raises:
        ParameterError: a set of controllers is unknown.
    """
    found = [
        _task(config, group, shape, devised) for group in config.sets() for shape, devised in CASES
    ]
    return found + (true_tip_tasks(config) if config.true_tip else [])


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
