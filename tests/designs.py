"""Linear models that designs are tested on: a rigid arm in closed form, and the robot's."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controllers.model_based import LinearModel, Space
from controllers.model_based.hinf import Plant
from flexsim import Parameters
from flexsim.linear.designed_on import model_of
from flexsim.linear.loop_poles import LinearLoop, LoopOptions, linear_loop
from flexsim.loop.control.stacking import stack
from flexsim.loop.hardware import HARDWARE, Hardware
from flexsim.plants.modes_plant import AssumedModesPlant

PERIOD, POSE, MODES = 1e-3, 1.5, 5
BENCH = HARDWARE["bench"]
INERTIA = np.array([[0.32, 0.014], [0.014, 0.011]])  # about the robot's [kg m2]


def rigid_model(period: float, J: NDArray[np.float64] = INERTIA) -> LinearModel:
    """Two coupled double integrators, sampled exactly; v is always zero."""
    one, none = np.eye(2), np.zeros((2, 2))
    E = np.vstack([one * period**2 / 2, one * period])
    return LinearModel(
        A=np.block([[one, period * one], [none, one]]),
        B=E @ np.linalg.inv(J),
        C=np.vstack([np.hstack([one, none]), np.zeros(4)]),
        period=period,
        reach=0.575,
        J=J,
        E=E,
        noise=np.array([2e-4, 2e-4, 1e-4]),
    )


def arm(modes: int = MODES) -> AssumedModesPlant:
    return AssumedModesPlant(Parameters(), modes)


def arm_model(hardware: Hardware = BENCH, modes: int = MODES, theta2: float = POSE) -> LinearModel:
    return LinearModel(*model_of(arm(modes), theta2, hardware))


def loop_around(
    controller: Space, hardware: Hardware = BENCH, modes: int = MODES, theta2: float = POSE
) -> LinearLoop:
    """The loop near rest, as `flexsim` closes it."""
    options = LoopOptions(PERIOD, v_gain=0.0, hardware=hardware.linear)
    return linear_loop(arm(modes), theta2, stack([controller], PERIOD), options)


def response(system: Space, z: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """C (z - A)^-1 B + D at each z (K,), (K, outputs, inputs)."""
    A, B, C, D = system
    inner = np.linalg.solve(
        z[:, None, None] * np.eye(len(A)) - A, np.broadcast_to(B, (len(z), *B.shape))
    )
    return np.asarray(C @ inner + D)


def closed(plant: Plant, K: Space) -> Space:
    """From w to z with u = K y."""
    A, B1, B2, C1, C2, D11, D12, D21, D22 = plant
    F, G, H, D = K
    one = np.linalg.inv(np.eye(len(D22)) - D22 @ D)  # y = one (C2 x + D22 H k + D21 w)
    u = np.hstack([D @ one @ C2, H + D @ one @ D22 @ H]), D @ one @ D21
    y = np.hstack([one @ C2, one @ D22 @ H]), one @ D21
    n, c = len(A), len(F)
    whole = np.zeros((n + c, n + c))
    whole[:n, :n], whole[n:, n:] = A, F
    whole[:n] += B2 @ u[0]
    whole[n:] += G @ y[0]
    out = np.hstack([C1, np.zeros((len(C1), c))]) + D12 @ u[0]
    return whole, np.vstack([B1 + B2 @ u[1], G @ y[1]]), out, D11 + D12 @ u[1]


def circle(points: int = 600, lowest: float = 1e-5) -> NDArray[np.complex128]:
    """Points on the upper half of the unit circle, dense towards 1."""
    return np.exp(1j * np.geomspace(lowest, np.pi, points))


def same_set(found: NDArray[np.complex128], wanted: NDArray[np.complex128]) -> float:
    """The largest distance of two sets of poles, each matched to its nearest left."""
    left, worst = list(wanted), 0.0
    assert len(found) == len(left)
    for pole in found:
        nearest = int(np.argmin(np.abs(np.array(left) - pole)))
        worst = max(worst, abs(left.pop(nearest) - pole))
    return worst
