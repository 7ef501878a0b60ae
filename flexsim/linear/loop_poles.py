"""The sampled closed loop near rest: poles, spectral radius, margins, for one or for thousands.

    >>> from flexsim.linear.loop_poles import linear_loop, spectral_radii
    >>> loop = linear_loop(plant, 1.2, stack([controller], period=1e-3))
    >>> loop.spectral_radius                     # below 1: the loop is stable near rest
    >>> spectral_radii(plant, 1.2, controllers)  # (P,), for a whole population

The loop is that of `flexsim.loop.compiled_loop`: errors theta1_ref - theta1 and
theta2_ref - (theta2 + v_gain v/(r+L)), controllers of any linear kind (the paper's are the filters
(3) and (4)), torques held over a period.

Friction. A linear model knows no dead zone. What it can know is a *small-signal gain* of the
torque at each joint and a viscous friction: `small_signal` gives those of a `Friction` beyond its
dead zone at a moving joint. Gain margins say by how much that gain may differ, which is how a
describing function of the dead zone (0 inside, rising beyond) is to be read.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexsim.errors import ParameterError
from flexsim.linear.controller_space import controller_space
from flexsim.linear.linearise import linearise, stepped_hold, with_shafts, zero_order_hold
from flexsim.linear.seen_v import SeenLoop, memory_of, with_bridges
from flexsim.loop.control.compiled import Controllers
from flexsim.loop.friction import RESISTING, Friction
from flexsim.loop.hardware import IDEAL, BridgeNumbers, Hardware, bridge_numbers, cascade
from flexsim.loop.settings import V_GAIN
from flexsim.numerics.clocks import PERIOD
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant
from flexsim.plants.linear_plant import LinearPlant

HOLDS = ("exact", "stepped")
CHUNK = 512  # controllers whose matrices are built at once


@dataclass(frozen=True)
class LoopOptions:
    """How a loop is closed and linearised.

    Attributes:
        period: control period [s]. v_gain: factor of atan(v/(r+L)), -1 in the paper.
        torque_gain: per joint, effective torque over commanded torque [-]; 1 without friction.
        joint_damping: per joint, viscous friction taken from the torque at the motor [N m s/rad].
        hold: 'exact' (matrix exponential) or 'stepped' (as the plant's own integrator does it).
        hardware: whose delay, lags and shafts (in contact) are states of the loop, and v's
            estimator with the strain bridges' filter; a linear model knows neither counts, gaps nor
            limits, and noise does not move its poles.

    Raises:
        ParameterError: an unknown hold, or a torque gain that is not finite.
    """

    period: float = PERIOD
    v_gain: float = V_GAIN
    torque_gain: tuple[float, float] = (1.0, 1.0)
    joint_damping: tuple[float, float] = (0.0, 0.0)
    hold: str = "exact"
    hardware: Hardware = IDEAL

    def __post_init__(self) -> None:
        if self.hold not in HOLDS:
            raise ParameterError(f"hold {self.hold!r} is unknown; choose {' or '.join(HOLDS)}")
        for name in ("torque_gain", "joint_damping"):
            value = np.asarray(getattr(self, name), dtype=float)
            if value.shape != (2,) or not np.isfinite(value).all():
                raise ParameterError(
                    f"{name.replace('_', ' ')} is {getattr(self, name)}; give two finite numbers"
                )
        if not np.isfinite(self.v_gain):
            raise ParameterError(f"v_gain is {self.v_gain}; give a finite number, -1 in the paper")


def small_signal(friction: Friction) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return (torque_gain, joint_damping) of a friction law beyond its dead zone, joints moving.

    Under 'simulink' and 'jump' the torque's slope is mu; under the others the torque passes, less
    mu times the joint's velocity. Coulomb friction and torque limits have no slope there; nor has
    stiction at rates beyond Stribeck's, while below them it *feeds* motion, which no margin here
    knows. At rest LuGre's bristles are springs that hold a joint: the loop is that of one sliding.

    Source: (47), Table 4.
    """
    one, none = (1.0, 1.0), (0.0, 0.0)
    if friction.law in ("simulink", "jump"):
        return friction.mu, none
    return one, friction.mu if friction.law in RESISTING else none


@dataclass(frozen=True, eq=False)
class SampledPlant:
    """A plant over one control period behind its hardware, with the loop's measurements.

    States are the plant's, then the lagging motors' torques, with their gains, if there is a lag,
    and their amplifiers', then the commands that wait, those of both joints one sample ago first,
    then what bridges and an estimator of v remember (`flexsim.linear.seen_v`). The reference is at
    zero.

    Attributes:
        A: (n, n), B: (n, 2) with the torque gains. C: (3, n) to the joints' errors and v.
        period: [s]. linear: what was discretised. options: how. bridges: what is read of the
            plant; memory: how many states that has. reach: r + L [m].
    """

    A: Array
    B: Array
    C: Array
    period: float
    linear: LinearPlant
    options: LoopOptions = field(default_factory=LoopOptions)
    bridges: BridgeNumbers | None = None
    memory: int = 0
    reach: float = 1.0

    def memory_states(self, plant_states: Array, torques: Array) -> Array:
        """Return what bridges and estimator remember (K, memory) at every sample of a run.

        Args:
            plant_states: (K, n) deviations, motors' included. torques: (K, 2) commands [N m].
        """
        return memory_of(SeenLoop(self.A, self.B, self.C, self.memory), plant_states, torques)

    def motor_states(self, torques: Array) -> Array:
        """Return what waits or lags (K, n - plant's) at every sample, of commands (K, 2) [N m]."""
        hardware = self.options.hardware
        delay, lags = hardware.delay, (hardware.lag, hardware.effects.amplifier)
        waiting = np.vstack([np.zeros((delay, 2)), torques])  # row k + delay is of sample k
        columns = [waiting[delay - i : len(waiting) - i] for i in range(1, delay + 1)]
        if any(lags):
            c = cascade(*lags, self.period)
            motor, late = np.zeros_like(torques), np.zeros_like(torques)
            gained = waiting * np.array(self.options.torque_gain)
            for k, command in enumerate(gained[: len(torques) - 1]):
                off, behind = motor[k] - command, late[k] - command
                motor[k + 1] = command + c.motor * off + c.amplifier * behind
                late[k + 1] = command + c.own * behind
            columns = [motor, *([late] if all(lags) else []), *columns]
        return np.hstack([*columns, np.zeros((len(torques), 0))])


def sampled_plant(plant: Plant, theta2: float, options: LoopOptions | None = None) -> SampledPlant:
    """Return the plant about rest at theta2 [rad] over one control period.

    Raises:
        ParameterError: theta2, the period or an option cannot be used.
    """
    o = options or LoopOptions()
    effects = o.hardware.effects
    lags, shafts = (o.hardware.lag, effects.amplifier), any(effects.shaft)
    if o.hold == "stepped" and not shafts:
        linear = linearise(plant, theta2)
        how = (o.period, plant.step, plant.integrator, o.joint_damping)
        A, B = stepped_hold(linear, *how, *lags)
    else:  # of shafts, too: friction is not at their motors
        linear = with_shafts(linearise(plant, theta2, o.joint_damping), effects)
        A, B = zero_order_hold(linear, o.period, *lags)
    C = linear.C.copy()
    if effects.encoder == "motor":
        C[:2] = _at_motors(C[:2], effects.shaft)
    lagging = np.zeros((len(C), len(A) - C.shape[1]))
    A, B, C = delayed(A, B * np.array(o.torque_gain), np.hstack([C, lagging]), o.hardware.delay)
    b = bridge_numbers(o.hardware, plant, o.period)
    reach = plant.parameters.reach
    return seen_plant(SampledPlant(A, B, C, o.period, linear, o, b, reach=reach))


def seen_plant(exact: SampledPlant) -> SampledPlant:
    """Return a plant whose C is to the joints' errors and v as the controllers get them.

    Args:
        exact: with C (3, n) to theta1, theta2 and the tip's v.
    """
    o, linear, b = exact.options, exact.linear, exact.bridges
    A, B, C, memory = exact.A, exact.B, exact.C, 0
    if b is not None and b.estimated:
        n, delay = len(A), o.hardware.delay
        m = len(b.rows) // 2
        coordinates = linear.coordinates
        own = np.arange(m) if coordinates is None else coordinates
        positions = np.zeros((m, n))
        positions[own, np.arange(len(own))] = 1.0
        told = np.zeros((2, n))
        if delay:  # the estimator knows its computer's own delay
            lags = (o.hardware.lag, o.hardware.effects.amplifier)
            begin = len(linear.A) + 2 * sum(each > 0 for each in lags) + 2 * (delay - 1)
            told[:, begin : begin + 2] = np.eye(2)
        A, B, C, memory = with_bridges(A, B, C, positions, told, b)
    C = np.vstack([-C[:2], C[2:3]])
    C[1] -= o.v_gain / exact.reach * C[2]  # atan(v/(r+L)), linear
    return replace(exact, A=A, B=B, C=C, memory=memory)


def _at_motors(C: Array, shafts: tuple[float, float]) -> Array:
    """Return rows (2, n) of the joints' angles as encoders at the motors see them."""
    moved, behind = C.copy(), [j for j, stiffness in enumerate(shafts) if stiffness > 0]
    for motor, j in enumerate(behind, start=C.shape[1] // 2 - len(behind)):
        moved[j, j], moved[j, motor] = 0.0, C[j, j]
    return moved


def delayed(A: Array, B: Array, C: Array, delay: int) -> tuple[Array, Array, Array]:
    """Return a sampled plant (A, B, C) whose two inputs arrive whole samples later, states last."""
    if delay == 0:
        return A, B, C
    n, more = len(A), 2 * delay
    later = np.zeros((n + more, n + more))
    later[:n, :n], later[:n, -2:] = A, B
    later[n + 2 :, n:-2] = np.eye(more - 2)
    into = np.zeros((n + more, 2))
    into[n : n + 2] = np.eye(2)
    return later, into, np.hstack([C, np.zeros((len(C), more))])


def wanted_torques(sampled: SampledPlant, controllers: Controllers) -> Array:
    """Return the torques (P, 2, n + c) that controllers want, of the states of plant and theirs.

    Args:
        sampled: plant of n states; controllers: P of them, of c states.
    """
    _, _, H, D = controller_space(controllers)
    return np.concatenate([D @ sampled.C, H], axis=2)


def closed_loop_matrices(sampled: SampledPlant, controllers: Controllers) -> Array:
    """Return the closed loop's matrices (P, n + c, n + c) over one period, reference at zero.

    Args:
        sampled: plant of n states; controllers: P of them, of c states.
    """
    n = len(sampled.A)
    F, G, _, _ = controller_space(controllers)  # (P, c, c), (P, c, 3)
    torques = wanted_torques(sampled, controllers)
    total = np.zeros((len(torques), torques.shape[2], torques.shape[2]))
    total[:, :n] = sampled.B @ torques
    total[:, :n, :n] += sampled.A
    total[:, n:, :n] = G @ sampled.C
    total[:, n:, n:] = F
    return total


def spectral_radii(
    plant: Plant,
    theta2: ArrayLike,
    controllers: Controllers,
    options: LoopOptions | None = None,
) -> Array:
    """Return the spectral radius (P,) of every controller's loop, the largest over the poses.

    Below 1 the loop is stable near rest at all these poses. Made for screening: a loop takes
    a third of a millisecond, against 2 (assumed modes) to 50 (MuJoCo's chain) for a simulated
    trajectory of 5 s.

    Args:
        plant: either. theta2: one pose or several [rad].
        controllers: P of them, from `flexsim.loop.control.stacking.stack`.

    Returns:
        (P,).

    Raises:
        ParameterError: a pose or an option cannot be used.
    """
    worst = np.zeros(len(controllers.b))
    for pose in np.atleast_1d(np.asarray(theta2, dtype=float)):
        worst = np.maximum(worst, radii_of(sampled_plant(plant, float(pose), options), controllers))
    return worst


def radii_of(sampled: SampledPlant, controllers: Controllers) -> Array:
    """Return the spectral radius (P,) of every controller's loop around one sampled plant."""
    radii = np.zeros(len(controllers.b))
    for start in range(0, len(radii), CHUNK):
        part = slice(start, start + CHUNK)
        poles = np.linalg.eigvals(closed_loop_matrices(sampled, controllers.chosen(part)))
        radii[part] = np.abs(poles).max(axis=1)
    return radii


@dataclass(frozen=True, eq=False)
class LinearLoop:
    """One controller's closed loop near rest.

    Attributes:
        sampled: the plant. controllers: one, of c states.
    """

    sampled: SampledPlant
    controllers: Controllers

    @cached_property
    def matrix(self) -> Array:
        """Closed-loop matrix over one period (n + c, n + c)."""
        return closed_loop_matrices(self.sampled, self.controllers)[0]

    @cached_property
    def poles(self) -> NDArray[np.complex128]:
        """Closed-loop poles (n + c,) in z, largest modulus first."""
        found = np.linalg.eigvals(self.matrix)
        return np.asarray(found[np.argsort(-np.abs(found), kind="stable")], dtype=complex)

    @property
    def spectral_radius(self) -> float:
        """Largest modulus of a pole; below 1 the loop is stable near rest."""
        return float(np.abs(self.poles[0]))

    @property
    def growth_rate(self) -> float:
        """Rate at which the slowest-decaying part of the motion grows, below 0 if stable [1/s]."""
        return float(np.log(self.spectral_radius) / self.sampled.period)

    def broken_at(self, joint: int) -> tuple[Array, Array, Array]:
        """Return A, B, C of the loop broken before a joint's torque, the other joint closed.

        Its response C (z - A)^-1 B, without sign, is the loop transfer function L of that joint:
        the closed loop's poles are where L = -1.

        Args:
            joint: 0 or 1.
        """
        back = -wanted_torques(self.sampled, self.controllers)[0, joint]  # (n + c,)
        into = np.zeros(len(back))
        into[: len(self.sampled.A)] = self.sampled.B[:, joint]
        return self.matrix + np.outer(into, back), into, back


def linear_loop(
    plant: Plant, theta2: float, controllers: Controllers, options: LoopOptions | None = None
) -> LinearLoop:
    """Return one controller's closed loop near rest at theta2 [rad].

    Args:
        controllers: one, from `flexsim.loop.control.stacking.stack`.

    Raises:
        ParameterError: a pose or an option cannot be used, or more than one controller is given.
    """
    if len(controllers.b) != 1:
        raise ParameterError(f"{len(controllers.b)} controllers are given; a loop has one")
    return LinearLoop(sampled_plant(plant, theta2, options), controllers)
