"""Regulator and filter against closed forms; LQG's margins, separation and integral action."""

import numpy as np
import pytest
from designs import PERIOD, arm_model, response, rigid_model, same_set
from numpy.typing import NDArray
from scipy.linalg import solve_discrete_lyapunov

from controllers import ControllerError
from controllers.model_based import LinearModel, lqg
from controllers.model_based.model import SIGNS, closed_loop
from controllers.model_based.riccati import filter_gain, regulator

EXACT = 1e-10  # relative, of a Riccati equation of one state
FINE = 1e-5  # [s], a period at which a sampled design is nearly the continuous one
NEAR = 2e-3  # relative, what that leaves
SAME = 1e-7  # poles found in two ways
KNOBS = (60.0, 40.0), 0.05, 0.3, 0.5
SCALAR = 0.9, 0.4, 2.0, 3.0


def squared(x: float) -> NDArray[np.float64]:
    return np.array([[x]])


def test_regulator_of_one_state() -> None:
    """X = q + a^2 X - a^2 b^2 X^2/(r + b^2 X), a quadratic equation in X."""
    a, b, q, r = SCALAR
    half = (r * (1 - a**2) - b**2 * q) / 2
    X = (-half + np.sqrt(half**2 + b**2 * q * r)) / b**2
    K = regulator(squared(a), squared(b), squared(q), squared(r))
    assert K[0, 0] == pytest.approx(a * b * X / (r + b**2 * X), rel=EXACT)


def test_filter_of_one_state() -> None:
    """P = w + a^2 P v/(v + c^2 P), before a measurement is used."""
    a, c, w, v = SCALAR
    half = (v * (1 - a**2) - c**2 * w) / 2
    P = (-half + np.sqrt(half**2 + c**2 * w * v)) / c**2
    M = filter_gain(squared(a), squared(w), squared(c), squared(v))
    assert M[0, 0] == pytest.approx(P * c / (v + c**2 * P), rel=EXACT)


def test_what_cannot_be_moved_or_seen_is_refused() -> None:
    A, one = np.diag([1.2, 0.5]), np.eye(1)
    with pytest.raises(ControllerError, match="no stabilising solution"):
        regulator(A, np.array([[0.0], [1.0]]), np.eye(2), one)
    with pytest.raises(ControllerError, match="no stable solution"):
        filter_gain(A, np.eye(2), np.array([[0.0, 1.0]]), one)


def test_a_rigid_arm_gets_its_bandwidths_and_is_decoupled() -> None:
    """Double integrators under 1/w^4 u^2 + y^2: K = J (w^2, sqrt(2) w), the weight of u small."""
    (w1, w2), model = KNOBS[0], rigid_model(FINE)
    K = lqg.servo_gain(model, (w1, w2), 1e-9)[:, :4]
    w = np.array([w1, w2])
    wanted = np.hstack([model.J * w**2, model.J * (np.sqrt(2) * w)])
    assert K == pytest.approx(wanted, rel=NEAR)
    poles = np.log(np.linalg.eigvals(model.A - model.B @ K)) / FINE
    ideal = np.array([w1, w2])[:, None] * np.exp(1j * np.pi * np.array([0.75, -0.75]))
    assert same_set(poles, ideal.ravel()) < NEAR * w1


def test_integral_action_has_its_share_of_the_bandwidth() -> None:
    share, model = 0.01, rigid_model(FINE)
    K = lqg.servo_gain(model, KNOBS[0], share)
    A, B = lqg.with_integrals(model)
    slow = np.sort(np.abs(np.log(np.linalg.eigvals(A - B @ K)) / FINE))[:2]
    assert slow == pytest.approx(share * np.sort(KNOBS[0]), rel=5e-3)


def test_the_observers_bandwidth_is_a_rigid_arms() -> None:
    speed, model = 200.0, rigid_model(FINE)
    M = lqg.observer_gain(model, speed)
    poles = np.log(np.linalg.eigvals(model.A @ (np.eye(4) - M @ model.C))) / FINE
    ideal = speed * np.exp(1j * np.pi * np.array([0.75, 0.75, -0.75, -0.75]))
    assert same_set(poles, ideal) < NEAR * speed


@pytest.fixture(scope="module")
def model() -> LinearModel:
    return arm_model()


def test_poles_are_the_regulators_and_the_filters(model: LinearModel) -> None:
    K, M = lqg.servo_gain(model, *KNOBS), lqg.observer_gain(model, 400.0)
    A, B = lqg.with_integrals(model)
    wanted = [np.linalg.eigvals(A - B @ K), np.linalg.eigvals(model.A @ (np.eye(16) - M @ model.C))]
    found = np.linalg.eigvals(closed_loop(lqg.compensator(model, K, M), model))
    # those of the torques on their way lie at 0, twice and more, where digits are lost
    both = np.concatenate(wanted)
    chosen = [poles[np.abs(poles) > 0.1] for poles in (found, both)]
    assert same_set(*chosen) < SAME
    assert np.abs(both).max() < 1.0


def test_return_difference_of_the_regulator(model: LinearModel) -> None:
    """(1 + L)* (R + B'X B) (1 + L) = R + |weighted states|^2, so that the least singular value of
    1 + L is not far below 1, in torques of equal weight.
    """
    K, (seen, over) = lqg.servo_gain(model, *KNOBS), lqg.servo_weights(model, *KNOBS)
    (A, B), units = lqg.with_integrals(model), np.linalg.inv(over)
    B, K = B @ units, over @ K  # torques of weight 1
    z = np.exp(1j * np.linspace(0.002, np.pi, 400))
    F = np.eye(2) + response((A, B, K, np.zeros((2, 2))), z)
    G = response((A, B, seen, np.zeros((5, 2))), z)
    right = np.eye(2) + np.swapaxes(G.conj(), 1, 2) @ G
    inner = np.linalg.inv(F)
    S = np.swapaxes(inner.conj(), 1, 2) @ right @ inner  # R + B'X B: at all z the same
    assert S.real == pytest.approx(np.broadcast_to(S[0].real, S.shape), rel=1e-5, abs=1e-5)
    assert np.abs(S.imag).max() < 1e-5
    least = np.linalg.svd(F, compute_uv=False)[:, -1].min()
    assert least >= 1 / np.sqrt(np.linalg.eigvalsh(S[0].real)[-1]) - 1e-6
    assert least > 0.8


def test_margins_of_the_regulator_sampled_fast() -> None:
    """A double integrator's: 65.5 degrees at w sqrt(1 + sqrt 2), a gain of 1/2 and of 4."""
    model, w = rigid_model(FINE, np.eye(2)), 50.0
    K = lqg.servo_gain(model, (w, w), 1e-9)[:1, :4]
    crossover = w * np.sqrt(1 + np.sqrt(2))
    z = np.exp(1j * FINE * np.array([crossover]))
    L = response((model.A, model.B[:, :1], K, np.zeros((1, 1))), z)[0, 0, 0]
    assert abs(L) == pytest.approx(1.0, rel=NEAR)
    margin = np.degrees(np.angle(-L))
    assert margin == pytest.approx(np.degrees(np.arctan(np.sqrt(2 + 2 * np.sqrt(2)))), abs=0.1)
    assert margin > 60.0
    for gain in (0.5, 4.0):
        moved = model.A - gain * model.B[:, :1] @ K
        moved -= model.B[:, 1:] @ lqg.servo_gain(model, (w, w), 1e-9)[1:, :4]
        assert np.abs(np.linalg.eigvals(moved)).max() < 1.0


def still(model: LinearModel, K: NDArray[np.float64], integrates: bool) -> float:
    """The largest error that a constant torque of 1 N m leaves [rad]."""
    controller = lqg.compensator(model, K, lqg.observer_gain(model, 400.0))
    whole = closed_loop(controller, model)
    if not integrates:
        whole = whole[:-2, :-2]
    into, out = np.zeros((len(whole), 2)), np.zeros((2, len(whole)))
    into[: len(model.B)], out[:, : len(model.A)] = model.B, (SIGNS[:, None] * model.C)[:2]
    found = out @ np.linalg.solve(np.eye(len(whole)) - whole, into)
    return float(np.abs(found).max())


def test_a_constant_torque_leaves_no_error(model: LinearModel) -> None:
    scale = 1 / (model.J[1, 1] * KNOBS[0][1] ** 2)  # of a proportional controller
    K = lqg.servo_gain(model, *KNOBS)
    assert still(model, K, integrates=True) < 1e-9 * scale
    K[:, -2:] = 0.0  # the negative control: without the integrals' gains
    assert still(model, K, integrates=False) > 0.1 * scale


def cost(model: LinearModel, K: NDArray[np.float64], aim: float) -> float:
    """The sum of the weighted squares from random states, by Lyapunov's equation."""
    seen, over = lqg.servo_weights(model, (50.0, 50.0), 0.01, aim, 0.5)
    A, B = lqg.with_integrals(model)
    loop, weight = A - B @ K, seen.T @ seen + K.T @ over.T @ over @ K
    return float(np.trace(solve_discrete_lyapunov(loop.T, weight)))


def test_every_aim_has_the_least_of_its_own_cost(model: LinearModel) -> None:
    aims = (-1.0, 0.0, 1.0)
    gains = [lqg.servo_gain(model, (50.0, 50.0), 0.01, aim, 0.5) for aim in aims]
    costs = np.array([[cost(model, K, aim) for K in gains] for aim in aims])
    assert (costs.argmin(axis=1) == [0, 1, 2]).all()
    assert (costs[np.triu_indices(3, 1)] > 1.0001 * np.diag(costs)[[0, 0, 1]]).all()


def test_the_tip_is_theta2_and_v_over_the_reach(model: LinearModel) -> None:
    seen, _ = lqg.servo_weights(model, (50.0, 50.0), 0.01, 1.0, 0.5)
    tip = model.C[1] + model.C[2] / model.reach
    assert seen[1, : len(tip)] == pytest.approx(-tip)


def test_the_less_v_is_believed_the_less_it_moves_the_estimate(model: LinearModel) -> None:
    gains = [np.linalg.norm(lqg.observer_gain(model, 400.0, x)[:, 2]) for x in (1.0, 3.0, 30.0)]
    assert gains[0] > 1.5 * gains[1] > 1.5**2 * gains[2]
    none = lqg.observer_gain(model, 400.0, 1e4)
    alone = filter_gain(  # as if v were not measured
        model.A, *_drive_and_angles(model, 400.0), np.diag(model.noise[:2] ** 2)
    )
    assert none[:, :2] == pytest.approx(alone, rel=1e-3, abs=1e-3 * np.abs(alone).max())


def _drive_and_angles(
    model: LinearModel, observer: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    size = observer**2 * model.noise[:2] / np.sqrt(2)
    drive = np.hstack([model.B @ (model.J * size), model.E * size])
    return drive @ drive.T, model.C[:2]


def test_weight_on_the_beams_rate_makes_less_of_it(model: LinearModel) -> None:
    """The sum of v'^2 from random states falls, that of everything else grows."""
    rate = (model.C[2] @ (model.A - np.eye(len(model.A))) / PERIOD)[None, :]
    rate = np.pad(rate, ((0, 0), (0, 2)))
    A, B = lqg.with_integrals(model)

    def sums(vibration: float) -> tuple[float, float]:
        K = lqg.servo_gain(model, (40.0, 40.0), 0.01, 0.0, vibration)
        loop = A - B @ K
        shaken = float(np.trace(solve_discrete_lyapunov(loop.T, rate.T @ rate)))
        seen, over = lqg.servo_weights(model, (40.0, 40.0), 0.01, 0.0, 0.0)
        rest = seen.T @ seen + K.T @ over.T @ over @ K
        return shaken, float(np.trace(solve_discrete_lyapunov(loop.T, rest)))

    (much, least), (less, more) = sums(0.01), sums(3.0)
    assert less < 0.7 * much and more > 1.1 * least
