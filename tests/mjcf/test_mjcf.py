"""The MJCF as written and as MuJoCo compiles it: masses, modes, names, files."""

import errno
import json
import os
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest
from alike import require_alike
from scipy.linalg import eigh

from flexsim import ParameterError, Parameters, RunError
from flexsim.arm.beam import modal_integrals
from flexsim.arm.chain_design import design_chain, plain_chain
from flexsim.mjcf.chain_xml import BENT_TIP, chain_mjcf, write_chain
from studies.tools.chain import ChainConfig, command, run

pytestmark = pytest.mark.kernels  # run once more under another BLAS kernel


MODELS = Path(__file__).parents[2] / "models"
FILES = {"chain4.xml": (4, 1e-3), "chain6.xml": (6, 1e-3), "chain10.xml": (10, 2.5e-4)}
PARAMETERS = Parameters()

FREQUENCY = 1e-9  # the file has 12 digits, the design 11, the sum over the chain a little less
DIGITS = 1e-11  # relative: sums of numbers written with 12 digits
STATIC = 0.01  # the keyframe's small-deflection shape: v'^2 = 0.6 % at v = 0.05 L
FREE_HZ = (7.77935, 24.3015, 60.6778)  # exact flexible robot, straight arm, joints free
FREE = 3e-4  # the couplings of N = 6 are within 0.05 %


def compiled(text: str) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(text)


def matrices(model: mujoco.MjModel, theta2: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Return mass and stiffness matrices (nv, nv) with the beam straight."""
    data = mujoco.MjData(model)
    data.joint("joint2").qpos[0] = theta2
    mujoco.mj_forward(model, data)
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    return mass, np.diag(model.jnt_stiffness)


def clamped_frequencies(model: mujoco.MjModel) -> np.ndarray:
    """Return the frequencies (N,) with both joints locked [rad/s]."""
    mass, stiffness = matrices(model)
    squared = eigh(stiffness[2:, 2:], mass[2:, 2:], eigvals_only=True)
    return np.asarray(np.sqrt(squared))


@pytest.fixture(params=FILES)
def model(request: pytest.FixtureRequest) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_path(str(MODELS / request.param))


def test_clamped_frequencies_of_the_compiled_model(model: mujoco.MjModel) -> None:
    exact = modal_integrals(PARAMETERS, 3).frequency
    np.testing.assert_allclose(clamped_frequencies(model)[:3], exact, rtol=FREQUENCY)


def test_the_design_predicts_every_frequency_of_the_compiled_model(model: mujoco.MjModel) -> None:
    design = design_chain(PARAMETERS, model.nv - 2)
    np.testing.assert_allclose(clamped_frequencies(model), design.frequency, rtol=FREQUENCY)


def test_an_untuned_model_fails_that_check() -> None:
    model = compiled(chain_mjcf(PARAMETERS, plain_chain(PARAMETERS, 6)))
    exact = modal_integrals(PARAMETERS, 3).frequency
    assert np.abs(clamped_frequencies(model)[:3] / exact - 1).max() > 1e5 * FREQUENCY


def test_free_frequencies_of_the_straight_arm() -> None:
    mass, stiffness = matrices(mujoco.MjModel.from_xml_path(str(MODELS / "chain6.xml")))
    squared = eigh(stiffness, mass, eigvals_only=True)[2:5]  # after two rigid motions
    np.testing.assert_allclose(np.sqrt(squared) / (2 * np.pi), FREE_HZ, rtol=FREE)


def test_mass_and_moments_are_the_beams(model: mujoco.MjModel) -> None:
    p = PARAMETERS
    first = model.body("root").id
    beam = slice(first, None)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    mass, x = model.body_mass[beam], data.xipos[beam, 0] - p.L_R
    assert mass.sum() == pytest.approx(p.m_b, rel=DIGITS)
    assert mass @ x == pytest.approx(p.rho * (p.reach**2 - p.r**2) / 2, rel=DIGITS)
    about_joint = model.body_inertia[beam, 2].sum() + mass @ x**2
    assert about_joint == pytest.approx(p.I_b, rel=DIGITS)


@pytest.mark.parametrize("theta2", [0.0, 0.7, 2.0])
def test_rigid_inertia_is_that_of_the_equations(model: mujoco.MjModel, theta2: float) -> None:
    """(36)-(38) at eta = 0."""
    p = PARAMETERS
    mass, _ = matrices(model, theta2)
    J = p.I_H + p.I_b
    h = p.L_R * np.cos(theta2) * p.rho * (p.reach**2 - p.r**2) / 2
    H11 = p.I_R0 + p.L_R**2 * (p.m_H + p.m_b) + J + 2 * h
    np.testing.assert_allclose(mass[:2, :2], [[H11, J + h], [J + h, J]], rtol=DIGITS)


def test_motors_friction_and_transmission_follow_the_parameters() -> None:
    p = Parameters(I_m1=0.01, I_m2=0.02, r_1=2.0, r_2=3.0, F_1=0.1, F_2=0.2)
    model = compiled(chain_mjcf(p, design_chain(p, 4)))
    np.testing.assert_allclose(model.dof_armature[:2], [0.01, 0.02])
    np.testing.assert_allclose(model.dof_damping[:2], [0.1 * 4, 0.2 * 9])
    np.testing.assert_allclose(model.actuator_gear[:, 0], [2.0, 3.0])
    np.testing.assert_allclose(model.dof_damping[2:], p.eta * model.jnt_stiffness[2:], rtol=DIGITS)
    undamped = compiled(chain_mjcf(replace(p, zeta=0.0), design_chain(p, 4)))
    assert (undamped.dof_damping[2:] == 0).all()


def test_options(model: mujoco.MjModel) -> None:
    flags = mujoco.mjtDisableBit
    wanted = flags.mjDSBL_CONTACT | flags.mjDSBL_GRAVITY | flags.mjDSBL_AUTORESET
    assert model.opt.disableflags == wanted
    assert model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4


def test_every_element_has_a_name(model: mujoco.MjModel) -> None:
    segments = range(1, model.nv - 1)
    hinges = [f"hinge{j}" for j in segments]
    bodies = ["world", "link1", "hub", "root", *(f"segment{j}" for j in segments)]
    sensors = ["theta1", "theta2", "theta1_rate", "theta2_rate", "tip", "tip_in_hub", *hinges]
    assert [model.body(i).name for i in range(model.nbody)] == bodies
    assert [model.joint(i).name for i in range(model.njnt)] == ["joint1", "joint2", *hinges]
    assert [model.actuator(i).name for i in range(model.nu)] == ["motor1", "motor2"]
    assert [model.site(i).name for i in range(model.nsite)] == ["hub", "tip"]
    assert [model.sensor(i).name for i in range(model.nsensor)] == sensors
    assert [model.key(i).name for i in range(model.nkey)] == ["home", "bent"]
    assert [model.cam(i).name for i in range(model.ncam)] == ["top", "perspective"]


def test_steps_under_random_control_without_warnings(model: mujoco.MjModel) -> None:
    data = mujoco.MjData(model)
    random = np.random.default_rng(1)
    for _ in range(round(1.0 / model.opt.timestep)):
        data.ctrl[:] = random.normal(scale=(1.0, 0.1))
        mujoco.mj_step(model, data)
    assert np.isfinite(data.qpos).all() and np.abs(data.qpos[2:]).max() < 1.0
    assert not any(warning.number for warning in data.warning)


def test_bent_keyframe_is_the_static_shape(model: mujoco.MjModel) -> None:
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("bent").id)
    mujoco.mj_forward(model, data)
    v = data.sensor("tip_in_hub").data[1]
    assert v == pytest.approx(BENT_TIP * PARAMETERS.L, rel=STATIC)
    # a force across the hub's x-axis at the tip holds every hinge
    hub = data.body("hub").xmat.reshape(3, 3)
    force = BENT_TIP * PARAMETERS.L / PARAMETERS.static_compliance * hub[:, 1]
    torque = np.zeros(model.nv)
    tip, last = data.site("tip").xpos, model.nbody - 1
    mujoco.mj_applyFT(model, data, force, np.zeros(3), tip, last, torque)
    balance = torque + data.qfrc_passive
    assert np.abs(balance[2:]).max() < STATIC * np.abs(torque[2:]).max()


def test_bent_keyframe_without_the_force_is_not_at_rest(model: mujoco.MjModel) -> None:
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("bent").id)
    mujoco.mj_forward(model, data)
    assert np.abs(data.qacc[2:]).max() > 1.0


@pytest.mark.parametrize("name", FILES)
def test_files_are_what_the_writer_writes(name: str, tmp_path: Path) -> None:
    segments, timestep = FILES[name]
    text = chain_mjcf(PARAMETERS, design_chain(PARAMETERS, segments), timestep)
    written = write_chain(tmp_path / name, text)
    assert written.read_text() == text
    require_alike(text, (MODELS / name).read_text())


@pytest.mark.parametrize("name", FILES)
def test_files_are_laid_out_like_menagerie(name: str) -> None:
    text = (MODELS / name).read_text()
    order = ["compiler", "option", "statistic", "visual", "asset", "default", "worldbody"]
    order += ["actuator", "sensor", "keyframe", "custom"]
    assert [element.tag for element in ElementTree.fromstring(text)] == order
    assert "\t" not in text and not any(line != line.rstrip() for line in text.split("\n"))


@pytest.mark.parametrize("timestep", [0.0, -1e-3, float("nan"), float("inf")])
def test_timestep_out_of_range(timestep: float) -> None:
    with pytest.raises(ParameterError, match="timestep is"):
        chain_mjcf(PARAMETERS, design_chain(PARAMETERS, 4), timestep)


def test_writer_does_not_overwrite_unless_forced(tmp_path: Path) -> None:
    path = tmp_path / "chain.xml"
    path.write_text("mine")
    with pytest.raises(RunError, match="--force"):
        write_chain(path, "new")
    assert path.read_text() == "mine"
    write_chain(path, "new", force=True)
    assert path.read_text() == "new"
    assert os.listdir(tmp_path) == ["chain.xml"]


def test_writer_names_what_is_wrong(tmp_path: Path) -> None:
    with pytest.raises(RunError, match="no folder"):
        write_chain(tmp_path / "missing" / "chain.xml", "new")
    with pytest.raises(RunError, match=r"ends in \.xml"):
        write_chain(tmp_path / "chain.txt", "new")
    (tmp_path / "folder.xml").mkdir()
    with pytest.raises(RunError, match="it is a folder"):
        write_chain(tmp_path / "folder.xml", "new", force=True)


def test_writer_leaves_nothing_behind_when_it_fails(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(source: str, target: Path) -> None:
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr("flexsim.files.atomic.os.link", refuse)
    with pytest.raises(RunError, match="cannot write the file: Permission denied"):
        write_chain(tmp_path / "chain.xml", "new")
    assert os.listdir(tmp_path) == []


def test_study_reports_the_design(tmp_path: Path) -> None:
    result = run(ChainConfig(out=tmp_path / "chain.xml", segments=6))
    assert result.highest_frequency == pytest.approx(2282, rel=0.001)  # measured
    assert 0.9 < result.longest_step * result.highest_frequency / 2.8 < 1.0  # damping takes some
    assert not (tmp_path / "chain.xml").exists()  # run is pure


def test_study_refuses_a_step_that_rk4_cannot_take(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match=r"needs 0\.000432 s or less"):
        run(ChainConfig(out=tmp_path / "chain.xml", segments=10))


def test_command_writes_and_prints(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "chain.xml"
    command(ChainConfig(out=path, segments=4, json=True))
    printed = json.loads(capsys.readouterr().out)
    assert printed["segments"] == 4 and printed["tuned"]
    assert path.read_bytes() == (MODELS / "chain4.xml").read_bytes()
    command(ChainConfig(out=path, segments=8, plain=True, timestep=5e-4, force=True))
    assert "plain chain of 8" in capsys.readouterr().out
