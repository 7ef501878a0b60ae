"""H-infinity mixed sensitivity for the sampled arm and its delay, its order reduced.

    A, B, C, D = design([60.0, 60.0, 0.05, 0.0, 300.0, 5.0, 1000.0, 0.5], model)
    found = designed(knobs, model)       # with gamma, the bound of the reduction, and the whole one

Both joints at once, since the arm's inertia couples them: from (e1, e2, v) and the integrals of the
errors to two torques. In the problem's form of four blocks, kept small is the norm from

    torques at the input, (J w^2) d, and noise of what is measured

to the joints' errors, (1 + integral w_j/s) (e - aim v/(r+L) (0, 1)), which weighs G S on the
torques and T on the noise, and to the torques over J w^2, times a weight that rises from 1 at
`roll_off` to TOP at TOP times that, which weighs K S on the noise and T on the torques. S itself is
weighed through G S: where G has the slope 1/(J s^2), keeping G S J w^2 small keeps S below (s/w)^2.
With disturbances at the input the controller damps the beam's modes rather than cancels them.

The usual care for poles on the imaginary axis, the rigid joints', and for the integrators: the
integrals are measured, so that no weight has a pole that the controller does not see; and the unit
circle is shrunk to exp(-decay T), which leaves no pole on it and asks every pole of the closed loop
to decay by `decay` at least. The bound on the norm then holds on the unit circle, too.

The sampled plant is made continuous by the bilinear map, which keeps norms, and the controller is
sampled by its inverse. Balanced truncation then drops the states that matter least, by the bound of
its error, as long as the whole loop still decays by KEPT of `decay`; integrators are kept.

Unlike the other designs, this one is not the same to the bit on every machine: a sampled arm, and
its Riccati equations near the least gamma, keep nine or ten digits. On two kernels of OpenBLAS the
responses of 22 designs differ by 6e-6 of their size in the median, by 8e-4 at most, reduced ones by
4e-5 and 1e-3; gamma and orders are equal.

Source: H. Kwakernaak, Robust control and H-infinity optimization - tutorial paper, Automatica 29
(1993) 255-273, for mixed sensitivity and the poles it cancels; M. G. Safonov, Imaginary-axis zeros
in multivariable H-infinity optimal control, 1987, for shifting the axis; what they say is from
memory, not checked against the prints. Weights of our own.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from controllers.errors import ControllerError
from controllers.knobs import Knob
from controllers.model_based.hinf import Plant, synthesised, to_continuous, to_sampled
from controllers.model_based.lqg import with_integrals
from controllers.model_based.model import (
    SIGNS,
    LinearModel,
    Space,
    closed_loop,
    read_knobs,
    solved,
    spectral_radius,
    unit_torques,
    without_unstable_poles,
)
from controllers.model_based.reduction import Balanced, balanced
from controllers.series import Array

KNOBS = (
    Knob("bandwidth_1", "rad/s", 15.0, 250.0, True),
    Knob("bandwidth_2", "rad/s", 15.0, 250.0, True),
    Knob("integral", "-", 1e-3, 0.3, True),
    Knob("aim", "-", -1.0, 1.0, False),
    Knob("observer", "rad/s", 80.0, 2000.0, True),
    Knob("v_noise", "-", 1.0, 30.0, True),
    Knob("roll_off", "rad/s", 150.0, 3000.0, True),
    Knob("decay", "1/s", 0.1, 20.0, True),
)
"""Both joints' bandwidths; integral action as a share of them; share of v/(r+L) in joint 2's error;
where noise outweighs disturbances; noise of v as a multiple of what the model has beside that of
angles; where the torques' weight rises; least decay of the loop."""

TOP = 10.0
"""By how much the torques' weight rises."""
SLACK = 1.05
"""Of gamma: the controller is not the optimal one, whose poles run away."""
ERROR = 0.01
"""Largest bound of the reduction's error, relative to the largest Hankel singular value."""
KEPT = 0.5
"""Share of `decay` that the loop of a reduced controller must keep."""


@dataclass(frozen=True, eq=False)
class Designed:
    """A controller of H-infinity.

    Attributes:
        controller: (A, B, C, D) from (e1, e2, v) to two torques, reduced. whole: unreduced.
        gamma: what the norm of the weighted loop of the whole one is below.
        order: states kept, integrators apart. bound: on the norm of what was dropped, inputs over
            their noise and outputs over J w^2.
        plant: the generalised plant, sampled, of the shrunk circle; inner: the whole controller in
            its loop, from (e1, e2, v, integrals).
    """

    controller: Space
    whole: Space
    gamma: float
    order: int
    bound: float
    plant: Plant
    inner: Space


def design(knobs: Sequence[float], model: LinearModel) -> Space:
    """Return (A, B, C, D) from (e1, e2, v) to two torques; see `designed`."""
    return designed(knobs, model).controller


def designed(knobs: Sequence[float], model: LinearModel) -> Designed:
    """Return the controller with what is known of it.

    Args:
        knobs: in the order of `KNOBS`. model: of n states, delay included.

    Raises:
        ControllerError: a knob is missing or out of its range, nothing stabilises the loop, or the
            controller would be unstable by itself.
    """
    w1, w2, integral, aim, observer, v_noise, roll_off, decay = read_knobs(knobs, KNOBS)
    w = np.array([w1, w2])
    shrunk = float(np.exp(-decay * model.period))
    noise, units = noises(model, w, observer, v_noise), unit_torques(model, (w1, w2))
    plant = generalised(model, w, integral, aim, noise, roll_off, shrunk)
    rate = 2.0 / (model.period * float(np.sqrt(w1 * w2)))  # time in units of the bandwidths
    inner, gamma = _sampled_controller(plant, rate)
    A, B, C, D = inner
    inner = shrunk * A, shrunk * B, C, D  # back on the true circle
    whole = without_unstable_poles(_with_integrators(inner, model.period), "H-infinity controller")
    controller, order, bound = _reduced(inner, noise, units, model, shrunk**KEPT)
    return Designed(controller, whole, gamma, order, bound, plant, inner)


def _reduced(
    inner: Space, noise: Array, units: Array, model: LinearModel, radius: float
) -> tuple[Space, int, float]:
    """Return the controller of the fewest states whose loop has no pole beyond a radius, how many
    they are without the integrators, and the bound on what is left out.
    """
    A, B, C, D = inner
    found = balanced((A, B * noise, solved(units, C), solved(units, D) * noise))
    for order in _orders(found):
        A, B, C, D = found.truncated(order)
        small = _with_integrators((A, B / noise, units @ C, units @ D / noise), model.period)
        controller = _holding(small, model, radius)
        if controller is not None:
            return controller, order, float(found.bounds[order])
    raise ControllerError(
        "the H-infinity controller of these knobs does not hold its own model to working "
        "precision; choose lower bandwidths"
    )


def _orders(found: Balanced) -> range:
    """Return the orders to try, least first."""
    first = int(np.argmax(found.bounds <= ERROR * found.values[0]))
    return range(first, len(found.values) + 1)


def _holding(controller: Space, model: LinearModel, radius: float) -> Space | None:
    """Return a controller, rounded, None if its loop has a pole beyond a radius or it one of its
    own beyond 1.
    """
    try:
        controller = without_unstable_poles(controller, "controller")
    except ControllerError:
        return None
    return controller if spectral_radius(closed_loop(controller, model)) <= radius else None


def _sampled_controller(plant: Plant, rate: float) -> tuple[Space, float]:
    """Return the controller of a sampled generalised plant, and its gamma."""
    m1, p1 = plant.B1.shape[1], len(plant.C1)
    B, C = np.hstack([plant.B1, plant.B2]), np.vstack([plant.C1, plant.C2])
    D = np.block([[plant.D11, plant.D12], [plant.D21, plant.D22]])
    A, B, C, D = to_continuous((plant.A, B, C, D), rate)
    parts = B[:, :m1], B[:, m1:], C[:p1], C[p1:], D[:p1, :m1], D[:p1, m1:], D[p1:, :m1], D[p1:, m1:]
    found, gamma = synthesised(Plant(A, *parts), slack=SLACK)
    return to_sampled(found, rate), gamma


def noises(model: LinearModel, w: Array, observer: float, v_noise: float) -> Array:
    """Return the sizes (5,) of what (e1, e2, v) and the integrals are off by, for disturbances 1.

    Angles: (w/observer)^2; v: v_noise times what the model's noise is to that of angles; integrals:
    angles over w.
    """
    angles = (w / observer) ** 2
    v = v_noise * angles[1] * model.noise[2] / model.noise[1]
    return np.concatenate([angles, [v], angles / w])


def generalised(
    model: LinearModel,
    w: Array,
    integral: float,
    aim: float,
    noise: Array,
    roll_off: float,
    shrunk: float,
) -> Plant:
    """Return the sampled generalised plant, on a unit circle that is the true one's `shrunk` part.

    Inputs w: (torques, noise) (7,). Outputs z: (errors, torques) (4,); y: (e1, e2,
    v, integrals) (5,). Its states: the model's, the integrals, and two of the torques' weight.

    Args: as the knobs of these names; w (2,) bandwidths, noise (5,) see `noises`.
    """
    n, units = len(model.A), unit_torques(model, (float(w[0]), float(w[1])))
    Ai, Bi = with_integrals(model)
    f, g, h, d = _rising(roll_off, model.period)
    over = np.linalg.inv(units)
    A = np.zeros((n + 4, n + 4))
    A[: n + 2, : n + 2], A[n + 2 :, n + 2 :] = Ai, f * np.eye(2)
    B2 = np.vstack([Bi, g * over])
    B1 = np.zeros((n + 4, 7))
    B1[:n, :2] = model.B @ units
    C2 = np.zeros((5, n + 4))
    C2[:3, :n], C2[3:, n : n + 2] = SIGNS[:, None] * model.C, np.eye(2)
    C1 = np.zeros((4, n + 4))
    C1[:2] = C2[:2]
    C1[1] -= aim / model.reach * C2[2]
    C1[:2, n : n + 2] = np.diag(integral * w)
    C1[2:, n + 2 :] = h * np.eye(2)
    D12 = np.vstack([np.zeros((2, 2)), d * over])
    D21 = np.hstack([np.zeros((5, 2)), np.diag(noise)])
    return Plant(
        A / shrunk, B1 / shrunk, B2 / shrunk, C1, C2, np.zeros((4, 7)), D12, D21, np.zeros((5, 2))
    )


def _rising(corner: float, period: float) -> tuple[float, float, float, float]:
    """Return a, b, c, d of (1 + s/corner)/(1 + s/(TOP corner)), sampled by Tustin's rule."""
    fast = TOP * corner
    A, B, C, D = to_sampled(
        (np.array([[-fast]]), np.array([[1.0]]), np.array([[fast * (1.0 - TOP)]]), np.eye(1) * TOP),
        2.0 / period,
    )
    return float(A[0, 0]), float(B[0, 0]), float(C[0, 0]), float(D[0, 0])


def _with_integrators(inner: Space, period: float) -> Space:
    """Return a controller from (e1, e2, v, integrals) as one from (e1, e2, v), integrals last."""
    A, B, C, D = inner
    n = len(A)
    whole = np.eye(n + 2)
    whole[:n, :n], whole[:n, n:] = A, B[:, 3:]
    into = np.vstack([B[:, :3], period * np.eye(2, 3)])
    return whole, into, np.hstack([C, D[:, 3:]]), D[:, :3].copy()
