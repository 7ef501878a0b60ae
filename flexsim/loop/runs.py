"""Runs in the words of a study: plant, setting, trajectory, controllers in; motions out.

>>> found, = measure(plant, setting("simulink"), reference, [controller])
>>> motion, = closed_loop(plant, setting("simulink"), reference, [controller.filters(1e-3)])
>>> drive(plant, setting("none"), torque, period=1e-3, theta=(0.0, 1.2))
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from flexsim.errors import DivergenceError, ParameterError
from flexsim.loop.compiled_loop import TORQUE_MOST, Loop, Outcome
from flexsim.loop.control.stacking import stack
from flexsim.loop.friction import LUGRE
from flexsim.loop.hardware import (
    SENSED,
    bridge_numbers,
    commands,
    encoder_angles,
    joint_memory,
    joint_step,
    leanest_bridges,
    leanest_effects,
    mean_torque,
    measured,
    note,
    seen_v,
    tell,
    waiting_room,
)
from flexsim.loop.measuring import NO_YARDSTICK, Yardstick, figure_columns, figures, yardstick
from flexsim.loop.metrics import WEIGHTS
from flexsim.loop.motion import Motion
from flexsim.loop.populations import THREADS_MOST, Stage, run_population
from flexsim.loop.settings import V_GAIN, Setting
from flexsim.loop.trajectories import Reference
from flexsim.numerics.clocks import PERIOD, whole_substeps
from flexsim.numerics.jit import jit
from flexsim.numerics.types import Array
from flexsim.plants.base import Observation, Plant
from flexsim.plants.dispatch import physics_step, tip_in_hub, work_space

TORN = 1.2  # of r + L: a tip so far from joint 2 is of no beam, but of a rod whose edges gave way
V_LIMIT = 0.5  # of the beam's length: a tip deflection beyond which neither model holds


def loop_of(
    plant: Plant,
    reference: Reference,
    v_gain: float = V_GAIN,
    weights: ArrayLike = WEIGHTS,
) -> Loop:
    """Return what the compiled loop needs to know of a reference, for one plant.

    Args:
        plant: whose physics step must divide the reference's period.
        v_gain: sign with which v enters the loop, -1 in the paper.
        weights: of x, y and v in the index (5).

    Raises:
        ParameterError: the control period is no whole multiple of the physics step, the weights
            are not three finite numbers, v_gain is not finite, or the torque fed forward is not
            (K+1, 2) finite numbers.
    """
    if len(reference.time) < 2:
        raise ParameterError("the reference has one sample only; use a shorter control period")
    period = float(reference.time[1] - reference.time[0])
    importance = np.asarray(weights, dtype=float)
    if importance.shape != (3,) or not (np.isfinite(importance).all() and (importance >= 0).all()):
        raise ParameterError(f"index weights are {weights!r}; give three finite numbers, 0 or more")
    if not np.isfinite(v_gain):
        raise ParameterError(f"v_gain is {v_gain}; give a finite number, -1 in the paper")
    torque = np.zeros((0, 2)) if reference.torque is None else _forward(reference)
    p = plant.parameters
    return Loop(
        period=period,
        substeps=whole_substeps(period, plant.step),
        tip=np.ascontiguousarray(reference.tip),
        joint=np.ascontiguousarray(reference.joint),
        torque=torque,
        L_R=p.L_R,
        reach=p.reach,
        v_gain=float(v_gain),
        v_limit=V_LIMIT * p.L,
        weights=importance,
    )


def _forward(reference: Reference) -> Array:
    """Return the torque fed forward with a reference (K+1, 2), checked."""
    try:
        torque = np.ascontiguousarray(reference.torque, dtype=float)
    except (TypeError, ValueError):
        raise ParameterError("the reference's torque must be an array of numbers") from None
    if torque.shape != reference.joint.shape or not np.isfinite(torque).all():
        raise ParameterError(
            f"the reference's torque has shape {torque.shape}; "
            f"give {reference.joint.shape} finite numbers [N m]"
        )
    return torque


def evaluate(
    plant: Plant,
    setting: Setting,
    reference: Reference,
    controllers: Sequence[Any],
    stride: int = 0,
    threads: int | None = None,
    yard: Yardstick = NO_YARDSTICK,
    same_noise: bool = False,
    first_run: int = 0,
    **loop_options: Any,
) -> Outcome:
    """Return the outcome of every controller, without looking into the motions.

    Args:
        plant, setting, reference: as named; a reference's torque is fed forward.
        controllers: P of any linear kind, see `flexsim.loop.control.stacking`.
        stride: record every stride-th sample; 0 records nothing. threads: None for all.
        yard: what runs are measured against, see `measure`.
        same_noise: whether all get the noise on v that the first has.
        first_run: which of a longer series the first is, whose noise on v it gets.
        loop_options: `v_gain`, `weights` of `loop_of`.
    """
    loop = loop_of(plant, reference, **loop_options)
    start, friction = plant.rest_state(reference.joint[0]), setting.friction.numbers()
    stage = Stage(plant, friction, loop, start, setting.hardware, yard)
    built = stack(controllers, loop.period)
    return run_population(stage, built, stride, threads, same_noise, first_run)


def measure(
    plant: Plant,
    setting: Setting,
    reference: Reference,
    controllers: Sequence[Any],
    hold: float = 0.0,
    **options: Any,
) -> list[dict[str, Any]]:
    """Return the figures of merit of every controller, from rest on the reference.

    Those of `flexsim.loop.metrics.measures`, computed while the runs go on: no motion is kept.

    Args:
        plant, setting, reference, controllers: as in `evaluate`.
        hold: length of the hold at the reference's end [s], over which v is looked at.
        options: `threads`, and `v_gain`, `weights` of `loop_of`.
    """
    yard = yardstick(reference, hold)
    found = evaluate(plant, setting, reference, controllers, yard=yard, **options)
    return measured_figures(found, reference, hold)


def measured_figures(found: Outcome, reference: Reference, hold: float) -> list[dict[str, Any]]:
    """Return the figures of merit of every run of an outcome that was measured; see `measure`."""
    columns = figure_columns(found.sums, found.indices, found.diverged, reference, hold)
    return [figures(columns, run) for run in range(len(found.indices))]


def closed_loop(
    plant: Plant,
    setting: Setting,
    reference: Reference,
    controllers: Sequence[Any],
    stride: int = 1,
    energy: bool = True,
    **options: Any,
) -> list[Motion]:
    """Return the recorded motion of every controller, from rest on the reference.

    Sections for joint 1, zeros, poles and gain for joint 2, and a torque that helps:

    >>> sections = signal.zpk2sos([0.97, 0.2], [0.5, 0.1], 300.0)             # (1, 6)
    >>> helped = replace(reference, torque=torque)                            # (K+1, 2) [N m]
    >>> motion, = closed_loop(plant, setting("none"), helped, [(sections, ([0.95], [0.5], 3.0))])

    Args: as `evaluate`; energy: whether to compute it, which costs more than all else.
    """
    if stride < 1:
        raise ParameterError(f"stride is {stride}; give 1 or more")
    outcome = evaluate(plant, setting, reference, controllers, stride, **options)
    runs = range(len(outcome.indices))
    return [motion_of(outcome, i, plant, reference, stride, energy) for i in runs]


def motion_of(
    outcome: Outcome,
    run: int,
    plant: Plant,
    reference: Reference,
    stride: int = 1,
    energy: bool = True,
) -> Motion:
    """Return the recorded motion of one run of an outcome; arguments as of `closed_loop`."""
    time, states = outcome.diverged[run], outcome.states[run]
    samples = (len(reference.time) + stride - 1) // stride
    ran = np.isfinite(states[:samples]).all(axis=1)
    rows = samples if ran.all() else int(np.argmin(ran))
    return Motion(
        plant=plant.name,
        time=reference.time[::stride][:rows],
        state=states[:rows],
        torque=outcome.torques[run, :rows],
        error=outcome.errors[run, :rows],
        applied=outcome.applied[run, :rows],
        measured=outcome.measured[run, :rows],
        sensed=outcome.sensed[run, :rows],
        reference_tip=reference.tip[::stride][:rows],
        reference_joint=reference.joint[::stride][:rows],
        diverged=None if np.isnan(time) else float(time),
        **vars(plant.observe(states[:rows], energy)),
    )


@jit
def _drive(  # type: ignore[no-untyped-def]
    plant,
    friction,
    h,
    effects,
    bridges,
    state,
    run,
    torque,
    period,
    substeps,
    states,
    applied,
    seen,
    sensed,
):
    """Fill states (K+1, 2 m) and applied (K, 2) under torques (K, 2) held over a period each.

    What is measured, with the noise of a run, goes into seen (K+1, 3) and sensed (K+1, 4). Return
    the rows of states filled.
    """
    waiting = waiting_room(h)
    joints = joint_memory(state)
    memory = np.zeros(bridges.room)
    work = work_space(state.shape[0] // 2)
    for k in range(torque.shape[0] + 1):
        states[k, :] = state
        if not np.isfinite(np.sum(state)):
            return k
        _, v = tip_in_hub(plant, state)
        th1, th2 = encoder_angles(effects, joints, state[0], state[1])
        th1, th2, v_seen = measured(h, run, k, th1, th2, v)
        v_seen = seen_v(bridges, memory, run, k, th1, th2, state, v_seen)
        seen[k, 0], seen[k, 1], seen[k, 2] = th1, th2, v_seen
        note(bridges, memory, sensed, k)
        if k < torque.shape[0]:
            u1, u2 = torque[k, 0], torque[k, 1]
            c1, c2 = commands(h, waiting, k, u1, u2, friction.limit_1, friction.limit_2)
            applied[k, 0] = mean_torque(h, c1, joints[0])
            applied[k, 1] = mean_torque(h, c2, joints[1])
            tell(bridges, memory, c1, c2)
            for _ in range(substeps):
                t = k * period
                tau_1, tau_2 = joint_step(friction, h, effects, joints, t, c1, c2, state)
                if not abs(tau_1) + abs(tau_2) <= TORQUE_MOST:
                    return k
                physics_step(plant, 0, state, tau_1, tau_2, work)
    return torque.shape[0] + 1


def _torn(plant: Plant, states: Array) -> int | None:
    """Return the first row of states (K, 2 m) whose tip is farther away than a beam reaches."""
    with np.errstate(over="ignore", invalid="ignore"):
        along, across = plant.deflection(states[:, : states.shape[1] // 2])
        beyond = along**2 + across**2 > (TORN * plant.parameters.reach) ** 2
    return int(np.argmax(beyond)) if beyond.any() else None


def drive(
    plant: Plant,
    setting: Setting,
    torque: ArrayLike,
    period: float = PERIOD,
    theta: ArrayLike = (0.0, 0.0),
    state: ArrayLike | None = None,
    run: int = 0,
    look: bool = True,
) -> Motion:
    """Return the open-loop motion under recorded torques, row k the state at t_k.

    Args:
        plant, setting: as named.
        torque: (K, 2) [N m], held over one period each; the motion has K+1 rows.
        period: [s]. theta: joint angles at rest at the start [rad], beam straight.
        state: (2 m,) to start from instead. run: whose noise what is measured has.
        look: whether more than state, joint angles and v is wanted, which costs more than they.

    Raises:
        ParameterError: the torque is not (K, 2) finite numbers, or the period no multiple of the
            step.
        DivergenceError: the motion becomes non-finite, a torque exceeds TORQUE_MOST, or the tip is
            farther from joint 2 than the beam is long.
    """
    try:
        tau = np.ascontiguousarray(torque, dtype=float)
        angles = np.asarray(theta, dtype=float)
    except (TypeError, ValueError):
        raise ParameterError("torque and theta must be arrays of numbers") from None
    if angles.shape != (2,) or not np.isfinite(angles).all():
        raise ParameterError(f"theta is {theta!r}; give two finite angles [rad]")
    if tau.ndim != 2 or tau.shape[1] != 2 or not np.isfinite(tau).all():
        raise ParameterError(f"torque has shape {tau.shape}; give (K, 2) finite numbers [N m]")
    substeps = whole_substeps(period, plant.step)
    rest = plant.rest_state(angles)
    start = rest if state is None else np.array(state, dtype=float)
    if start.shape != rest.shape or not np.isfinite(start).all():
        raise ParameterError(
            f"state has shape {start.shape}; the {plant.name} plant needs {rest.shape}, all finite"
        )
    (bridges,) = leanest_bridges([bridge_numbers(setting.hardware, plant, period)])
    states, applied = np.empty((len(tau) + 1, len(start))), np.empty((len(tau), 2))
    seen, sensed = np.full((len(states), 3), np.nan), np.full((len(states), SENSED), np.nan)
    with plant.running(1) as coefficients:
        friction = setting.friction.numbers()
        built = setting.hardware.numbers(period, substeps)
        own = [setting.hardware.effects.numbers(period / substeps)]
        (effects,) = leanest_effects(own, friction.law == LUGRE)
        fixed = (coefficients, friction, built, effects, bridges, start, run)
        rows = _drive(*fixed, tau, float(period), substeps, states, applied, seen, sensed)
    torn = _torn(plant, states[:rows])
    if torn is not None or rows <= len(tau):
        time = period * (rows if torn is None else torn)
        raise DivergenceError(
            f"the {plant.name} plant ran away at t = {time:.4g} s; "
            "use smaller torques or a shorter physics step"
        )
    unknown = np.full((len(states), 2), np.nan)
    return Motion(
        plant=plant.name,
        time=period * np.arange(len(states), dtype=float),
        state=states,
        torque=_with_last(tau),
        error=unknown,
        applied=_with_last(applied),
        measured=seen,
        sensed=sensed,
        reference_tip=unknown,
        reference_joint=unknown,
        **vars(plant.observe(states) if look else _unseen(plant, states)),
    )


def _unseen(plant: Plant, states: Array) -> Observation:
    """Return joint angles and v of states (K, 2 m), nothing for the rest."""
    none = np.full(len(states), np.nan)
    return Observation(
        joint=states[:, :2].copy(),
        v=plant.deflection(states[:, : states.shape[1] // 2])[1],
        tip=np.full((len(states), 2), np.nan),
        modal=np.zeros((len(states), 0)),
        energy=none,
        beam=np.zeros((len(states), 0, 2)),
    )


def _with_last(rows: Array) -> Array:
    """Return rows (K, 2) with the last once more, zeros if there is none."""
    return np.vstack([rows, rows[-1:]]) if len(rows) else np.zeros((1, 2))


def thread_count() -> int:
    """Return how many threads a population runs on unless told otherwise."""
    return int(THREADS_MOST)
