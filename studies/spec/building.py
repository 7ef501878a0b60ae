"""From places in a resolved study to what runs: robots, plants, references, controllers.

>>> workshop = Workshop(resolved)
>>> workshop.stage(workshop.matrix.run(17))

Whatever several runs share is built once and kept while it is needed: a draw changes only what
its numbers stand in.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterator
from contextlib import contextmanager
from dataclasses import fields, replace
from typing import Any, NamedTuple, TypeVar

import numpy as np

from flexsim.arm.arms import Arm, FirstLink
from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.linear.pushed import pushed
from flexsim.loop.control.compiled import Controllers
from flexsim.loop.friction import Friction
from flexsim.loop.hardware import Hardware, JointEffects, Sensing
from flexsim.loop.measuring import Yardstick, yardstick
from flexsim.loop.populations import Stage
from flexsim.loop.runs import loop_of
from flexsim.loop.settings import Setting
from flexsim.loop.trajectories import TURN, Path, Reference, Trajectory, Turn, reference
from flexsim.loop.waypoints import Waypoints
from flexsim.mjcf.arm_file import require_stable_step
from flexsim.mjcf.edits import stepped
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant
from flexsim.plants.chain_plant import ChainPlant
from flexsim.robot import Robot
from flexsim.shaping.aids import PLAIN, aided, pulsed
from studies.spec.designs import Design, design_of
from studies.spec.matrix import Combo, Matrix, Run
from studies.spec.parts import NUMBERS, PARTS
from studies.spec.places import Place, changed, get, places, spelled
from studies.spec.reading import decoded_part
from studies.spec.resolving import PlacedError, Resolved, at

SAMPLES_MOST = 10_000_000  # of a reference: some gigabytes
PERTURBED_MOST = 0.1
KEPT = 1024  # of each kind; a batch of more different ones builds some twice
AID_MODEL = "assumed-modes:5"  # of the first robot: what a reference's help knows
FREE = ("period", "perturbation")  # numbers outside of the lists that may be varied
USUAL = Parameters()
Made = TypeVar("Made")
Key = tuple[Hashable, ...]


class Measured(NamedTuple):
    """A reference, its yardstick and the hold at its end [s]."""

    reference: Reference
    yard: Yardstick
    hold: float


class Workshop:
    """What builds the parts of a study's runs.

    Raises:
        ParameterError: the sweep varies what is not a number of the file.
    """

    def __init__(self, resolved: Resolved) -> None:
        self.resolved = resolved
        self.matrix = Matrix.of(resolved)
        self.study = resolved.study
        self._kept: dict[str, OrderedDict[Key, Any]] = {}
        self._changes: list[tuple[Place, int]] = []  # where each of a draw's numbers goes
        self._of: dict[tuple[Hashable, ...], tuple[tuple[Place, int], ...]] = {}  # of each item
        taken: dict[Place, str] = {}
        for column, path in enumerate(self.matrix.draws.paths):
            with self._at(f"sweep.{path}"):
                found = places(resolved.document, path)
                for place in found:
                    self._require_number(place)
                    if place in taken:
                        raise ParameterError(f"{spelled(place)} is varied as {taken[place]}, too")
                    taken[place] = path
                self._changes += [(place, column) for place in found]

    def _require_number(self, place: Place) -> None:
        """Refuse to vary what is no number of the file."""
        value = get(self.resolved.document, place)
        root = place[0]
        if root not in PARTS and root not in FREE:
            raise ParameterError(
                f"only numbers in {', '.join(PARTS)}, and {' and '.join(FREE)}, may be varied"
            )
        if value is not None and (isinstance(value, bool) or not isinstance(value, int | float)):
            raise ParameterError(f"{spelled(place)} is {value!r}, no number")

    def _once(self, kind: str, key: Key, make: Callable[[], Made]) -> Made:
        """Return what was made under a key, or make it."""
        kept = self._kept.setdefault(kind, OrderedDict())
        found: Made | None = kept.get(key)
        if found is None:
            found = kept[key] = make()
            if len(kept) > KEPT:
                kept.popitem(last=False)
        elif len(kept) > KEPT // 2:
            kept.move_to_end(key)
        return found

    def _values(
        self, name: str, number: int | None, values: tuple[float, ...]
    ) -> tuple[tuple[Place, float], ...]:
        """Return what a draw sets in an item of a list, or in a number outside of them."""
        own = (name,) if number is None else (name, number)
        if own not in self._of:
            self._of[own] = tuple(e for e in self._changes if e[0][: len(own)] == own)
        return tuple([(place, values[i]) for place, i in self._of[own]])

    def _part(self, name: str, number: int, values: tuple[float, ...]) -> tuple[Key, Any]:
        """Return an item of a list with a draw's numbers, and the key that it is known by."""
        changes = self._values(name, number, values)
        key: Key = (name, number, *changes)

        def make() -> Any:
            item = self.resolved.document[name][number]
            for place, value in changes:
                old = get(item, place[2:])
                whole = isinstance(old, int) and float(value).is_integer()
                item = changed(item, place[2:], int(value) if whole else value)
            with self.within(name, number):
                return decoded_part(name, number, item)

        return key, self._once("part", key, make)

    def within(self, name: str, number: int) -> Any:
        """Have errors begin with the file and an item of its lists."""
        alone = name == "robots" and len(self.study.robots) == 1
        return self._at("robot" if alone else f"{name}[{number}]")

    @contextmanager
    def _at(self, place: str) -> Iterator[None]:
        """Have errors begin with the file and a place in it."""
        try:
            with at(place):
                yield
        except PlacedError as error:
            raise ParameterError(f"{self.resolved.source}: {error}") from None

    def period(self, values: tuple[float, ...]) -> float:
        """Return the control period [s]."""
        return float(self._free("period", values))

    def perturbation(self, values: tuple[float, ...]) -> float:
        """Return how much gains are changed, relative.

        Raises:
            ParameterError: it is below 0, or 0.1 or more.
        """
        found = float(self._free("perturbation", values))
        if not 0.0 <= found < PERTURBED_MOST:
            with self._at("perturbation"):
                raise ParameterError(f"is {found:g}; give 0 or more, less than {PERTURBED_MOST}")
        return found

    def _free(self, name: str, values: tuple[float, ...]) -> Any:
        changes = self._values(name, None, values)
        return changes[0][1] if changes else getattr(self.study, name)

    def robot(self, number: int, values: tuple[float, ...]) -> tuple[Key, Robot]:
        """Return a robot, and the key that it is known by."""
        key, part = self._part("robots", number, values)

        def make() -> Robot:
            with self.within("robots", number):
                return robot_of(part, self.resolved.inputs)

        return key, self._once("robot", key, make)

    def setting(self, combo: Combo, values: tuple[float, ...]) -> tuple[Key, Setting]:
        """Return friction, limits, motors and hardware, and the key that they are known by."""
        key, part = self._part("settings", combo.setting, values)
        other, built = self._part("hardware", combo.hardware, values)
        both = key + other

        def make() -> Setting:
            with self.within("settings", combo.setting):
                friction = Friction(**{f.name: getattr(part, f.name) for f in fields(Friction)})
            with self.within("hardware", combo.hardware):
                hardware = _hardware_of(built, self.study.seed)
            return Setting(part.name, friction, "", part.I_m1, part.I_m2, hardware)

        return both, self._once("setting", both, make)

    def friction(self, key: Key, setting: Setting) -> Any:
        """Return the compiled numbers of a setting's friction, one object for all its runs."""
        return self._once("friction", key, setting.friction.numbers)

    def plant(self, run: Run, values: tuple[float, ...], model: str | None = None) -> Plant:
        """Return the plant of a run, with its setting's motors.

        Args:
            model: of the plant, instead of its own.

        Raises:
            ParameterError: there is no such plant of the robot, or its step is too long.
        """
        key, part = self._part("plants", run.plant, values)
        of_robot, robot = self.robot(run.robot, values)
        _, chosen = self.setting(self.matrix.combos[run.combo], values)
        motors = (chosen.steepest, chosen.I_m1, chosen.I_m2)

        def make() -> Plant:
            name = model or part.model
            with self.within("plants", run.plant):
                return plant_of(robot, name, chosen, part.step, part.integrator)

        return self._once("plant", (*key, *of_robot, *motors, model), make)

    def path(self, number: int, values: tuple[float, ...]) -> tuple[Key, Path | Turn]:
        """Return a trajectory, and the key that it is known by."""
        key, part = self._part("trajectories", number, values)

        def make() -> Path | Turn:
            with self.within("trajectories", number):
                return path_of(part)

        return key, self._once("path", key, make)

    def measured(
        self, combo: Combo, parameters: Parameters, values: tuple[float, ...]
    ) -> tuple[Key, Measured]:
        """Return the reference of a robot's lengths, and the key that it is known by.

        What helps it (`flexsim.shaping.aids`) is told of the first robot, as the file has it.
        """
        of_path, path = self.path(combo.trajectory, values)
        period = self.period(values)
        part = self._part("trajectories", combo.trajectory, values)[1]
        of_setting, chosen = self.setting(combo, values)
        v_gain = self._part("controllers", combo.controller, values)[1].v_gain
        told = () if part.aid == PLAIN else (v_gain, *of_setting)
        key = (*of_path, parameters.L_R, parameters.r, parameters.L, period, *told)

        def make() -> Measured:
            with self.within("trajectories", combo.trajectory):
                if not path.end_time / period <= SAMPLES_MOST:
                    raise ParameterError(
                        f"{path.end_time:g} s have more than {SAMPLES_MOST:,} samples of "
                        f"{period:g} s; give a shorter one, or a longer period"
                    )
                ref = reference(path, parameters, period)
                if part.aid != PLAIN:
                    model = self.robot(0, self.nominal)[1].plant(AID_MODEL, chosen)
                    ref = aided(ref, model, part.aid, v_gain)
                if any(part.pulse):
                    ref = pulsed(ref, part.pulse, part.pulse_span)
                return Measured(ref, yardstick(ref, path.hold), path.hold)

        return key, self._once("measured", key, make)

    def design(self, number: int, values: tuple[float, ...]) -> tuple[Key, Design, float]:
        """Return a controller, the key that it is known by, and the loop's v_gain."""
        key, part = self._part("controllers", number, values)
        period = self.period(values)
        own = (*key, period)

        def make() -> Design:
            first = USUAL
            if part.function is not None:  # which may ask
                first = self.robot(0, self.nominal)[1].parameters
            with self.within("controllers", number):
                return design_of(part, period, first, self.resolved.inputs)

        return own, self._once("design", own, make), part.v_gain

    def controllers(self, number: int, values: tuple[float, ...], factors: Array) -> Controllers:
        """Return a controller n times for the compiled loop, gains times factors (n, 6)."""
        design = self.design(number, values)[1]
        with self.within("controllers", number):
            return design.stacked(factors)

    def swept(self, values: tuple[float, ...]) -> str:
        """Return in words what a draw sets."""
        drawn = zip(self.matrix.draws.paths, values, strict=True)
        return "".join(f"; with {path} = {value:g}" for path, value in drawn)

    @property
    def nominal(self) -> tuple[float, ...]:
        """What the file's own numbers are where a sweep varies them."""
        document = self.resolved.document
        first = {column: place for place, column in reversed(self._changes)}
        drawn = self.matrix.draws.values(0)
        own = [get(document, first[i]) for i in range(len(drawn))]
        return tuple(float(x) if x is not None else d for x, d in zip(own, drawn, strict=True))

    def stage(self, run: Run, values: tuple[float, ...], model: str | None = None) -> Stage:
        """Return where a run happens.

        Args:
            run: as named. values: what its draw sets. model: of the plant, instead of its own.

        Raises:
            ParameterError, ModelError: something cannot be built; with its place in the file.
        """
        combo = self.matrix.combos[run.combo]
        plant = self.plant(run, values, model)
        of_setting, chosen = self.setting(combo, values)
        of_path, measured = self.measured(combo, plant.parameters, values)
        v_gain = self._part("controllers", combo.controller, values)[1].v_gain
        p = plant.parameters
        loop = self._once(
            "loop",
            (*of_path, plant.step, p.L, v_gain),
            lambda: self._loop(run, plant, measured.reference, v_gain),
        )
        start = self._once(
            "start",
            (*of_path, len(plant.rest_state(np.zeros(2)))),
            lambda: plant.rest_state(measured.reference.joint[0]),
        )
        push = self._part("trajectories", combo.trajectory, values)[1].push
        if push:  # what it leaves behind depends on all that moves
            start = pushed(plant, measured.reference.joint[0], push)
        friction = self.friction(of_setting, chosen)
        return Stage(plant, friction, loop, start, chosen.hardware, measured.yard)

    def _loop(self, run: Run, plant: Plant, ref: Reference, v_gain: float) -> Any:
        with self.within("plants", run.plant):
            return loop_of(plant, ref, v_gain, self.study.weights)


def plant_of(
    robot: Robot, name: str, setting: Setting, step: float | None, integrator: str | None
) -> Plant:
    """Return a plant by its name, with a setting's motors.

    Args:
        step: physics step [s], None for the usual. integrator: of a chain, None for its own.

    Raises:
        ParameterError, ModelError: there is no such plant of the robot, or its step is too long.
    """
    if integrator is None:
        return robot.plant(name, setting, step=step, chain_step=step)
    usual = robot.plant(name, setting, chain_step=None if robot.given is None else step)
    if not isinstance(usual, ChainPlant):
        raise ParameterError(f"integrator is of chains, not of {name}; leave it out")
    chain = stepped(usual.chain, integrator, usual.step if step is None else step)
    require_stable_step(chain)
    return replace(usual, chain=chain)


def robot_of(part: Any, inputs: Any) -> Robot:
    """Return the robot of a resolved file's table.

    Raises:
        ParameterError, ModelError: as `Robot.of`.
    """
    if part.mjcf is not None:
        found = Robot.of(beam=part.beam, text=inputs[part.mjcf])
        payload = part.payload
    else:
        own = Parameters(**{name: getattr(part, name) for name in NUMBERS})
        found = Robot.of(parameters=own, modal_damping=tuple(part.modal_damping))
        if part.link1 is not None:
            found = replace(found, link1=Arm(own, FirstLink(**part.link1.model_dump())).link1)
        payload = 0.0
    if (part.stiffness, part.density, payload) == (1.0, 1.0, 0.0):
        return found
    return found.changed(part.stiffness, part.density, payload)


def _hardware_of(part: Any, seed: int) -> Hardware:
    """Return sensors, computer, motors and joints of a resolved file's table."""

    def own(kind: type) -> dict[str, Any]:
        return {f.name: getattr(part, f.name) for f in fields(kind) if hasattr(part, f.name)}

    numbers = own(Hardware) | {"seed": seed}
    return Hardware(
        **numbers, sensing=Sensing(**own(Sensing)), effects=JointEffects(**own(JointEffects))
    )


def path_of(part: Any) -> Path | Turn:
    """Return the trajectory of a resolved file's table.

    Raises:
        ParameterError: a number that cannot be used.
    """
    if part.points is not None:
        return Waypoints(
            tuple(part.points),
            part.time_law,
            part.duration,
            tuple(part.times or ()),
            part.lead,
            part.hold,
            part.name,
        )
    kind = Turn if part.shape == TURN.name else Trajectory
    own = {f.name: getattr(part, f.name) for f in fields(kind)}
    return kind(**own)
