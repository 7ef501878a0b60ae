"""How far is a loop from instability? Gain and phase margins of one joint, the other closed.

    >>> margins(linear_loop(plant, 1.2, stack([controller], period=1e-3)), joint=0).gain_high
    >>> common_gains(loop)                       # factors of both joints' gains at once

The beam is hardly damped, so every resonance passes |L| = 1 and the smallest phase margin is small
for any controller; it is the gain margins that say which torque gains (friction!) a loop can take.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq

from flexsim.errors import ParameterError
from flexsim.linear.loop_poles import LinearLoop, wanted_torques
from flexsim.numerics.types import Array

CROSSED = 1e-6  # relative: what a crossing must come down to, else it is a jump through a pole
AT_ONCE = 2**20  # numbers of the matrices solved together: 16 MB, whatever delay the loop has
LOWEST = 1e-2  # [rad/s] start of the frequency grid
SHARP = 0.5  # modulus in z beyond which a pole gets its own part of the grid


@dataclass(frozen=True)
class Margins:
    """Margins of one joint's loop, the other joint closed; of a stable loop, those of stability.

    Attributes:
        gain_low, gain_high: factors of the loop's gain nearest to 1 at which a pole lies on the
            unit circle, below and above; 0 and inf where there is none.
        phase: smallest phase change that does the same [rad], signed, lag positive; pi if none.
        omega_phase: where [rad/s], nan if nowhere.
    """

    gain_low: float
    gain_high: float
    phase: float
    omega_phase: float


def margins(loop: LinearLoop, joint: int, points: int = 800) -> Margins:
    """Return gain and phase margins of the loop broken at one joint, the other closed.

    Args:
        loop: closed loop. joint: 0 or 1.
        points: of the first frequency grid, 0.01 rad/s to Nyquist's; sharp poles get their own.

    Raises:
        ParameterError: joint is neither 0 nor 1.
    """
    if joint not in (0, 1):
        raise ParameterError(f"joint is {joint}; give 0 for the first or 1 for the second")
    A, B, C = loop.broken_at(joint)
    one = np.eye(len(A))

    def response(angle: ArrayLike) -> NDArray[np.complex128]:
        z = np.exp(1j * np.asarray(angle, dtype=float))[..., None, None]
        into = np.broadcast_to(B[:, None].astype(complex), (*z.shape[:-2], len(A), 1))
        return np.asarray(np.linalg.solve(z * one - A, into)[..., 0] @ C, dtype=complex)

    def tilt(angle: float) -> float:
        at = complex(response(angle))
        return at.imag / abs(at)

    def level(angle: float) -> float:
        return float(np.log(abs(complex(response(angle)))))

    grid = _angles(loop, A, points)
    rows = max(1, AT_ONCE // A.size)
    L = np.concatenate([response(grid[k : k + rows]) for k in range(0, len(grid), rows)])
    real = [complex(response(w)).real for w in _crossings(grid, L.imag / np.abs(L), tilt)]
    factors = np.array([-1 / x for x in [*real, complex(response(np.pi)).real] if x < 0])
    unit = _crossings(grid, np.log(np.abs(L)), level)
    lags = np.array([float(np.angle(-complex(response(w)))) for w in unit])
    nearest = int(np.argmin(np.abs(lags))) if unit else -1
    return Margins(
        gain_low=float(np.max(factors[factors < 1], initial=0.0)),
        gain_high=float(np.min(factors[factors > 1], initial=np.inf)),
        phase=float(lags[nearest]) if unit else np.pi,
        omega_phase=unit[nearest] / loop.sampled.period if unit else np.nan,
    )


def common_gains(loop: LinearLoop, points: int = 800) -> tuple[float, float]:
    """Return the factors of both joints' loop gains nearest to 1, below and above, at which a pole
    lies on the unit circle; 0 and inf where there is none.

    There det(1 + k L) = 0 with a real k, and so one of the eigenvalues of L (2, 2) is -1/k. They
    are followed by size; so is their product, which does not care if they change places.

    Args:
        loop: closed loop. points: as of `margins`.
    """
    back = -wanted_torques(loop.sampled, loop.controllers)[0]  # (2, n + c)
    into = np.pad(loop.sampled.B, ((0, back.shape[1] - len(loop.sampled.B)), (0, 0)))
    A = loop.matrix + into @ back
    one = np.eye(len(A))

    def gains(angle: ArrayLike) -> NDArray[np.complex128]:
        z = np.exp(1j * np.asarray(angle, dtype=float))[..., None, None]
        inner = np.linalg.solve(z * one - A, np.broadcast_to(into, (*z.shape[:-2], *into.shape)))
        found = np.linalg.eigvals(back @ inner)
        return np.take_along_axis(found, np.argsort(np.abs(found), axis=-1), axis=-1)

    def tilts(angle: ArrayLike) -> Array:
        found = gains(angle)
        each = found.imag / np.abs(found)
        return np.concatenate([each, np.prod(each, axis=-1, keepdims=True)], axis=-1)

    grid = _angles(loop, A, points)
    rows = max(1, AT_ONCE // A.size)
    values = np.concatenate([tilts(grid[k : k + rows]) for k in range(0, len(grid), rows)])
    crossed = [np.pi]
    for i in range(3):
        crossed += _crossings(grid, values[:, i], lambda w, i=i: float(tilts(w)[i]))  # type: ignore[misc]
    at = gains(np.array(crossed)).ravel()
    real = at[np.abs(at.imag) < CROSSED * np.abs(at)].real
    factors = -1 / real[real < 0]
    return (
        float(np.max(factors[factors < 1], initial=0.0)),
        float(np.min(factors[factors > 1], initial=np.inf)),
    )


def _angles(loop: LinearLoop, A: Array, points: int) -> Array:
    """Return where to sample the response (F,) [rad/sample], dense about sharp poles."""
    poles = np.concatenate([np.linalg.eigvals(A), loop.poles])
    poles = poles[(np.abs(poles) > SHARP) & (poles.imag > 0)]
    near = np.tan(np.linspace(-1.5, 1.5, 30))[:, None] * np.abs(np.log(np.abs(poles)))
    even = np.geomspace(LOWEST * loop.sampled.period, np.pi, points)
    grid = np.concatenate([even, (np.angle(poles) + near).ravel()])
    return np.asarray(np.unique(grid[(grid > 0) & (grid <= np.pi)]))


def _crossings(grid: Array, values: Array, function: Callable[[float], float]) -> list[float]:
    """Return where a function sampled on a grid crosses zero, jumps left out."""
    found = []
    for i in np.flatnonzero(np.sign(values[:-1]) * np.sign(values[1:]) < 0):
        root = brentq(function, grid[i], grid[i + 1], xtol=1e-15)
        if abs(function(root)) < CROSSED:
            found.append(float(root))
    return found
