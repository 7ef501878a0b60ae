"""Input shaping: references convolved with impulses, so that given modes are left at rest.

    >>> shaper = in_series(zvd(21.0, 1e-3), zvd(131.4, 6e-3))
    >>> shaped = shaped_by(reference, shaper)        # the tip is still the unshaped path
    >>> residual_vibration(shaper, 21.0, 1e-3)       # 0 by design

A mode that is moved by an impulse rings; impulses half a period apart cancel what the earlier ones
left (ZV), and where the sum of their vibrations has no slope over frequency either (ZVD), a wrong
frequency matters in second order only. A shaped reference lags by the impulses' mean time, which
for the trajectories' index is an error like any other.

Which modes? A loop that holds the joints stiffly leaves the beam's own with its joints held; those
of an arm whose joints are free are for loops that hardly do. With a PD that crosses at 60 and 80
rad/s, without friction, the line in 1 s leaves 7.1 mm of v unshaped, 1.0 mm with ZV at the held
mode, 5.7 mm at the free one.

Source: N. C. Singer, W. P. Seering, Preshaping command inputs to reduce system vibration, J. Dyn.
Sys., Meas., Control 112 (1990) 76-82, from memory, not checked against the print; every formula
here is tested by the motion of an oscillator.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexsim.errors import ParameterError
from flexsim.loop.trajectories import Reference
from flexsim.numerics.eigen import natural_modes
from flexsim.numerics.types import Array
from flexsim.plants.linear_plant import LinearPlant

JOINTS = 2
KINDS = ("zv", "zvd")


@dataclass(frozen=True, eq=False)
class Shaper:
    """Impulses that a reference is convolved with.

    Attributes:
        times: (m,) [s], the first at 0. amplitudes: (m,), their sum 1.
    """

    times: Array
    amplitudes: Array

    @property
    def length(self) -> float:
        """Time of the last impulse, by which a shaped reference ends later [s]."""
        return float(self.times[-1])

    def on_samples(self, period: float) -> Shaper:
        """Return the impulses that linear interpolation makes of these, all at samples.

        An impulse a share f of a period behind a sample becomes 1 - f of it there and f of it at
        the next. At omega that is short of the impulse by f (1 - f) (omega T)^2 / 2, the largest
        for f = 1/2; to the nearest sample it would be off by up to omega T / 2.
        """
        steps = self.times / period
        first = np.floor(steps)
        share = steps - first
        count = int(first[-1]) + 2
        amplitudes = np.zeros(count)
        np.add.at(amplitudes, first.astype(int), (1.0 - share) * self.amplitudes)
        np.add.at(amplitudes, first.astype(int) + 1, share * self.amplitudes)
        return Shaper(period * np.arange(count, dtype=float), amplitudes)


def zv(omega: float, zeta: float = 0.0) -> Shaper:
    """Return two impulses that leave a mode without vibration.

    Args:
        omega: undamped frequency of the mode [rad/s]. zeta: its damping ratio, below 1.

    Raises:
        ParameterError: one is out of range.
    """
    half, K = _half_period(omega, zeta)
    return Shaper(np.array([0.0, half]), np.array([1.0, K]) / (1.0 + K))


def zvd(omega: float, zeta: float = 0.0) -> Shaper:
    """Return three impulses that leave a mode without vibration, nor its slope over frequency.

    Args, Raises: as `zv`.
    """
    half, K = _half_period(omega, zeta)
    amplitudes = np.array([1.0, 2.0 * K, K * K]) / (1.0 + K) ** 2
    return Shaper(np.array([0.0, half, 2.0 * half]), amplitudes)


def _half_period(omega: float, zeta: float) -> tuple[float, float]:
    """Return half a damped period [s] and by what a vibration decays in it."""
    if not (0.0 < omega < math.inf and 0.0 <= zeta < 1.0):
        raise ParameterError(
            f"a mode of {omega} rad/s with a damping ratio of {zeta} cannot be shaped for; give a "
            "frequency over 0 and a ratio from 0, below 1"
        )
    root = math.sqrt(1.0 - zeta * zeta)
    return math.pi / (omega * root), math.exp(-math.pi * zeta / root)


def in_series(*shapers: Shaper) -> Shaper:
    """Return shapers one behind another, for several modes; of none, one impulse at once."""
    times, amplitudes = np.zeros(1), np.ones(1)
    for each in shapers:
        times = np.add.outer(times, each.times).ravel()
        amplitudes = np.multiply.outer(amplitudes, each.amplitudes).ravel()
    order = np.argsort(times, kind="stable")
    return Shaper(times[order], amplitudes[order])


def for_modes(kind: str, modes: Sequence[tuple[float, float]]) -> Shaper:
    """Return the shapers of modes (omega [rad/s], zeta) in series.

    Args:
        kind: 'zv' or 'zvd'.

    Raises:
        ParameterError: another kind, or a mode that cannot be shaped for.
    """
    if kind not in KINDS:
        raise ParameterError(f"shaper {kind!r} is unknown; choose {' or '.join(KINDS)}")
    shape = zv if kind == "zv" else zvd
    return in_series(*(shape(omega, zeta) for omega, zeta in modes))


def joint_free_modes(linear: LinearPlant, count: int = 1) -> list[tuple[float, float]]:
    """Return (omega [rad/s], zeta) of the lowest modes of an arm whose joints are free.

    Args:
        linear: about a pose. count: of modes, the two rigid ones left out.

    Raises:
        ParameterError: the plant has not so many.
    """
    return _modes((linear.M, linear.D, linear.K), JOINTS, count)


def joint_held_modes(linear: LinearPlant, count: int = 1) -> list[tuple[float, float]]:
    """Return the same of an arm whose joints are held, as a stiff loop holds them.

    Raises:
        ParameterError: the plant has not so many.
    """
    M, D, K = (each[JOINTS:, JOINTS:] for each in (linear.M, linear.D, linear.K))
    return _modes((M, D, K), 0, count)


def _modes(
    matrices: tuple[Array, Array, Array], rigid: int, count: int
) -> list[tuple[float, float]]:
    """Return (omega, zeta) of the lowest modes of M q'' + D q' + K q, the rigid ones left out."""
    M, D, K = matrices
    most = len(M) - rigid
    if not 0 <= count <= most:
        raise ParameterError(f"{count} modes are asked for; this plant has 0 to {most}")
    squares, shapes = natural_modes(K, M)
    found = []
    for k in range(rigid, rigid + count):
        omega = math.sqrt(float(squares[k]))
        own = float(np.sum(shapes[:, k] * (D * shapes[:, k]).sum(axis=1)))
        found.append((omega, own / (2.0 * omega)))
    return found


def residual_vibration(shaper: Shaper, omega: float, zeta: float = 0.0) -> float:
    """Return the vibration after the last impulse over that after one impulse at its time.

    Of an oscillator of frequency omega [rad/s] and damping ratio zeta; 0 where the shaper is
    designed for it, 1 for a shaper that does nothing.

    Source: as of the module.
    """
    damped = omega * math.sqrt(1.0 - zeta * zeta)
    grown = shaper.amplitudes * np.exp(zeta * omega * (shaper.times - shaper.length))
    turned = damped * shaper.times
    return math.hypot(float(np.sum(grown * np.cos(turned))), float(np.sum(grown * np.sin(turned))))


def shaped_by(reference: Reference, shaper: Shaper) -> Reference:
    """Return a reference whose joint angles are convolved with the shaper.

    Its tip stays the unshaped path, and it is as long as the reference: what the shaper delays
    beyond its end is cut off, so that it should end with a hold of the shaper's length. Between
    two samples the joints' references are interpolated linearly, as `Shaper.on_samples` tells.

    Args:
        reference: sampled, at rest before its start and after its end.

    Raises:
        ParameterError: the reference has a torque fed forward, or a hold that is too short.
    """
    if reference.torque is not None:
        raise ParameterError(
            "the reference has a torque fed forward, which goes with the unshaped motion; shape "
            "it without, and add the torque to what comes back"
        )
    time, joint = reference.time, reference.joint
    held = time[-1] - time[np.flatnonzero((joint != joint[-1]).any(axis=1)).max(initial=0)]
    if shaper.length > held:
        raise ParameterError(
            f"the shaper is {shaper.length:.3g} s long and the reference holds its end for "
            f"{held:.3g} s; give it a longer hold"
        )
    total = np.zeros_like(joint)
    for at, amplitude in zip(shaper.times, shaper.amplitudes, strict=True):
        for j in range(JOINTS):
            total[:, j] += amplitude * np.interp(time - at, time, joint[:, j])
    return replace(reference, joint=total)
