"""Damping, payload and a beam on the joint's axis: the same robot on every plant.

What both plants share is held against what neither has: the exact frequencies of
`flexsim.arm.free_arm`, and the definition of a Kelvin-Voigt beam's damping ratios.
"""

import mujoco
import numpy as np
import pytest

from flexsim import ModelError, ParameterError, Parameters, load_chain
from flexsim.arm.beam import modal_integrals
from flexsim.arm.chain_design import design_chain
from flexsim.arm.free_arm import joint_free_frequencies
from flexsim.loop.runs import drive
from flexsim.loop.settings import setting
from flexsim.mjcf.as_parameters import parameters_of
from flexsim.mjcf.chain_xml import chain_mjcf
from flexsim.mjcf.rod_file import load_rod
from flexsim.mjcf.rod_xml import rod_mjcf
from flexsim.numerics.state_matrix import state_matrix
from flexsim.plants.base import Plant
from flexsim.plants.modes_plant import AssumedModesPlant
from flexsim.robot import Robot

FREE = {"F_1": 0.0, "F_2": 0.0}  # friction of the joints would add to the ratios
ROBOTS = {
    "paper's": Parameters(zeta=0.0, **FREE),
    "damped": Parameters(**FREE),
    "payload": Parameters(payload=0.05, **FREE),
    "payload that turns": Parameters(payload=0.0785, payload_inertia=7e-4, zeta=5e-3, **FREE),
    "on the axis": Parameters(r=0.0, **FREE),
    "both": Parameters(r=0.0, payload=0.03, payload_inertia=1e-4, **FREE),
}
MODELS = {  # largest error of three joint-free frequencies, under a payload too; measured: 4e-7
    "assumed-modes:12": 1e-6,  # with 12 modes; 0.39, 0.025, 0.84 % with hinges or vertices
    "chain": 4e-3,
    "closed-chain": 4e-3,
    "chain:10": 3e-4,
    "rod": 2e-2,
    "exudyn": 8e-4,  # with 8 cubic elements; 7e-5 with 14
}
POSE = 0.7  # [rad] of joint 2
DAMPED = 1e-4  # of a damping ratio, by the chain's equal shapes; relative to the error in frequency
DECAY = 0.02  # relative, of a swing's envelope over some periods


def swinging(plant: Plant) -> tuple[np.ndarray, np.ndarray]:
    """Return frequencies [rad/s] and damping ratios (3,) with both joints free."""
    linear = plant.linearised(POSE)
    rates = np.linalg.eigvals(state_matrix(linear.M, linear.D, linear.K))
    rates = rates[rates.imag > 1.0]
    rates = rates[np.argsort(np.abs(rates))][:3]
    return np.abs(rates), -rates.real / np.abs(rates)


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("robot", ROBOTS)
def test_every_plant_is_the_same_damped_and_loaded_robot(robot: str, name: str) -> None:
    p = ROBOTS[robot]
    if name == "rod" and p.payload_inertia:
        with pytest.raises(ParameterError, match="the tip of a rod is a point without rotation"):
            Robot(p).plant(name)
        return
    omega, ratio = swinging(Robot(p).plant(name))
    exact = joint_free_frequencies(p, 3, POSE)
    assert omega == pytest.approx(exact, rel=MODELS[name])
    # Kelvin-Voigt: D is eta times K, so every mode has eta omega / 2
    assert ratio == pytest.approx(p.eta * omega / 2, rel=DAMPED, abs=1e-12)
    assert (np.diff(ratio) > 0).all() or p.zeta == 0


def test_the_comparison_would_see_another_payload() -> None:
    p = ROBOTS["payload"]
    exact = joint_free_frequencies(p, 3, POSE)
    omega, _ = swinging(Robot(Parameters(payload=0.05 * 1.1, **FREE)).plant("chain"))
    assert omega != pytest.approx(exact, rel=MODELS["chain"])


@pytest.mark.parametrize("name", ["assumed-modes", "chain", "closed-chain", "rod"])
def test_a_plucked_beam_swings_out_as_fast_as_it_says(name: str) -> None:
    """With its joints all but locked, the tip loses exp(-zeta omega t) of its swing."""
    zeta = 0.01
    heavy = Parameters(zeta=zeta, I_m1=1e6, I_m2=1e6, **FREE)
    plant = Robot(heavy).plant(name, step=2.5e-4, chain_step=2.5e-5 if name == "rod" else 2.5e-4)
    state = plant.rest_state((0.0, 1.2))
    m = len(state) // 2
    linear = plant.linearised(1.2)
    where = np.arange(2, m) if len(linear.M) == m else np.arange(3, m, 2)  # a rod's, across
    K, M = linear.K[2:, 2:], linear.M[2:, 2:]
    _, vectors = np.linalg.eig(np.linalg.solve(M, K))
    slowest = np.argmin(np.linalg.eigvals(np.linalg.solve(M, K)).real)
    shape = vectors[:, slowest].real
    state[where] = 1e-4 * shape / np.abs(shape).max()
    motion = drive(plant, setting("none"), np.zeros((1500, 2)), 1e-3, state=state)
    omega = modal_integrals(heavy, 1).frequency[0]
    v, t = motion.v, 1e-3 * np.arange(len(motion.v))
    peaks = [i for i in range(1, len(v) - 1) if abs(v[i]) > max(abs(v[i - 1]), abs(v[i + 1]))]
    decay = -np.polyfit(t[peaks], np.log(np.abs(v[peaks])), 1)[0]
    assert decay == pytest.approx(zeta * omega, rel=DECAY)


def test_ratios_of_modes_one_by_one() -> None:
    ratios = (1e-3, 2e-3, 5e-4)
    plant = Robot.of(modal_damping=ratios).plant("assumed-modes")
    assert isinstance(plant, AssumedModesPlant)
    c = plant.coefficients
    omega = np.sqrt(c.stiffness / c.mass)
    assert np.diag(c.damping) / (2 * c.mass * omega) == pytest.approx(ratios, rel=1e-12)
    assert not plant.undamped().coefficients.damping.any()
    chain = Robot.of(modal_damping=ratios).plant("chain")
    assert chain.parameters.zeta == ratios[0]  # a chain's grow with the frequency, see Robot


def test_damping_of_a_chain_is_written_and_read() -> None:
    p = Parameters(zeta=0.003, payload=0.02, payload_inertia=3e-5, r=0.0)
    design = design_chain(p, 6)
    found = parameters_of(load_chain(text=chain_mjcf(p, design)))
    assert found.zeta == pytest.approx(p.zeta, rel=1e-4)  # EI is that of the tip's compliance
    assert (found.payload, found.r) == (p.payload, 0.0)
    assert found.payload_inertia == pytest.approx(p.payload_inertia, rel=1e-9)
    assert found.rho == pytest.approx(p.rho, rel=1e-9)


def test_a_rods_payload_is_what_its_tip_weighs_more() -> None:
    p = Parameters(payload=0.02, zeta=0.002)
    robot = Robot.of(text=rod_mjcf(p, 14))
    assert robot.parameters.payload == pytest.approx(p.payload, rel=1e-9)
    assert robot.parameters.rho == pytest.approx(p.rho, rel=1e-9)
    assert robot.parameters.zeta == pytest.approx(p.zeta, rel=1e-9)
    assert load_rod(text=rod_mjcf(Parameters(), 14)).model.flex_damping[0] == pytest.approx(
        Parameters().eta
    )
    without = Robot.of(text=rod_mjcf(Parameters(), 14)).parameters
    assert without.payload == 0.0


def test_a_file_says_which_beam_it_stands_for() -> None:
    p = Parameters(EI=1.0, rho=0.2, r=0.0, zeta=0.002, payload=0.1, payload_inertia=5e-4)
    model = load_chain(text=chain_mjcf(p, design_chain(p, 6))).model
    for name in ("L", "EI", "rho", "r", "zeta", "payload", "payload_inertia"):
        assert model.numeric(f"beam_{name}").data[0] == pytest.approx(getattr(p, name), rel=1e-11)


def test_payload_of_a_file_is_a_body_of_that_name() -> None:
    p = Parameters(payload=0.02, payload_inertia=3e-5)
    model = load_chain(text=chain_mjcf(p, design_chain(p, 6))).model
    assert model.body("payload").mass[0] == 0.02
    assert model.body("payload").inertia[2] == pytest.approx(3e-5)
    without = load_chain(text=chain_mjcf(Parameters(), design_chain(Parameters(), 6))).model
    assert mujoco.mj_name2id(without, mujoco.mjtObj.mjOBJ_BODY, "payload") == -1


def test_damping_is_asked_for_as_a_fraction_and_once() -> None:
    with pytest.raises(ParameterError, match=r"--robot.zeta is 2, .* 0.001 is 0.1 %"):
        Robot.of(parameters=Parameters(zeta=2.0))
    with pytest.raises(ParameterError, match="contradict each other"):
        Robot.of(parameters=Parameters(zeta=0.02), modal_damping=(0.01, 0.01, 0.01))
    with pytest.raises(ParameterError, match="has 2 ratios for 3 modes; give one for each"):
        Robot.of(modal_damping=(0.01, 0.01)).plant("assumed-modes")
    with pytest.raises(ParameterError, match=r"the ratio 1\.5; give fractions"):
        Robot.of(modal_damping=(0.1, 1.5, 0.1))
    with pytest.raises(ParameterError, match="--modal-damping has no effect on"):
        Robot.of("models/chain6.xml", modal_damping=(0.01, 0.01, 0.01))


def test_a_heavily_damped_file_is_a_robot_too() -> None:
    """Damping in a file is what it is, whatever a fraction would be."""
    text = chain_mjcf(Parameters(zeta=0.9), design_chain(Parameters(), 6), timestep=1e-4)
    with pytest.raises(ModelError, match="too long"):
        load_chain(text=text)
    short = chain_mjcf(Parameters(zeta=0.9), design_chain(Parameters(), 6), timestep=1e-6)
    assert Robot.of(text=short).parameters.zeta == pytest.approx(0.9, rel=1e-4)
