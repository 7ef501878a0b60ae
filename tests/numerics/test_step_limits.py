"""How long a step may be: closed forms, the one-step map, and MuJoCo's own steps."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from flexsim import ParameterError
from flexsim.mjcf.chain_file import chain_motion
from flexsim.numerics.mujoco_c import quiet_warnings
from flexsim.numerics.step_limits import (
    INTEGRATORS,
    POSES,
    RK4_LIMIT,
    SHORTEST_STEP,
    halved,
    longest_step,
    one_step_map,
    radius,
)
from flexsim.numerics.types import Array

CHAIN6 = Path(__file__).parents[2] / "models" / "chain6.xml"
MARGIN = 1.01  # of the limit, to either side
STABLE = 1e-6  # of a radius over 1: rounding of the double one of a rigid motion
DIGITS = 1e-9  # relative, of eigenvalues
PER_CENT = 0.02  # relative, of limits that were measured by trying steps
MEASURED = {0.0: 0.875e-3, 0.00455: 2.35e-3, 0.02: 8.93e-3, 0.1: 31.9e-3}  # [s] by hinge damping
BENT = 1e-6  # [rad] of every hinge at the start, so that motions stay linear until they run away
RUNAWAY = 1e3  # times that
MAPS = {"semi-implicit": ("Euler", "implicit", "implicitfast")}


def oscillator(omega: float, zeta: float) -> tuple[Array, Array, Array]:
    """M, D, K of one mode."""
    return np.eye(1), np.array([[2 * zeta * omega]]), np.array([[omega**2]])


@pytest.mark.parametrize("zeta", [0.0, 0.01, 0.3, 1.0, 10.0])
@pytest.mark.parametrize("name", MAPS["semi-implicit"])
def test_one_mode_in_closed_form(name: str, zeta: float) -> None:
    omega = 300.0
    found = longest_step(name, [oscillator(omega, zeta)])
    assert found * omega == pytest.approx(2 * zeta + 2 * np.sqrt(zeta**2 + 1), rel=DIGITS)


@pytest.mark.parametrize("zeta", [0.0, 0.01, 0.3, 1.0])
def test_one_mode_with_explicit_damping(zeta: float) -> None:
    """The same with the other sign: 4 m - 2 h d - h^2 k = 0."""
    omega = 300.0
    M, D, K = oscillator(omega, zeta)
    found = longest_step("Euler", [(M, 0 * D, K)], D)
    assert found * omega == pytest.approx(-2 * zeta + 2 * np.sqrt(zeta**2 + 1), rel=DIGITS)


def random_motion(seed: int, n: int = 4) -> tuple[Array, Array, Array, Array]:
    """M, D, K and damping at the start, none of them proportional to another."""
    rng = np.random.default_rng(seed)
    M, D, K, D0 = (a @ a.T for a in rng.normal(size=(4, n, n)))
    return M + np.eye(n), D, 100 * K, 0.3 * D0


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("name", INTEGRATORS)
def test_the_limit_is_where_the_map_leaves_the_unit_circle(name: str, seed: int) -> None:
    M, D, K, D0 = random_motion(seed)
    longest = longest_step(name, [(M, D, K)], D0)
    if np.isinf(longest):
        assert name == "discrete"
        assert radius(one_step_map(name, (M, D, K), 1e3, D0)) <= 1 + STABLE
        return
    assert radius(one_step_map(name, (M, D, K), longest / MARGIN, D0)) <= 1 + STABLE
    if name != "RK4":  # its limits keep to the safe side
        assert radius(one_step_map(name, (M, D, K), longest * MARGIN, D0)) > 1 + STABLE


def test_held_friction_alone_is_explicit_euler() -> None:
    """A rotor J under friction b held over a step: w' = w (1 - h b/J), whatever the integrator."""
    J, b = np.array([[0.002]]), np.array([[1.5]])
    still = np.zeros((1, 1))
    for name in INTEGRATORS:
        assert longest_step(name, [(J, still, still)], b) == pytest.approx(
            2 * 0.002 / 1.5, rel=1e-6
        )


def own_runaway(model: mujoco.MjModel, step: float, theta2: float) -> bool:
    """Whether MuJoCo's own steps of a small motion run away."""
    model.opt.timestep = step
    data = mujoco.MjData(model)
    data.qpos[1], data.qpos[2:] = theta2, BENT
    with quiet_warnings():
        for _ in range(2000):
            mujoco.mj_step(model, data)
            if not np.abs(data.qpos[2:]).max() < RUNAWAY * BENT:
                return True
    return False


@pytest.mark.parametrize("damping", [0.0, 0.00455, 0.02, 0.1, 0.5])
@pytest.mark.parametrize("eulerdamp", [True, False])
def test_damped_chains_run_away_where_it_is_said(damping: float, eulerdamp: bool) -> None:
    model = mujoco.MjModel.from_xml_path(str(CHAIN6))
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
    model.dof_damping[2:] = damping
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    motion = chain_motion(model, 0.0)
    if eulerdamp:
        longest = longest_step("Euler", [motion])
    else:
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_EULERDAMP
        M, D, K = motion
        longest = longest_step("Euler", [(M, 0 * D, K)], D)
    assert not own_runaway(model, longest / MARGIN, 0.0)
    assert own_runaway(model, longest * MARGIN, 0.0)


@pytest.mark.parametrize("damping", MEASURED)
def test_limits_over_poses_are_those_that_were_measured(damping: float) -> None:
    model = mujoco.MjModel.from_xml_path(str(CHAIN6))
    model.dof_damping[2:] = damping
    found = longest_step("Euler", [chain_motion(model, float(pose)) for pose in POSES])
    assert found == pytest.approx(MEASURED[damping], rel=PER_CENT)


def test_halving() -> None:
    assert halved(RK4_LIMIT) == 1e-3 and halved(1e-3) == 5e-4 and halved(2.6e-4) == 2.5e-4
    assert halved(2.2 * SHORTEST_STEP) >= SHORTEST_STEP
    for longest in (1e-8, 1.01 * SHORTEST_STEP, 0.0, float("nan")):
        with pytest.raises(ParameterError, match="needs a physics step below"):
            halved(longest)
