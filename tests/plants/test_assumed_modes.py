"""The consistent assumed modes: an independent Lagrangian, conservation, orders, reductions."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss
from scipy.optimize import fsolve

from flexsim import Parameters
from flexsim.arm.beam import beta_lengths
from flexsim.arm.free_arm import joint_free_frequencies
from flexsim.loop.runs import drive
from flexsim.loop.settings import setting
from flexsim.plants.assumed_modes import (
    AssumedModes,
    acceleration,
    assumed_modes,
    energy,
    free_frequencies,
    mass_matrix,
)
from flexsim.plants.modes_plant import AssumedModesPlant

PARAMETERS = Parameters()
CONSERVATIVE = Parameters(F_1=0.0, F_2=0.0, zeta=0.0)
FREE = setting("none")
COMPLEX_STEP = 1e-30  # differences nothing, so its only error is rounding
ROUNDING = 1e-10  # relative to the largest acceleration; the 2x2 solve loses up to three digits
BALANCE = 1e-12  # relative to the sum of the terms' sizes; rounding
DRIFT = 1e-10  # relative, of energy over 2 s of RK4 at 1 ms; RK4's damping of mode 3: 2.6e-11
DRIFT_ONE_MODE = 1e-13  # with n = 1 RK4's damping is below rounding: 5e-15
MOMENTUM = 1e-10  # relative, over the same motions; RK4 keeps it to its fifth order
GENTLE = np.array([0.2, 0.1])  # [rad/s] joint rates


class Lagrangian:
    """T and V straight from the velocity of the beam's elements, (15) as printed, by quadrature.

    Orders in eta and its rate are kept apart, as (3, points), and products cut after the second.
    Damping is Kelvin-Voigt's: what bends, resists with eta times the rate of bending.
    """

    def __init__(self, parameters: Parameters, n: int) -> None:
        self.p, self.n = parameters, n
        p = parameters
        node, weight = leggauss(60)
        u = (node + 1) / 2
        self.x, self.weight = p.r + u * p.L, weight / 2 * p.L
        self.b = np.array(beta_lengths(n))
        self.chi, _, self.chi_xx = self.shapes(u)
        # int_r^x chi_i' chi_j' for every quadrature point x
        inner = self.shapes(u[:, None] * u)[1]  # (points, inner points, n)
        self.slope = np.einsum("k,mki,mkj->mij", self.weight, inner, inner) * u[:, None, None]

    def shapes(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        b, by = self.b, self.b * u[..., None]
        q = (np.cosh(b) + np.cos(b)) / (np.sinh(b) + np.sin(b))
        chi = np.cosh(by) - np.cos(by) - q * (np.sinh(by) - np.sin(by))  # (15)
        chi_x = np.sinh(by) + np.sin(by) - q * (np.cosh(by) - np.cos(by))
        chi_xx = np.cosh(by) + np.cos(by) - q * (np.sinh(by) + np.sin(by))
        return chi, chi_x * b / self.p.L, chi_xx * (b / self.p.L) ** 2

    def kinetic(self, q: np.ndarray, w: np.ndarray) -> complex:
        p, x = self.p, self.x
        eta, rate = q[2:], w[2:]
        w1, wb = w[0], w[0] + w[1]
        one = np.ones_like(x)
        v, v_rate = self.chi @ eta, self.chi @ rate
        u = -np.einsum("mij,i,j->m", self.slope, eta, eta) / 2
        u_rate = -np.einsum("mij,i,j->m", self.slope, eta, rate)
        along = np.array([p.L_R * w1 * np.sin(q[1]) * one, -wb * v, u_rate])
        across = np.array([p.L_R * w1 * np.cos(q[1]) * one + wb * x, v_rate, wb * u])
        squared = sum(a[0] ** 2 + 2 * a[0] * (a[1] + a[2]) + a[1] ** 2 for a in (along, across))
        rigid = (p.I_m1 + p.I_R0 + p.m_H * p.L_R**2) * w1**2 + p.I_H * wb**2 + p.I_m2 * w[1] ** 2
        total: complex = rigid / 2 + p.rho / 2 * self.weight @ squared
        return total

    def momentum(self, q: np.ndarray, w: np.ndarray) -> np.ndarray:
        """dT/dw, exact as T is quadratic in w."""
        unit = np.eye(len(w))
        return np.array([(self.kinetic(q, w + e) - self.kinetic(q, w - e)) / 2 for e in unit])

    def acceleration(self, q: np.ndarray, w: np.ndarray, tau: np.ndarray) -> np.ndarray:
        p, m = self.p, len(q)
        unit = np.eye(m)
        H = np.array([self.momentum(q, e) for e in unit])
        h = 1j * COMPLEX_STEP
        transport = self.momentum(q + h * w, w.astype(complex)).imag / COMPLEX_STEP
        gradient = np.array([self.kinetic(q + h * e, w).imag for e in unit]) / COMPLEX_STEP
        bending = p.EI * np.einsum("m,mi,mj->ij", self.weight, self.chi_xx, self.chi_xx)
        force = np.zeros(m)
        force[:2] = tau * (p.r_1, p.r_2)
        force[:2] -= np.array([p.F_1 * p.r_1**2, p.F_2 * p.r_2**2]) * w[:2]
        force[2:] = -bending @ (q[2:] + p.eta * w[2:])
        solution: np.ndarray = np.linalg.solve(H, force - transport + gradient)
        return solution


def accelerations(p: AssumedModes, q: np.ndarray, w: np.ndarray, tau: np.ndarray) -> np.ndarray:
    a = np.empty_like(q)
    acceleration(p, q, w, tau[0], tau[1], a, np.empty(len(q) - 2))
    return a


def random_state(seed: int, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return q, w, tau far from rest: deflections of centimetres, several rad/s, some N m."""
    random = np.random.default_rng(seed)
    q = np.concatenate([random.uniform(-3, 3, 2), random.normal(0, 0.02, n) / np.arange(1, n + 1)])
    w = np.concatenate([random.normal(0, 4, 2), random.normal(0, 0.5, n)])
    return q, w, random.normal(0, 2, 2)


def start(
    plant: AssumedModesPlant, rates: np.ndarray, eta_1: float = 0.0, theta2: float = 1.2
) -> np.ndarray:
    state = plant.rest_state((0.0, theta2))
    state[2] = eta_1
    m = plant.modes + 2
    state[m : m + 2] = rates
    return state


@pytest.mark.parametrize("n", [1, 2, 3, 5])
@pytest.mark.parametrize(
    "parameters",
    [PARAMETERS, Parameters(I_m1=0.1, I_m2=0.03, r_1=2.0, r_2=0.5, F_1=0.3, F_2=0.7, r=0.2)],
    ids=["paper", "all-terms"],
)
def test_acceleration_is_lagranges_of_the_beams_elements(parameters: Parameters, n: int) -> None:
    lagrangian, p = Lagrangian(parameters, n), assumed_modes(parameters, n)
    for seed in range(10):
        q, w, tau = random_state(seed, n)
        expected = lagrangian.acceleration(q, w, tau)
        found = accelerations(p, q, w, tau)
        np.testing.assert_allclose(found, expected, atol=ROUNDING * np.abs(expected).max())


def test_the_comparison_sees_a_missing_second_order_term() -> None:
    """Control: without the shortening (M = N = 0) the same comparison is off by percents."""
    lagrangian, p = Lagrangian(PARAMETERS, 3), assumed_modes(PARAMETERS, 3)
    broken = p._replace(M=0 * p.M, N=0 * p.N)
    q, w, tau = random_state(1, 3)
    expected = lagrangian.acceleration(q, w, tau)
    off = np.abs(accelerations(broken, q, w, tau) - expected).max() / np.abs(expected).max()
    assert off > 1e-3


@pytest.mark.parametrize("n", [1, 3, 5])
def test_mass_matrix_is_that_of_the_kinetic_energy(n: int) -> None:
    lagrangian, p = Lagrangian(PARAMETERS, n), assumed_modes(PARAMETERS, n)
    for seed in range(5):
        q, w, _ = random_state(seed, n)
        H = mass_matrix(p, q)
        np.testing.assert_array_equal(H, H.T)
        expected = lagrangian.momentum(q, w)
        np.testing.assert_allclose(H @ w, expected, atol=ROUNDING * np.abs(expected).max())


@pytest.mark.parametrize("seed", range(5))
def test_power_of_torque_and_friction_is_the_rate_of_energy(seed: int) -> None:
    """dE/dt = sum r_i tau_i w_i - F_i r_i^2 w_i^2 - eta' D eta' at any state, exactly."""
    parameters = Parameters(r_1=1.7, r_2=0.6, F_1=0.2, F_2=0.3)
    n, p = 3, assumed_modes(parameters, 3)
    q, w, tau = random_state(seed, n)
    a = accelerations(p, q, w, tau)
    moved = np.concatenate([q, w]) + 1j * COMPLEX_STEP * np.concatenate([w, a])
    rate = energy(p, moved[None])[0].imag / COMPLEX_STEP
    power = (
        tau @ (np.array([1.7, 0.6]) * w[:2]) - np.array([0.2 * 1.7**2, 0.3 * 0.6**2]) @ w[:2] ** 2
    )
    power -= w[2:] @ p.damping @ w[2:]
    terms = np.abs(w * (mass_matrix(p, q) @ a)).sum() + np.abs(power)
    assert abs(rate - power) < BALANCE * terms


@pytest.mark.parametrize("seed", range(5))
def test_torque_1_is_the_rate_of_the_momentum_about_joint_1(seed: int) -> None:
    n, p = 3, assumed_modes(CONSERVATIVE, 3)
    q, w, tau = random_state(seed, n)
    a = accelerations(p, q, w, tau)
    h = 1j * COMPLEX_STEP
    rate = (mass_matrix(p, q + h * w) @ (w + h * a))[0].imag / COMPLEX_STEP
    terms = np.abs(mass_matrix(p, q)[0] * a).sum()
    assert abs(rate - tau[0]) < BALANCE * terms


@pytest.mark.parametrize(("n", "drift"), [(1, DRIFT_ONE_MODE), (3, DRIFT)])
def test_energy_and_momentum_stay_over_two_seconds_of_free_motion(n: int, drift: float) -> None:
    plant = AssumedModesPlant(CONSERVATIVE, n)
    motion = drive(plant, FREE, np.zeros((2000, 2)), state=start(plant, GENTLE))
    assert np.abs(motion.energy / motion.energy[0] - 1).max() < drift
    p, m = plant.coefficients, n + 2
    momentum = np.array([(mass_matrix(p, s[:m]) @ s[m:])[0] for s in motion.state[::50]])
    assert np.ptp(momentum) < MOMENTUM * abs(momentum[0])
    assert np.ptp(motion.joint[:, 1]) > 0.1  # it did move


def test_energy_drift_has_fifth_order_in_the_step() -> None:
    """RK4 damps a mode by (omega h)^6/72 of its energy per step: h^5 per second."""
    steps = np.array([2e-3, 1e-3, 0.5e-3])
    drifts = []
    for step in steps:
        plant = AssumedModesPlant(CONSERVATIVE, 2, step)
        state = start(plant, np.array([1.0, -2.0]), eta_1=0.02)
        motion = drive(plant, FREE, np.zeros((50, 2)), period=0.02, state=state)
        drifts.append(1 - motion.energy[-1] / motion.energy[0])
    order = np.polyfit(np.log(steps), np.log(drifts), 1)[0]
    assert order == pytest.approx(5.0, abs=0.15)  # next order h^7 at omega h = 0.3


def test_rk4_has_fourth_order_under_torque() -> None:
    torque = [[0.3, 0.05]]

    def end(step: float) -> np.ndarray:
        plant = AssumedModesPlant(PARAMETERS, 1, step)
        state = start(plant, np.array([1.0, -1.0]), eta_1=0.01)
        final: np.ndarray = drive(plant, FREE, torque, period=0.2, state=state).state[-1]
        return final

    steps = np.array([4e-3, 2e-3, 1e-3, 0.5e-3])
    errors = [np.linalg.norm(end(step) - end(1e-3 / 16)) for step in steps]
    order = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert order == pytest.approx(4.0, abs=0.1)  # next order at omega h = 0.2


def test_held_torques_do_exactly_the_work_that_the_energy_gains() -> None:
    torque = np.column_stack([np.full(500, 0.3), np.full(500, -0.04)])
    plant = AssumedModesPlant(replace(CONSERVATIVE, r_1=2.0, r_2=0.5), 1)
    motion = drive(plant, FREE, torque, theta=(0.0, 1.2))
    work = np.sum(torque * (2.0, 0.5) * np.diff(motion.joint, axis=0))
    gained = motion.energy[-1] - motion.energy[0]
    assert gained > 0.05  # [J]
    assert work == pytest.approx(gained, rel=1e-7)  # RK4 at 1 ms: omega h = 0.05


def test_viscous_friction_takes_exactly_its_share() -> None:
    damped = Parameters(F_1=0.05, F_2=0.02)
    plant = AssumedModesPlant(damped, 1)
    motion = drive(plant, FREE, np.zeros((1000, 2)), state=start(plant, np.array([2.0, -3.0])))
    w = motion.state[:, 3:5]
    lost = np.trapezoid(w**2 @ (0.05, 0.02), motion.time)
    assert motion.energy[0] - motion.energy[-1] == pytest.approx(lost, rel=1e-4)  # trapezoids
    assert (np.diff(motion.energy) < 0).all()


def rigid_accelerations(p: Parameters, q: np.ndarray, w: np.ndarray, tau: np.ndarray) -> np.ndarray:
    """Return the accelerations of the textbook's two rigid links [rad/s2]."""
    moment = p.m_b * (p.r + p.L / 2) * p.L_R
    J = p.I_H + p.I_b
    c, s = moment * np.cos(q[1]), moment * np.sin(q[1])
    H = [[p.I_R0 + p.L_R**2 * (p.m_H + p.m_b) + J + 2 * c, J + c], [J + c, J]]
    bias = [-s * w[1] * (2 * w[0] + w[1]), s * w[0] ** 2]
    solution: np.ndarray = np.linalg.solve(H, tau - bias - np.array([p.F_1, p.F_2]) * w[:2])
    return solution


def test_a_stiffer_beam_tends_to_the_rigid_arm_with_first_order() -> None:
    """Deflections that leave the modes unaccelerated: the slow motion, off by 1/EI."""
    theta, rates, tau = np.array([0.4, 1.2]), np.array([1.5, -2.0]), np.array([0.8, -0.2])
    w = np.concatenate([rates, np.zeros(3)])
    stiffnesses, errors = np.array([1e2, 1e3, 1e4]), []
    for EI in stiffnesses:
        parameters = Parameters(EI=EI)
        p = assumed_modes(parameters, 3)
        scale = 1 / p.stiffness

        def modal(force: np.ndarray, p: AssumedModes = p, scale: np.ndarray = scale) -> np.ndarray:
            return accelerations(p, np.concatenate([theta, force * scale]), w, tau)[2:]

        force = fsolve(modal, np.zeros(3), xtol=1e-10)
        q = np.concatenate([theta, force * scale])
        rigid = rigid_accelerations(parameters, q, w, tau)
        errors.append(np.abs(accelerations(p, q, w, tau)[:2] / rigid - 1).max())
    assert errors[-1] < 1e-4
    order = -np.polyfit(np.log(stiffnesses), np.log(errors), 1)[0]
    assert order == pytest.approx(1.0, abs=0.02)  # first order in the compliance


@pytest.mark.parametrize("theta2", [0.0, 1.2])
def test_free_frequencies_converge_with_fifth_order(theta2: float) -> None:
    """Left-out modes couple to the base like Phi_i ~ 1/i, stiff like i^4: a tail of n^-5."""
    exact = joint_free_frequencies(PARAMETERS, 3, theta2)
    counts = np.array([8, 12, 18, 27, 40])
    error = np.array(
        [free_frequencies(assumed_modes(PARAMETERS, n), theta2)[:3] / exact - 1 for n in counts]
    )
    assert (np.diff(error, axis=0) < 0).all() and (error > 0).all()  # Rayleigh-Ritz
    order = -np.polyfit(np.log(counts), np.log(error), 1)[0]
    assert order == pytest.approx(
        [5.0] * 3, abs=0.3
    )  # effective number is n + 1/2 and r/L mixes n^-7


@pytest.mark.parametrize("theta2", [0.0, 2.0])
def test_free_frequencies_are_those_of_the_linearised_acceleration(theta2: float) -> None:
    p = assumed_modes(CONSERVATIVE, 3)
    q, w, none = np.array([0.3, theta2, 0, 0, 0]), np.zeros(5), np.zeros(2)
    h = 1e-6  # [rad], [m]; the acceleration is odd about rest, so the error is h^2
    jacobian = np.column_stack(
        [
            (accelerations(p, q + h * e, w, none) - accelerations(p, q - h * e, w, none)) / (2 * h)
            for e in np.eye(5)
        ]
    )
    squared = np.sort(-np.linalg.eigvals(jacobian).real)
    assert np.sqrt(squared[2:]) == pytest.approx(free_frequencies(p, theta2), rel=1e-8)
    assert np.abs(squared[:2]).max() < 1e-6 * squared[2]  # two rigid motions


def test_transmissions_multiply_torques_and_square_into_friction() -> None:
    geared = assumed_modes(Parameters(r_1=3.0, r_2=0.25), 3)
    direct = assumed_modes(Parameters(F_1=9.0 * 2.0e-4, F_2=2.3e-4 / 16), 3)
    q, w, tau = random_state(3, 3)
    np.testing.assert_allclose(
        accelerations(geared, q, w, tau),
        accelerations(direct, q, w, tau * (3.0, 0.25)),
        rtol=ROUNDING,
    )


def test_positive_torque_2_turns_joint_2_forward_and_bends_the_tip_back() -> None:
    plant = AssumedModesPlant(PARAMETERS)
    motion = drive(plant, FREE, np.tile([0.0, 0.05], (10, 1)), theta=(0.3, 1.2))
    assert (np.diff(motion.joint[:, 1]) > 0).all()
    assert (motion.v[1:] < 0).all()
    mirrored = drive(plant, FREE, np.tile([0.0, -0.05], (10, 1)), theta=(-0.3, -1.2))
    np.testing.assert_allclose(mirrored.state, -motion.state, atol=1e-15)  # plane mirror


def test_theta_1_is_cyclic() -> None:
    p = assumed_modes(PARAMETERS, 3)
    q, w, tau = random_state(2, 3)
    turned = q + np.array([1.0, 0, 0, 0, 0])
    np.testing.assert_array_equal(accelerations(p, q, w, tau), accelerations(p, turned, w, tau))


def test_arm_at_rest_stays_at_rest() -> None:
    p = assumed_modes(PARAMETERS, 3)
    q = np.array([0.3, 1.2, 0.0, 0.0, 0.0])
    assert not accelerations(p, q, np.zeros(5), np.zeros(2)).any()
