"""Strain bridges and tachometers in the compiled loop: what they read, and v of it.

    >>> b = bridge_numbers(hardware, plant, period=1e-3)
    >>> memory = np.zeros(b.room)
    >>> v = seen_v(b, memory, run, sample, theta1, theta2, state, v)

What a plant is enters as two rows, strain = rows . q. The filter is exact for a strain that moves
in a straight line from sample to sample, and settled at the start. Loops without bridges and
tachometers have `NoBridges` instead, for which nothing is compiled.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numba.extending import overload

from flexsim.errors import ParameterError
from flexsim.loop.hardware.estimators import (
    ANGLE_LEAST,
    COMMANDS,
    READINGS,
    STRAIN_LEAST,
    kalman_filter,
    shortened,
    static_estimator,
)
from flexsim.numerics.jit import jit, jit_apart
from flexsim.numerics.noise import MASK, normal
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant

if TYPE_CHECKING:
    from flexsim.loop.hardware.base import Hardware

SENSED = 4  # columns: strain1, strain2 as filtered [-], rates of theta1, theta2 [rad/s]
READ, CAME, TOLD, RATES, FIRST, STATES = 0, 2, 4, 6, 8, 10  # places in memory, see `read_bridges`
STRAIN_CHANNEL, RATE_CHANNEL = 1, 3  # of the noise, two each; v's own is 0


class BridgeNumbers(NamedTuple):
    """Bridges, tachometers and the estimator of v as plain numbers, arrays flat.

    Attributes:
        there: whether anything is read. strained, turning: bridges, tachometers.
        estimated: whether v is made of it. states: n of the estimator. room: of its memory.
        rows: (2 m,) strain, gain included, of positions. keep, now, before: of the filter's last
            output, this strain and the last.
        F: (n n,), G: (6 n,), H: (n + 2,) estimator, the last two of H times the strains.
        offset, drift [1/s], noise of strains; period [s]; gain, rms [rad/s] of tachometers.
    """

    there: bool
    strained: bool
    turning: bool
    estimated: bool
    states: int
    room: int
    seed: int
    period: float
    rows: Array
    offset: Array
    drift: Array
    noise: Array
    keep: float
    now: float
    before: float
    F: Array
    G: Array
    H: Array
    rate_gain: Array
    rate_noise: Array


class NoBridges(NamedTuple):
    """Neither bridges nor tachometers."""

    room: int = 0


def leanest_bridges(found: Sequence[BridgeNumbers]) -> Sequence[BridgeNumbers | NoBridges]:
    """Return what is read, of one kind: nothing at all if none of them reads."""
    return found if any(each.there for each in found) else [NoBridges()] * len(found)


def ramp_filter(lag: float, period: float) -> tuple[float, float, float]:
    """Return (keep, now, before): f_k = keep f_(k-1) + now s_k + before s_(k-1).

    The first-order lag's exact answer to a straight line between samples; (0, 1, 0) without a lag.
    """
    if lag == 0.0:
        return 0.0, 1.0, 0.0
    keep = math.exp(-period / lag)
    share = -math.expm1(-period / lag) * lag / period
    return keep, 1.0 - share, share - keep


def places_of(hardware: Hardware, plant: Plant) -> tuple[float, float]:
    """Return the nominal places of the bridges: as given, else the file's sites, else as usual."""
    given = hardware.sensing.bridge_places
    sites = plant.bridge_sites
    usual: tuple[float, float] = type(hardware.sensing)().bridge_places
    return sites if sites is not None and given == usual else given


def _require_on_beam(places: tuple[float, float], true: Array, L: float) -> None:
    """Refuse bridges that their shifts take off the beam."""
    for i, (place, at) in enumerate(zip(places, true, strict=True)):
        if 0 <= place <= L and not 0 <= at <= L:
            raise ParameterError(
                f"strain bridge {i + 1}, {place:g} m from the clamp, is off the beam by its "
                f"bridge_shift of {at - place:g} m; give places and shifts whose sums are "
                f"0 to {L:g} m"
            )


def bridge_numbers(hardware: Hardware, plant: Plant, period: float) -> BridgeNumbers:
    """Return what compiled loops read of a plant's bridges and tachometers.

    Args:
        period: control period [s].

    Raises:
        ParameterError: a bridge off the beam, a plant without one, places that tell no modes apart.
    """
    s = hardware.sensing
    none, turning = np.zeros(0), s.tachometers == "on"
    rows, F, G, H = none, none, none, none
    states = 0
    if s.strained:
        places = places_of(hardware, plant)
        true = np.add(places, s.bridge_shift)
        _require_on_beam(places, true, plant.parameters.L)
        gained = s.bridge_distance * (1.0 + np.array(s.bridge_gain))
        rows = shortened((gained[:, None] * plant.curvature_rows(true)).ravel())
    if s.kalman_modes:
        quanta = hardware.quanta
        noise = [max(each / math.sqrt(12), ANGLE_LEAST) for each in quanta]
        noise += [max(each, STRAIN_LEAST) for each in s.bridge_noise]
        found = kalman_filter(
            plant.parameters,
            s.kalman_modes,
            places,
            s.bridge_distance,
            period,
            s.kalman_pose,
            s.kalman_torque,
            noise,
        )
        states = len(found.F)
        F, G = shortened(found.F.ravel()), found.G.copy()
        for column in range(READINGS + COMMANDS):
            G[:, column] = shortened(G[:, column])
        G, H = G.ravel(), np.concatenate([found.H, np.zeros(2)])
    elif s.estimated:
        H = static_estimator(s.estimator, plant.parameters, places, s.bridge_distance)
    keep, now, before = ramp_filter(s.bridge_filter, period)
    there = s.strained or turning
    return BridgeNumbers(
        there,
        s.strained,
        turning,
        s.estimated,
        states,
        STATES + 2 * states if there else 0,
        int(hardware.seed),
        float(period),
        rows,
        np.array(s.bridge_offset),
        np.array(s.bridge_drift),
        np.array(s.bridge_noise),
        keep,
        now,
        before,
        F,
        G,
        H,
        np.array(s.tachometer_gain),
        np.array(s.tachometer_noise),
    )


@jit_apart
def read_bridges(b: BridgeNumbers, memory: Array, run, sample, theta1, theta2, state, v) -> float:  # type: ignore[no-untyped-def]
    """Return v as the controllers get it [m].

    Args:
        memory: (room,), overwritten: strains read, those ahead of the filter, commands held since
            the sample before (written by the loop), rates read, the first angles, from which the
            estimator counts, and its states twice.
        run, sample: whose noise it is. theta1, theta2: as measured [rad]. v: as it is read without
            bridges [m].
    """
    m = state.shape[0] // 2
    if b.turning:
        for i in range(2):
            rate = (1.0 + b.rate_gain[i]) * state[m + i]
            if b.rate_noise[i] > 0.0:
                rate += b.rate_noise[i] * normal(b.seed, run & MASK, sample, RATE_CHANNEL + i)
            memory[RATES + i] = rate
    if not b.strained:
        return v
    for i in range(2):
        strain = b.offset[i] + b.drift[i] * (sample * b.period)
        for j in range(m):
            strain += b.rows[i * m + j] * state[j]
        if sample == 0:
            memory[READ + i] = memory[CAME + i] = strain
        if b.noise[i] > 0.0:
            strain += b.noise[i] * normal(b.seed, run & MASK, sample, STRAIN_CHANNEL + i)
        passed = b.keep * memory[READ + i] + b.now * strain + b.before * memory[CAME + i]
        memory[READ + i], memory[CAME + i] = passed, strain
    if not b.estimated:
        return v
    n = b.states
    if n > 0:
        if sample == 0:  # at rest where the encoders say, beam straight
            memory[FIRST] = theta1
            memory[FIRST + 1] = theta2
        for i in range(n):
            x = b.G[6 * i] * (theta1 - memory[FIRST])
            x += b.G[6 * i + 1] * (theta2 - memory[FIRST + 1])
            for j in range(2):
                x += b.G[6 * i + 2 + j] * memory[READ + j] + b.G[6 * i + 4 + j] * memory[TOLD + j]
            for j in range(n):
                x += b.F[i * n + j] * memory[STATES + j]
            memory[STATES + n + i] = x
        memory[STATES : STATES + n] = memory[STATES + n : STATES + 2 * n]
    v = b.H[n] * memory[READ] + b.H[n + 1] * memory[READ + 1]
    for i in range(n):
        v += b.H[i] * memory[STATES + i]
    return v


def seen_v(
    b: BridgeNumbers | NoBridges,
    memory: Array,
    run: int,
    sample: int,
    theta1: float,
    theta2: float,
    state: Array,
    v: float,
) -> float:
    """Return v as the controllers get it [m]: arguments as of `read_bridges`."""
    if isinstance(b, NoBridges):
        return v
    seen: float = read_bridges(b, memory, run, sample, theta1, theta2, state, v)
    return seen


def tell(b: BridgeNumbers | NoBridges, memory: Array, u1: float, u2: float) -> None:
    """Let the estimator know the commands that are held from now on [N m]."""
    if isinstance(b, BridgeNumbers):
        memory[TOLD], memory[TOLD + 1] = u1, u2


def note(b: BridgeNumbers | NoBridges, memory: Array, sensed: Array, row: int) -> None:
    """Fill a row of what was read (R, 4)."""
    if isinstance(b, BridgeNumbers):
        _note(b, memory, sensed, row)


@jit
def _tell(b: BridgeNumbers, memory: Array, u1: float, u2: float) -> None:
    memory[TOLD], memory[TOLD + 1] = u1, u2


@jit
def _note(b: BridgeNumbers, memory: Array, sensed: Array, row: int) -> None:
    for i in range(2):
        if b.strained:
            sensed[row, i] = memory[READ + i]
        if b.turning:
            sensed[row, 2 + i] = memory[RATES + i]


@overload(seen_v, jit_options={"forceinline": True})
def _seen_v(b, memory, run, sample, theta1, theta2, state, v) -> Any:  # type: ignore[no-untyped-def]
    if b.instance_class is NoBridges:
        return lambda b, memory, run, sample, theta1, theta2, state, v: v
    return lambda b, memory, run, sample, theta1, theta2, state, v: read_bridges(
        b, memory, run, sample, theta1, theta2, state, v
    )


@overload(tell, jit_options={"forceinline": True})
def _tell_if(b, memory, u1, u2) -> Any:  # type: ignore[no-untyped-def]
    if b.instance_class is NoBridges:
        return lambda b, memory, u1, u2: None
    return lambda b, memory, u1, u2: _tell(b, memory, u1, u2)


@overload(note, jit_options={"forceinline": True})
def _note_if(b, memory, sensed, row) -> Any:  # type: ignore[no-untyped-def]
    if b.instance_class is NoBridges:
        return lambda b, memory, sensed, row: None
    return lambda b, memory, sensed, row: _note(b, memory, sensed, row)
