"""H-infinity for the arm: the promised norm and decay, the reduction, and how the weights act."""

import numpy as np
import pytest
from designs import PERIOD, arm_model, circle, closed, response
from numpy.typing import NDArray

from controllers.model_based import LinearModel, middle, mixed_sensitivity
from controllers.model_based.hinf import Plant
from controllers.model_based.mixed_sensitivity import KNOBS, Designed, designed, noises
from controllers.model_based.model import Space, closed_loop, spectral_radius, unit_torques

NAMES = [knob.name for knob in KNOBS]
ROUNDED = 1e-5  # relative: coefficients of 10 digits, and the sweep's
MODES = 3


def knobs(**changed: float) -> list[float]:
    return list((dict(zip(NAMES, middle(KNOBS), strict=True)) | changed).values())


@pytest.fixture(scope="module")
def model() -> LinearModel:
    return arm_model(modes=MODES)


@pytest.fixture(scope="module")
def found(model: LinearModel) -> Designed:
    return designed(knobs(), model)


def norm(plant: Plant, K: Space) -> float:
    """Largest singular value from w to z on the unit circle, poles all within it."""
    loop = closed(plant, K)
    assert spectral_radius(loop[0]) < 1.0
    return float(np.linalg.svd(response(loop, circle(4000, 1e-6)), compute_uv=False).max())


def test_the_weighted_loop_is_below_gamma_on_both_circles(found: Designed) -> None:
    shrunk = np.exp(-knobs()[-1] * PERIOD)
    A, B, C, D = found.inner
    worst = norm(found.plant, (A / shrunk, B / shrunk, C, D))
    assert 0.7 * found.gamma < worst <= found.gamma * (1 + ROUNDED)
    plant = found.plant
    true = plant._replace(A=plant.A * shrunk, B1=plant.B1 * shrunk, B2=plant.B2 * shrunk)
    assert norm(true, found.inner) <= worst * (1 + ROUNDED)
    assert norm(true, (A, B, 0.5 * C, 0.5 * D)) > found.gamma  # another controller is not within it


@pytest.mark.parametrize("decay", [0.2, 4.0])
def test_every_pole_decays_as_asked(decay: float, model: LinearModel) -> None:
    got = designed(knobs(decay=decay, integral=0.3), model)
    radius = spectral_radius(closed_loop(got.whole, model))
    assert radius <= np.exp(-decay * PERIOD) * (1 + 1e-9)
    kept = spectral_radius(closed_loop(got.controller, model))
    assert kept <= np.exp(-0.5 * decay * PERIOD)


def test_the_reduction_is_within_its_bound(found: Designed, model: LinearModel) -> None:
    values = dict(zip(NAMES, knobs(), strict=True))
    w = np.array([values["bandwidth_1"], values["bandwidth_2"]])
    noise, units = (
        noises(model, w, values["observer"], values["v_noise"]),
        unit_torques(model, tuple(w)),
    )
    n = len(found.whole[0]) - 2
    assert found.order < n and len(found.controller[0]) == found.order + 2

    def direct(system: Space) -> NDArray[np.complex128]:
        """From (e1, e2, v), integrators cut off: they are the same."""
        A, B, C, D = system
        return response((A[:-2, :-2], B[:-2], C[:, :-2], D), circle(4000, 1e-6))

    apart = np.linalg.solve(units, direct(found.whole) - direct(found.controller)) * noise[:3]
    error = float(np.linalg.svd(apart, compute_uv=False).max())
    assert 0.0 < error <= found.bound * (1 + ROUNDED)
    size = np.linalg.svd(np.linalg.solve(units, direct(found.whole)) * noise[:3], compute_uv=False)
    assert found.bound < 0.05 * size.max()


def test_a_wider_bandwidth_resists_more(model: LinearModel) -> None:
    """A constant torque leaves no error; a torque of 1 rad/s leaves less of it."""
    z = np.exp(1j * PERIOD * np.array([1e-4, 1.0]))

    def compliance(width: float) -> NDArray[np.float64]:
        controller = mixed_sensitivity.design(
            knobs(bandwidth_1=width, bandwidth_2=width, integral=0.1), model
        )
        whole = closed_loop(controller, model)
        into, out = np.zeros((len(whole), 2)), np.zeros((2, len(whole)))
        into[: len(model.B)], out[:, : len(model.A)] = model.B, model.C[:2]
        loop = response((whole, into, out, np.zeros((2, 2))), z)
        return np.asarray(np.linalg.svd(loop, compute_uv=False)[:, 0])

    slow, fast = compliance(40.0), compliance(80.0)
    assert (fast < 0.5 * slow).all()
    assert slow[0] < 1e-3 * slow[1]


def test_outputs_are_the_errors_and_their_integrals(model: LinearModel) -> None:
    """Of a state with all joints at rest but one thing moved: what the weights make of it."""
    w, n = np.array([50.0, 40.0]), len(model.A)
    plant = mixed_sensitivity.generalised(model, w, 0.1, -0.5, np.ones(5), 500.0, 1.0)
    x = np.zeros((n + 4, 3))
    x[0, 0], x[n + 1, 1] = 1.0, 1.0  # theta1; the second integral
    x[2:5, 2] = 1.0  # modes
    v = model.C[2, 2:5].sum()
    wanted = np.array([[-1.0, 0.0], [0.0, 0.1 * 40.0], [0.0, 0.5 / model.reach * v]])
    assert (plant.C1 @ x)[:2].T == pytest.approx(wanted)
    assert (plant.C2 @ x)[:, 2] == pytest.approx([0.0, 0.0, v, 0.0, 0.0])


def test_the_weight_on_torques_rises_tenfold(model: LinearModel) -> None:
    plant = mixed_sensitivity.generalised(
        model, np.array([50.0, 40.0]), 0.1, 0.0, np.ones(5), 50.0, 1.0
    )
    units = unit_torques(model, (50.0, 40.0))
    at = np.exp(1j * PERIOD * np.array([1e-3, 50.0])).tolist()
    weight = (plant.A[-2:, -2:], plant.B2[-2:], plant.C1[2:, -2:], plant.D12[2:])
    low, corner, high = response(weight, np.array([*at, -1.0 + 0j])) @ units
    assert np.abs(low) == pytest.approx(np.eye(2), abs=1e-6)
    assert np.abs(corner) == pytest.approx(np.sqrt(2 / 1.01) * np.eye(2), abs=1e-3)
    assert np.abs(high) == pytest.approx(10.0 * np.eye(2), abs=1e-6)


def test_roll_off_takes_gain_where_the_model_ends(model: LinearModel) -> None:
    high = np.exp(1j * np.array([2.0, 2.8]))

    def gain(corner: float) -> float:
        K = response(mixed_sensitivity.design(knobs(roll_off=corner), model), high)
        return float(np.linalg.svd(K[:, :, :2], compute_uv=False).max())

    assert gain(200.0) < 0.5 * gain(3000.0)


def test_the_less_v_is_believed_the_less_it_moves_the_torques(model: LinearModel) -> None:
    at = np.exp(1j * PERIOD * np.geomspace(20.0, 1000.0, 40))

    def gain(v_noise: float) -> float:
        K = response(mixed_sensitivity.design(knobs(v_noise=v_noise), model), at)
        return float(np.linalg.norm(K[:, 1, 2]))

    assert gain(1.0) > 1.5 * gain(30.0)
