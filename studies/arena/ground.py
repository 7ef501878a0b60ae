"""Where contestants are tuned: three trajectories at once, at an effort that all are allowed.

>>> ground = Ground.of(Robot(), ("assumed-modes:5",), setting("simulink", HARDWARE["bench"]))
>>> ground.scores(CLASSES["pid"], knobs).indices        # (K,) for knobs (K, p)

The objective is the index (5) summed over the trajectories, times 1 + 10 x the largest share by
which a torque's total variation or rms exceeds what is allowed; on several plants, of the worst.
Allowed is EFFORT times what PIDs that ignore v, `controllers.COLLOCATED`, take on the same ground.

Before anything is simulated, the exact linear loop (`flexsim.linear.exact_loop`: twelve modes, the
hardware's delay, three poses, without friction and with its slopes) may not grow: within five
seconds and behind a dead zone a loop that does may look better than any that does not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from controllers import COLLOCATED
from controllers.model_based.model import shortened
from flexsim.linear.exact_loop import NO_FRICTION, exact_growth, exact_loops
from flexsim.linear.growth import extreme_poses, quantised
from flexsim.linear.loop_poles import small_signal
from flexsim.loop.control.compiled import Controllers
from flexsim.loop.control.stacking import stack
from flexsim.loop.measuring import ROWS, TORQUE, VARIATION, Yardstick, yardstick
from flexsim.loop.populations import Stage, run_each
from flexsim.loop.runs import loop_of
from flexsim.loop.settings import Setting
from flexsim.loop.trajectories import TRAJECTORIES, Reference, Trajectory, reference
from flexsim.numerics.clocks import PERIOD
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant
from flexsim.robot import Robot
from flexsim.shaping.aids import PLAIN, aided
from studies.arena.contestants import CLASSES, Contestant, Designer
from studies.tuning.genetic import Scores

LEAD = 0.2  # [s] of rest before each trajectory: references that know the path begin early
EFFORT = 2.0  # of what PIDs that ignore v take
STEEP = 10.0  # what a share beyond that adds, relative
AID_MODEL = "assumed-modes:5"
DIGITS = 9  # of knobs


class Tried(NamedTuple):
    """What came of individuals (K,): the objective [m2 s], total index (5), effort, divergence.

    effort (K,): the largest of variation and rms over what PIDs that ignore v take [-].
    diverged (K,): earliest time, nan where none [s]; 0 of what was not simulated.
    growth (K,): of the exact linear loops [1/s], 0 where none grows; inf without a controller.
    """

    objective: Array
    total: Array
    effort: Array
    diverged: Array
    growth: Array


def paths(lead: float = LEAD, **changes: Any) -> dict[str, Trajectory]:
    """Return the paper's three trajectories with a rest before them."""
    return {name: replace(each, lead=lead, **changes) for name, each in TRAJECTORIES.items()}


@dataclass(frozen=True, eq=False)
class Ground:
    """Plants, references and what a designer knows.

    Attributes:
        plants: the worst of which counts. setting: of all, hardware included.
        trajectories: by name. designer: what is known. model: what references' helps know.
        allowed: (T, 4) of each trajectory: variation, then rms of both torques [N m].
        middle: theta2 of the pose that designers know [rad].
        aid: of references, unless a class has its own. threads: None for all.
        exact: whether what grows on the exact linear loop is rejected.
    """

    plants: tuple[Plant, ...]
    setting: Setting
    trajectories: dict[str, Trajectory]
    designer: Designer
    model: Plant
    allowed: Array
    middle: float
    aid: str = PLAIN
    threads: int | None = None
    exact: bool = True

    @classmethod
    def of(
        cls,
        robot: Robot,
        plants: Sequence[str],
        setting: Setting,
        trajectories: dict[str, Trajectory] | None = None,
        aid: str = PLAIN,
        threads: int | None = None,
        exact: bool = True,
    ) -> Ground:
        """Return a ground, the allowed effort measured on its first plant.

        Raises:
            ParameterError, ModelError: a plant or trajectory that cannot be used.
        """
        found = paths() if trajectories is None else trajectories
        built = tuple(robot.plant(name, setting) for name in plants)
        middle = extreme_poses(reference(found["circle"], robot.parameters, PERIOD))[1]
        designer = Designer.of(robot, setting, middle, PERIOD)
        model = robot.plant(AID_MODEL, setting)
        bare = cls(
            built, setting, found, designer, model, np.zeros((0, 4)), middle, aid, threads, exact
        )
        usual = stack([COLLOCATED.filters(PERIOD)], PERIOD)
        effort = bare._run(built[0], CLASSES["collocated"], usual)[1]
        return replace(bare, allowed=effort[:, 0])

    def references(self, contestant: Contestant) -> list[tuple[Reference, Yardstick]]:
        """Return a class's references with what runs on them are measured against."""
        aid = self.aid if contestant.aid == PLAIN else contestant.aid
        return _references(self, aid, contestant.v_gain)

    def _run(
        self, plant: Plant, contestant: Contestant, controllers: Controllers
    ) -> tuple[Array, Array, Array]:
        """Return indices (T, K), efforts (T, K, 4) and times of divergence (T, K) on a plant."""
        friction = self.setting.friction.numbers()
        stages = [
            Stage(
                plant,
                friction,
                loop_of(plant, ref, contestant.v_gain),
                plant.rest_state(ref.joint[0]),
                self.setting.hardware,
                yard,
            )
            for ref, yard in self.references(contestant)
        ]
        count, paths_ = len(controllers.b), len(stages)
        which = np.repeat(np.arange(paths_), count)
        every = np.tile(np.arange(count), paths_)
        found = run_each(
            stages, which, np.zeros_like(which), controllers.chosen(every), threads=self.threads
        )
        sums = found.sums
        rms = np.sqrt(sums[:, TORQUE : TORQUE + 2] / np.maximum(sums[:, ROWS, None], 1.0))
        effort = np.hstack([sums[:, VARIATION : VARIATION + 2], rms])
        shape = (paths_, count)
        return (
            found.indices.reshape(shape),
            effort.reshape(*shape, 4),
            found.diverged.reshape(shape),
        )

    def tried(self, contestant: Contestant, knobs: Array) -> Tried:
        """Return what comes of individuals (K, p), their knobs within their ranges."""
        count = len(knobs)
        found = Tried(*(np.full(count, each) for each in (np.inf, np.inf, np.inf, 0.0, np.inf)))
        built = [contestant.built(row, self.designer) for row in within(contestant, knobs)]
        there = [i for i, each in enumerate(built) if each is not None]
        if there:
            found.growth[there] = self.growth(contestant, stack([built[i] for i in there], PERIOD))
        usable = np.flatnonzero(found.growth == 0.0)
        if not usable.size:
            return found
        stacked = stack([built[i] for i in usable], PERIOD)
        for part in found[:3]:
            part[usable] = -np.inf
        found.diverged[usable] = np.inf
        for plant in self.plants:
            indices, efforts, diverged = self._run(plant, contestant, stacked)
            index = indices.sum(axis=0)
            effort = (efforts / self.allowed[:, None]).max(axis=(0, 2))
            effort = np.where(np.isfinite(index), effort, np.inf)
            objective = index * (1.0 + STEEP * np.maximum(effort / EFFORT - 1.0, 0.0))
            for part, new in zip(found, (objective, index, effort), strict=False):
                part[usable] = np.maximum(part[usable], np.where(np.isnan(new), np.inf, new))
            early = np.where(np.isnan(diverged), np.inf, diverged).min(axis=0)
            found.diverged[usable] = np.minimum(found.diverged[usable], early)
        found.diverged[np.isinf(found.diverged)] = np.nan
        return found

    def growth(self, contestant: Contestant, controllers: Controllers) -> Array:
        """Return what of controllers' exact linear loops is above 0 (K,) [1/s], if that counts."""
        if not self.exact:
            return np.zeros(len(controllers.b))
        slopes = dict.fromkeys((NO_FRICTION, small_signal(self.setting.friction)))
        loops = exact_loops(
            self.setting.applied(self.model.parameters),
            slopes=tuple(slopes),
            hardware=self.setting.hardware,
            v_gain=contestant.v_gain,
        )
        return np.maximum(quantised(exact_growth(loops, controllers)), 0.0)

    def scores(self, contestant: Contestant, knobs: Array) -> tuple[Scores, Tried]:
        """Return the same as tuners have it.

        Those that diverge rank by when they do, and before those that grow, which rank by how fast.
        """
        found = self.tried(contestant, knobs)
        most = max(path.end_time for path in self.trajectories.values())
        lost = ~np.isfinite(found.objective)
        left = np.where(lost, most - np.nan_to_num(found.diverged), 0.0) + found.growth
        return Scores(np.where(lost, np.inf, found.objective), found.diverged, left), found


@lru_cache(maxsize=16)
def _references(ground: Ground, aid: str, v_gain: float) -> list[tuple[Reference, Yardstick]]:
    """Return the references with a help: once for all generations of a search."""
    found = []
    for path in ground.trajectories.values():
        plain = reference(path, ground.model.parameters, PERIOD)
        helped = aided(plain, ground.model, aid, v_gain)
        found.append((helped, yardstick(helped, path.hold)))
    return found


def within(contestant: Contestant, knobs: Array) -> Array:
    """Return knobs (K, p) to DIGITS digits, those beyond their ranges at the ends.

    Powers and exponentials differ in their last digits from processor to processor.
    """
    low = np.array([each.low for each in contestant.knobs])
    high = np.array([each.high for each in contestant.knobs])
    return np.clip(shortened(knobs, DIGITS), low, high)


def still(ground: Ground) -> Array:
    """Return the index (5) of an arm that stands where each reference starts (T,) [m2 s]."""
    found = []
    for ref, _ in ground.references(CLASSES["collocated"]):
        off = ref.tip - ref.tip[0]
        squares = off[:, 0] ** 2 + off[:, 1] ** 2
        found.append(float(np.trapezoid(squares, ref.time)))
    return np.array(found)
