"""What a model says a log should have been: torques in, signals at the log's stamps out.

>>> model = Model(Robot(), "assumed-modes", setting("none"), free_numbers("EI,zeta", ...))
>>> model.signals({"EI": 0.36}, record, start)          # (N, S)

Any plant by its name, driven open loop from rest where the log begins. Whatever the numbers, the
physics step is that of the nominal ones: what is compared differs by the numbers alone.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from flexsim.errors import DivergenceError, FlexsimError, ModelError, ParameterError
from flexsim.loop.hardware import Hardware
from flexsim.loop.hardware.bridges import bridge_numbers
from flexsim.loop.motion import Motion
from flexsim.loop.runs import drive
from flexsim.loop.settings import Setting
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant
from flexsim.robot import Robot
from flexsim.robot.plant_names import plant_kind
from studies.identify.chains import ChainFamily
from studies.identify.names import Free, robot_with, setting_with
from studies.identify.records import NEEDED, STRAINS, Record

REST, MOVING = "rest", "moving"
CLOSED, MODES, RIGID = "closed-chain", "assumed-modes", "rigid"
BEND = ("EI", "zeta", "gain.v", "offset.v")  # numbers that a rigid arm does not have


@dataclass(frozen=True, eq=False)
class Model:
    """A model of the robot whose numbers are identified.

    Attributes:
        robot, plant, setting: as every command takes them; the setting's hardware delays, limits
            and lags the torques, and says where strain bridges are. free: the numbers.
    """

    robot: Robot
    plant: str
    setting: Setting
    free: tuple[Free, ...]

    @cached_property
    def step(self) -> float:
        """The nominal plant's physics step [s]."""
        return self.robot.plant(self.plant, self.setting).step

    @cached_property
    def family(self) -> ChainFamily | None:
        """The robot's closed chains, where that is the plant and its numbers are the robot's."""
        closed = self.plant.partition(":")[0] == CLOSED and self.robot.given is None
        return ChainFamily(self.robot, self.plant, self.setting, self.step) if closed else None

    def built(self, values: Mapping[str, float]) -> tuple[Plant, Setting]:
        """Return plant and setting with these numbers in place of the nominal ones.

        Raises:
            ParameterError, ModelError: there is no such plant, or its step is too long for it.
        """
        chosen = setting_with(self.setting, values)
        if self.family is not None and self.family.covers(values):
            return self.family.plant(values), chosen
        robot = robot_with(self.robot, values)
        chain_step = None if robot.file is not None else self.step
        plant = robot.plant(self.plant, chosen, step=self.step, chain_step=chain_step)
        return plant, chosen

    def moved(
        self,
        values: Mapping[str, float],
        record: Record,
        start: Array,
        run: int | None = None,
    ) -> Motion:
        """Return the motion under a record's torques, and what sensors make of it.

        Args:
            values: numbers by their names. start: (4,) joint angles [rad] and rates [rad/s].
            run: whose noise and errors the sensors have; without one they have none.

        Raises:
            DivergenceError, ParameterError, ModelError: there is none.
        """
        plant, chosen = self.built(values)
        if run is None:
            strained = any(name in STRAINS for name in record.signals)
            chosen = replace(chosen, hardware=faultless(chosen.hardware, strained))
        state = plant.rest_state(start[:2])
        m = len(state) // 2
        state[m : m + 2] = start[2:]
        return drive(
            plant, chosen, record.torque, record.period, state=state, run=run or 0, look=False
        )

    def signals(self, values: Mapping[str, float], record: Record, start: Array) -> Array:
        """Return a record's signals (N, S) as the model has them; arguments as of `moved`.

        Raises:
            DivergenceError, ParameterError, ModelError: there is no motion.
        """
        motion = self.moved(values, record, start)
        columns = outputs(motion, record.signals, values)
        return np.column_stack([_at(record.time, motion.time, each) for each in columns])

    def tried(self, values: Mapping[str, float], record: Record, start: Array) -> Array | None:
        """Return `signals`, None where the numbers give no motion."""
        try:
            return self.signals(values, record, start)
        except (DivergenceError, ModelError, ParameterError):
            return None


def faultless(hardware: Hardware, strained: bool) -> Hardware:
    """Return hardware whose sensors have neither noise nor errors, with bridges if there are.

    What they lag, and what an estimator makes of strains, stays.
    """
    none = (0.0, 0.0)
    sensing = replace(
        hardware.sensing.quiet, bridge_gain=none, bridge_shift=none, tachometer_gain=none
    )
    if strained:
        sensing = replace(sensing, bridges="on")
    return replace(hardware, counts=0, noise_v=0.0, sensing=sensing)


def outputs(motion: Motion, signals: tuple[str, ...], values: Mapping[str, float]) -> list[Array]:
    """Return the signals (K,) of a motion: what its sensors give.

    Args:
        values: of `gain.v`, `offset.v` and those of the strains; 1 and 0 where not given.

    Raises:
        ParameterError: the model has no such signal.
    """
    m = motion.state.shape[1] // 2
    known = dict(zip(NEEDED, motion.measured.T, strict=True))
    known |= {"w1": motion.state[:, m], "w2": motion.state[:, m + 1]}
    if motion.sensed is not None:
        known |= dict(zip(STRAINS, motion.sensed.T, strict=False))
    for name in known:
        gain, offset = (
            values.get(f"{word}.{name}", usual) for word, usual in (("gain", 1.0), ("offset", 0.0))
        )
        if (gain, offset) != (1.0, 0.0):
            known[name] = gain * known[name] + offset
    for name in signals:
        if name not in known:
            raise ParameterError(
                f"signal {name} is not one that the model gives; choose of {', '.join(known)}"
            )
    return [known[name] for name in signals]


def _at(stamps: Array, time: Array, column: Array) -> Array:
    """Return a column at stamps (N,), straight between the clock's instants."""
    return np.interp(stamps, time, column)


def other_of(plant: str) -> str:
    """Return the plant that models the same arm otherwise, of the usual size."""
    kind = plant.partition(":")[0]
    return CLOSED if kind in (MODES, RIGID, "printed") else MODES


def searched_as(plant: str) -> str:
    """Return the plant that a search runs on: MuJoCo's chain in closed form, others themselves.

    Raises:
        ParameterError: there is no such plant.
    """
    kind, size = plant_kind(plant)
    own = CLOSED if size is None else f"{CLOSED}:{size}"
    return own if kind == "chain" else plant


def starts_of(record: Record) -> Array:
    """Return where a record starts (4,): its joints' angles [rad], and no rates [rad/s]."""
    return np.concatenate([record.resting(), np.zeros(2)])


def _require_beam(model: Model) -> None:
    """Refuse a beam's numbers where nothing bends."""
    named = [each.name for each in model.free if each.name in BEND]
    if named and model.plant == RIGID:
        raise ParameterError(
            f"--plant {RIGID}: no link of it bends, so {' and '.join(named)} cannot be told; give "
            "another plant, or other --free numbers"
        )


def require_built(model: Model, signals: Collection[str] = NEEDED) -> None:
    """Refuse a model whose nominal plant cannot be made or read, in that plant's own words.

    Args:
        signals: that its logs have.

    Raises:
        ParameterError: no such plant, a bridge off its beam.
    """
    _require_beam(model)
    try:
        plant, chosen = model.built({each.name: each.nominal for each in model.free})
        hardware = faultless(chosen.hardware, any(name in STRAINS for name in signals))
        bridge_numbers(hardware, plant, plant.step)
    except FlexsimError as error:
        raise ParameterError(f"--plant {model.plant}: {error}") from None
    if hardware.sensing.kalman_modes and "v" in signals:
        raise ParameterError(
            f"v of estimator {hardware.sensing.estimator} knows the torques, so it is no "
            "measurement; leave it out with --signals theta1 theta2 strain1 strain2"
        )
