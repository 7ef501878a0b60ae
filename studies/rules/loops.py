"""One design on one plant: its rows, its loops over frequency, its steps.

>>> design, loop, curves = judged("flat-phase", 0, pair, sampled, joint)
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controllers import Sections
from controllers.rules import RigidJoint
from flexsim.linear.controller_space import controller_space
from flexsim.linear.delay_margin import delay_margin
from flexsim.linear.growth import quantised
from flexsim.linear.loop_poles import LinearLoop
from flexsim.linear.margins import margins
from flexsim.numerics.types import Array
from studies.rules.rows import Curves, LoopRow

LOWEST, POINTS = 0.5, 1200  # [rad/s] first frequency of the curves, and how many there are
DURATION = 1.5  # [s] of a step
SETTLED = 0.02  # of a step


def rigid_crossing(
    built: Sections, joint: RigidJoint, period: float
) -> tuple[float | None, float | None]:
    """Return where the loop with the rigid joint crosses last [rad/s], and its margin [rad]."""
    omega = np.geomspace(LOWEST, 0.99 * np.pi / period, POINTS)
    loop = built.response(omega, period) * joint.response(omega)
    size = np.log(np.abs(loop))
    above = np.flatnonzero((size[:-1] > 0) & (size[1:] <= 0))
    if not len(above):
        return None, None
    k = above[-1]
    share = size[k] / (size[k] - size[k + 1])
    at = float(omega[k] * (omega[k + 1] / omega[k]) ** share)
    exact = built.response(at, period)[0] * complex(joint.response(at))
    return at, float(np.angle(-exact))


def loop_rows(rule: str, loop: LinearLoop, steps: Array, time: Array) -> list[LoopRow]:
    """Return the rows of both joints; steps (2, K) as of `Curves`."""
    growth = float(quantised(loop.growth_rate))
    late = delay_margin([loop.sampled], loop.controllers)
    late_shown = None if not np.isfinite(late) else float(late)
    rows = []
    for j in (0, 1):
        found = margins(loop, j)
        overshoot, settling = _shape(steps[j], time)
        rows.append(
            LoopRow(
                rule=rule,
                joint=j + 1,
                growth=growth,
                gain_low=found.gain_low,
                gain_high=found.gain_high,
                phase=found.phase,
                omega_phase=found.omega_phase,
                delay_margin=late_shown,
                overshoot=overshoot,
                settling=settling,
            )
        )
    return rows


def _shape(step: Array, time: Array) -> tuple[float | None, float | None]:
    """Return overshoot [-] and settling time [s] of a unit step (K,)."""
    if not np.isfinite(step).all():
        return None, None
    off = np.flatnonzero(np.abs(step - 1.0) > SETTLED)
    last = int(off[-1]) + 1 if len(off) else 0
    return max(0.0, float(step.max()) - 1.0), float(time[last]) if last < len(time) else None


def curves_of(rule: str, loop: LinearLoop) -> Curves:
    """Return the loops over frequency and the steps of one design."""
    period = loop.sampled.period
    omega = np.geomspace(LOWEST, 0.99 * np.pi / period, POINTS)
    loops = np.array([_response(loop, j, omega) for j in (0, 1)])
    time = period * np.arange(round(DURATION / period), dtype=float)
    grows = loop.growth_rate > 0
    steps = [np.full(len(time), np.nan) if grows else _step(loop, j, len(time)) for j in (0, 1)]
    return Curves(rule, omega, loops, time, np.array(steps))


def _response(loop: LinearLoop, joint: int, omega: Array) -> NDArray[np.complex128]:
    """Return one joint's loop (F,), broken at its torque."""
    A, B, C = loop.broken_at(joint)
    poles, vectors = np.linalg.eig(A)
    if np.linalg.cond(vectors) < 1e10:  # as a rule: one division a pole and frequency
        z = np.exp(1j * omega * loop.sampled.period)
        residues = (C @ vectors) * np.linalg.solve(vectors, B.astype(complex))
        return np.asarray((residues / (z[:, None] - poles)).sum(axis=1))
    one = np.eye(len(A))
    z = np.exp(1j * omega * loop.sampled.period)
    return np.array([C @ np.linalg.solve(each * one - A, B) for each in z])


def _step(loop: LinearLoop, joint: int, samples: int) -> Array:
    """Return a joint's measured angle (K,) after a unit step of its reference."""
    _, G, _, D = (each[0] for each in controller_space(loop.controllers))
    n = len(loop.sampled.A)
    into = np.concatenate([loop.sampled.B @ D[:, joint], G[:, joint]])
    seen = -loop.sampled.C[joint]  # C is to the errors, the reference at zero
    state, found = np.zeros(len(into)), np.empty(samples)
    for k in range(samples):
        found[k] = seen @ state[:n]
        state = loop.matrix @ state + into
    return found
