"""Both arms in one loop that waits for nobody: no window, no clock, only whole control periods.

    >>> live = Live(Stage(...))
    >>> live.advance(16)                      # [control periods]
    >>> live.turn("gain", 1.2)
    >>> live.shove((0.0, 1.0))                # [N], until live.shove((0.0, 0.0))

Untouched, both move as `flexsim.loop.runs.closed_loop` has them, to the bit, however the periods
are parted. What is done to them is kept in `done`, and doing it again gives the same motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from flexsim.loop.control.compiled import Controllers
from flexsim.loop.control.stacking import stack
from flexsim.loop.friction import LAWS, Friction
from flexsim.loop.hardware import Hardware
from flexsim.loop.runs import loop_of
from flexsim.loop.settings import Setting, held_slopes
from flexsim.loop.trajectories import Reference
from flexsim.numerics.types import Array
from flexsim.plants.chain_plant import ChainPlant
from flexsim.plants.modes_plant import AssumedModesPlant
from flexsim.plants.rod_plant import RodPlant
from studies.play.arm import Arm
from studies.play.bodies import ModesBody, MujocoBody, require_stable
from studies.play.events import Event, Shove, Turn
from studies.play.knobs import Knobs, friction_at, retuned
from studies.play.periods import AGAIN, BACK, HOLD, row_of
from studies.play.pushes import Point, body_of, tip_point
from studies.play.reserves import Question, with_load
from studies.tuning.found import AnyController, period_of, v_gain_of

TIPS_KEPT = 200  # parts of a frame
CLOSED = 1e-9  # [m] between a path's ends, if it is closed
POSE = 0.1  # [rad] to which theta2 is rounded for margins: they change little over it


@dataclass(frozen=True, eq=False)
class Stage:
    """What is played: both plants of one robot, and the loop about them.

    Attributes:
        modes, mujoco: the plants. setting: friction and hardware. controller: at its own gains.
        reference: sampled at the controller's period. repeat: whether it comes again and again,
            from the start if its path is closed, else back the way it came; or it is held.
        uniform: whether the robot is a uniform beam, of which there is an exact linear loop.
    """

    modes: AssumedModesPlant
    mujoco: ChainPlant | RodPlant
    setting: Setting
    controller: AnyController
    reference: Reference
    repeat: bool = False
    uniform: bool = True

    @property
    def again(self) -> int:
        """What comes after the reference's end; see `row_of`."""
        ends = self.reference.tip[-1] - self.reference.tip[0]
        closed = float(np.abs(ends).max()) <= CLOSED
        return (AGAIN if closed else BACK) if self.repeat else HOLD

    @property
    def knobs(self) -> Knobs:
        """Where they stand at first."""
        law = LAWS.index(self.setting.friction.law)
        return Knobs(delay=float(self.setting.hardware.delay), law=float(law))


@dataclass(frozen=True, eq=False)
class _Made:
    """What knobs make of what does not move."""

    controllers: Controllers
    friction: Friction
    hardware: Hardware


class Live:
    """Both arms, the controller, and what may be done to them.

    Attributes:
        stage: what is played. period: the next to be run. knobs: where they stand.
        arms: of the assumed modes, and of MuJoCo. done: events so far. script: events to come.
        shoved: the push that is on, or None. tally: errors so far. tips: of both arms in the last
            periods, since they were taken [m].
    """

    def __init__(self, stage: Stage, script: Sequence[Event] = ()) -> None:
        """Put both arms at rest on the reference.

        Raises:
            ParameterError, ControllerError: the loop cannot be built.
        """
        self.stage, self.knobs = stage, stage.knobs
        self._own = tuple(script)
        body = MujocoBody(stage.mujoco)
        self._tip = tip_point(stage.mujoco.model)
        self._made = self._make(self.knobs)
        bodies = ModesBody(stage.modes, stage.mujoco.model), body
        self.arms = (self._arm(bodies[0]), self._arm(bodies[1]))
        for event in script:
            if isinstance(event, Shove) and event.point is not None:
                body_of(stage.mujoco.model, event.point)
            elif isinstance(event, Turn):
                self.knobs.turned(event.knob, event.value)
        self._begin()

    def _arm(self, body: ModesBody | MujocoBody) -> Arm:
        stage, made = self.stage, self._made
        loop = loop_of(body.plant, stage.reference, v_gain=v_gain_of(stage.controller))
        start = body.plant.rest_state(stage.reference.joint[0])
        return Arm(body, loop, made.friction, made.hardware, made.controllers, start, stage.again)

    def _begin(self) -> None:
        self.period = 0
        self.done: list[Event] = []
        self.script = list(self._own)
        self.shoved: Shove | None = None
        self.tally = Tally()
        self.tips: list[tuple[int, Array, Array]] = []

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.period * self.length

    @property
    def length(self) -> float:
        """The control period [s]."""
        return period_of(self.stage.controller)

    @property
    def row(self) -> int:
        """Which of the reference's samples holds now."""
        return row_of(self.period, len(self.stage.reference.time), self.stage.again)

    def restart(self) -> None:
        """Put both arms back at rest on the reference, at knobs as they stand."""
        self._begin()
        for arm in self.arms:
            arm.restart(self._made.controllers)
        for item in fields(Knobs):
            value = getattr(self.knobs, item.name)
            if value != getattr(self.stage.knobs, item.name):
                self.done.append(Turn(0, item.name, value))

    def warm_up(self) -> None:
        """Have everything compiled that a run needs, a push included; nothing has happened then."""
        script, self.script = self.script, []
        self.shove((1e-9, 0.0))
        self._run(1)
        self.shove((0.0, 0.0))
        for arm in self.arms:
            arm.retuned(self._made.controllers)
        self.script = script
        self.restart()

    def advance(self, count: int) -> None:
        """Go on by whole control periods, doing on the way what the script has for them."""
        end = self.period + count
        while self.period < end:
            while self.script and self.script[0].period <= self.period:
                self._follow(self.script.pop(0))
            upto = min([end, *(event.period for event in self.script[:1])])
            self._run(upto - self.period)

    def _follow(self, event: Event) -> None:
        if isinstance(event, Turn):
            self.turn(event.knob, event.value)
        else:
            self.shove(event.force, event.torque, event.point)

    def _run(self, count: int) -> None:
        """Go on by periods between two events."""
        tips: list[Array] = []
        for arm in self.arms:
            if self.shoved is None or not arm.body.every_period:
                tips.append(arm.run(self.period, count).tip)
                continue
            each = []
            for k in range(self.period, self.period + count):
                arm.shoved(self.shoved, self._tip)
                each.append(arm.run(k, 1).tip)
            tips.append(np.concatenate(each))
        stage = self.stage
        rows = [
            row_of(k, len(stage.reference.time), stage.again)
            for k in range(self.period, self.period + count)
        ]
        self.tally.add(tips[0], tips[1], stage.reference.tip[rows])
        self.tips = [*self.tips[-TIPS_KEPT:], (self.period, tips[0], tips[1])]
        self.period += count

    def turn(self, knob: str, value: float) -> None:
        """Turn a knob, before the next period; nothing changes if it cannot be.

        Raises:
            ParameterError, ModelError, ControllerError: why it cannot.
        """
        knobs = self.knobs.turned(knob, value)
        made = self._make(knobs)
        moved = {name for name, now in vars(knobs).items() if getattr(self.knobs, name) != now}
        plants = [arm.body.prepared(knobs.payload, knobs.damping) for arm in self.arms]
        if moved & {"law", "friction", "damping", "payload"}:
            for plant in plants:
                require_stable(plant, held_slopes(made.friction, made.hardware))
        self.knobs, self._made = knobs, made
        for arm, plant in zip(self.arms, plants, strict=True):
            if moved & {"payload", "damping"}:
                arm.became(plant)
                if self.shoved is not None:
                    arm.shoved(self.shoved, self._tip)
            if moved & {"law", "friction"}:
                arm.friction = made.friction
            if "delay" in moved:
                arm.delayed(made.hardware, self.period)
            if moved & {"gain", "proportional", "differential", "order"}:
                arm.retuned(made.controllers)
        self.done.append(Turn(self.period, knob, float(value)))

    def _make(self, knobs: Knobs) -> _Made:
        """Return what knobs make; errors as `turn`."""
        stage = self.stage
        controller = retuned(stage.controller, knobs)
        controllers = stack([controller.filters(self.length)], self.length)
        friction = friction_at(stage.setting.friction, knobs)
        hardware = replace(stage.setting.hardware, delay=int(knobs.delay))
        return _Made(controllers, friction, hardware)

    def shove(
        self, force: tuple[float, float], torque: float = 0.0, point: Point | None = None
    ) -> None:
        """Push both arms at a point from the next period on, in place of any push before.

        Args:
            force: (fx, fy) [N]. torque: about z [N m]; none of both ends it.
            point: None for the tip.

        Raises:
            ParameterError: a point that is not on the arm.
        """
        if point is not None:
            body_of(self.stage.mujoco.model, point)
        shove = Shove(self.period, force, torque, point)
        self.shoved = None if shove.ends else shove
        for arm in self.arms:
            arm.shoved(shove, self._tip)
        self.done.append(shove)

    def question(self) -> Question:
        """Return what there is to ask of poles and margins, at the reference's pose now."""
        stage, made, knobs = self.stage, self._made, self.knobs
        theta2 = float(stage.reference.joint[self.row, 1])
        robot: object = self.arms[1].body.plant
        if stage.uniform:
            robot = with_load(stage.modes.parameters, knobs.payload, knobs.damping)
        return Question(
            robot,  # type: ignore[arg-type]
            round(theta2 / POSE) * POSE,
            made.controllers,
            made.friction,
            made.hardware,
            v_gain_of(stage.controller),
            self.length,
        )


class Tally:
    """Tip errors so far, of both arms and between them, while they run.

    Attributes:
        count, squares, most: (3,) samples, sums of squares [m2] and largest [m] of the errors of
            assumed modes and MuJoCo's arm, and of their difference. last: (3,) the latest [m].
    """

    def __init__(self) -> None:
        """Begin with nothing."""
        self.count = np.zeros(3, dtype=int)
        self.squares, self.most, self.last = np.zeros(3), np.zeros(3), np.full(3, np.nan)

    def add(self, first: Array, second: Array, ref: Array) -> None:
        """Count tips (K, 2) of both, nan where there is none, and where they should be [m]."""
        for i, off in enumerate((first - ref, second - ref, first - second)):
            size = np.hypot(off[:, 0], off[:, 1])
            self.last[i] = size[-1] if len(size) else np.nan
            there = size[np.isfinite(size)]
            self.count[i] += len(there)
            sums = np.cumsum([self.squares[i], *there**2])  # one by one: however time is parted
            self.squares[i] = sums[-1]
            self.most[i] = max(self.most[i], float(there.max(initial=0.0)))

    @property
    def rms(self) -> Array:
        """Root mean squares (3,) [m], nan where there is nothing."""
        with np.errstate(invalid="ignore"):
            return np.asarray(np.sqrt(self.squares / self.count))
