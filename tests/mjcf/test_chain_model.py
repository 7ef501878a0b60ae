"""The chain as read from MJCF: geometry, closed forms, step limits, and what is refused."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pytest

from controllers import TUNED_IDEAL
from flexsim import ChainPlant, DivergenceError, ModelError, Parameters, load_chain
from flexsim.arm.beam import mode_shapes
from flexsim.loop.runs import closed_loop, drive
from flexsim.loop.settings import setting
from flexsim.loop.trajectories import reference, trajectory
from flexsim.mjcf.chain_file import highest_frequency, mass_matrix, stiffness_matrix
from flexsim.mjcf.edits import with_motors
from flexsim.plants.mujoco_steps import chain_tip

pytestmark = pytest.mark.kernels  # run once more under another BLAS kernel


MODELS = Path(__file__).parents[2] / "models"
CHAIN6 = MODELS / "chain6.xml"
MODEL = CHAIN6.read_text()
P = Parameters()

DIGITS = 1e-11  # relative: sums of numbers that the file writes with 12 digits
ROUNDING = 1e-12  # [m] sines and cosines of sums of eight angles
SCALING = 1e-12  # relative: the same arithmetic on a matrix times a power of two
BOUNDED, RUNAWAY = 2.0, 1e3  # growth of the highest mode in 300 steps below, above the limit
SETTLED = 0.5  # of the energy: what damped hinges leave of it after a fraction of a second
MARGIN = 1.01  # of the step's limit, to either side


def edited(pattern: str, replacement: str, count: int = 0) -> str:
    text, found = re.subn(pattern, replacement, MODEL, count=count)
    assert found, pattern
    return text


def exchanged(first: str, second: str) -> str:
    """Return the model with two names exchanged."""
    text = edited(f'"{first}"', '"x"').replace(f'"{second}"', f'"{first}"')
    return text.replace('"x"', f'"{second}"')


def with_step(step: float, integrator: str = "RK4") -> str:
    text = edited('timestep="0.001"', f'timestep="{float(step)!r}"')
    return text.replace('integrator="RK4"', f'integrator="{integrator}"')


def with_damping(value: str, text: str = "") -> str:
    """Return the model with the damping of every hinge of its beam."""
    return re.sub(r'(name="hinge\d".*) damping="[^"]*"', rf'\1 damping="{value}"', text or MODEL)


@pytest.mark.parametrize(
    ("name", "hinges", "step"),
    [("chain4.xml", 4, 1e-3), ("chain6.xml", 6, 1e-3), ("chain10.xml", 10, 2.5e-4)],
)
def test_geometry_is_the_robots(name: str, hinges: int, step: float) -> None:
    chain = load_chain(MODELS / name)
    assert (chain.model.nv, chain.step) == (hinges + 2, step)
    assert chain.source == str(MODELS / name)
    assert (chain.L_R, chain.clamp) == pytest.approx((P.L_R, P.r), rel=DIGITS)
    assert chain.reach == pytest.approx(P.reach, rel=DIGITS)
    assert len(chain.lengths) == len(chain.hinges) == hinges
    assert (np.diff(chain.hinges) > 0).all() and 0 < chain.hinges[0]
    assert chain.hinges[-1] + chain.lengths[-1] == pytest.approx(P.L, rel=DIGITS)


def test_every_shipped_model_is_loaded() -> None:
    found = sorted(MODELS.glob("chain*.xml"))
    assert len(found) >= 3
    for path in found:
        assert load_chain(path).text == path.read_text()


def test_path_and_text_give_the_same_model() -> None:
    first, second = load_chain(CHAIN6), load_chain(text=MODEL)
    assert second.source == "the MJCF text"
    np.testing.assert_array_equal(first.lengths, second.lengths)
    np.testing.assert_array_equal(
        mass_matrix(first.model, np.ones(8)), mass_matrix(second.model, np.ones(8))
    )


def test_mass_matrix_of_the_straight_arm_in_closed_form() -> None:
    M = mass_matrix(load_chain(CHAIN6).model, np.zeros(8))
    about_2 = P.I_H + P.I_b
    first_moment = P.rho * ((P.r + P.L) ** 2 - P.r**2) / 2
    coupled = about_2 + P.L_R * first_moment
    about_1 = P.I_R0 + coupled + P.L_R * first_moment + P.L_R**2 * (P.m_H + P.m_b)
    wanted = [[about_1, coupled], [coupled, about_2]]
    np.testing.assert_allclose(M[:2, :2], wanted, rtol=DIGITS)


def test_motors_replace_the_armatures() -> None:
    plain = load_chain(CHAIN6)
    geared = with_motors(plain, None, 0.25)
    difference = mass_matrix(geared.model, np.zeros(8)) - mass_matrix(plain.model, np.zeros(8))
    wanted = np.zeros((8, 8))
    wanted[1, 1] = 0.25
    np.testing.assert_allclose(difference, wanted, atol=ROUNDING)


def test_stiffer_springs_raise_frequencies_by_the_root() -> None:
    """Where every spring is four times as stiff, the highest frequency doubles."""
    chain = load_chain(CHAIN6)
    before = highest_frequency(chain.model)
    chain.model.jnt_stiffness[:] *= 4
    assert highest_frequency(chain.model) == pytest.approx(2 * before, rel=SCALING)


def test_payload_at_the_tip_is_carried() -> None:
    load = '<body name="load" pos="0.077 0 0"><inertial pos="0 0 0" mass="0.05" '
    load += 'diaginertia="1e-6 1e-6 1e-6"/></body>\n<site name="tip"'
    chain = load_chain(text=edited('<site name="tip"', load))
    plain = load_chain(CHAIN6)
    assert chain.model.nv == 8
    np.testing.assert_array_equal(chain.lengths, plain.lengths)
    gained = chain.model.body_mass.sum() - plain.model.body_mass.sum()
    assert gained == pytest.approx(0.05, rel=DIGITS)


def test_include_is_found_beside_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "sub").mkdir()
    actuator = re.search(r"<actuator>.*</actuator>", MODEL, re.DOTALL)
    assert actuator
    (tmp_path / "sub" / "motors.xml").write_text(f"<mujoco>{actuator[0]}</mujoco>")
    text = MODEL.replace(actuator[0], '<include file="motors.xml"/>')
    (tmp_path / "sub" / "arm.xml").write_text(text)
    monkeypatch.chdir(tmp_path)
    assert load_chain("sub/arm.xml").model.nu == 2


def test_tip_is_the_site() -> None:
    plant = ChainPlant(P, load_chain(CHAIN6))
    model = plant.chain.model
    data = mujoco.MjData(model)
    rng = np.random.default_rng(1)
    states = np.hstack([rng.uniform(-1, 1, (5, 8)), np.zeros((5, 8))])
    seen = plant.observe(states)
    for i, state in enumerate(states):
        data.qpos[:] = state[:8]
        mujoco.mj_forward(model, data)
        with plant.running(1) as compiled:
            along, across = chain_tip(compiled, state)
        assert [along, across] == pytest.approx(
            data.sensor("tip_in_hub").data[:2].tolist(), abs=ROUNDING
        )
        assert seen.v[i] == pytest.approx(across, abs=ROUNDING)
        assert seen.tip[i].tolist() == pytest.approx(
            data.site("tip").xpos[:2].tolist(), abs=ROUNDING
        )


def test_compiled_steps_are_mujocos() -> None:
    plant = ChainPlant(P, load_chain(CHAIN6))
    torque = np.random.default_rng(1).normal(size=(50, 2)) * (0.5, 0.05)
    motion = drive(plant, setting("none"), torque)
    data = mujoco.MjData(plant.chain.model)
    for k, tau in enumerate(torque):
        np.testing.assert_array_equal(motion.state[k], np.append(data.qpos, data.qvel))
        data.ctrl[:] = tau
        mujoco.mj_step(plant.chain.model, data)


def growth(step: float, integrator: mujoco.mjtIntegrator) -> float:
    """Return how the highest mode grows within 300 steps of a length that is not checked."""
    model = mujoco.MjModel.from_xml_path(str(CHAIN6))
    model.opt.timestep, model.opt.integrator = step, integrator
    model.dof_damping[:] = 0.0
    pose = np.zeros(8)
    M, K = mass_matrix(model, pose), stiffness_matrix(model)
    _, vectors = np.linalg.eig(np.linalg.solve(M, K))
    top = np.argmax(np.linalg.eigvals(np.linalg.solve(M, K)).real)
    data = mujoco.MjData(model)
    data.qpos[:] = 1e-6 * vectors[:, top].real
    start = np.abs(data.qpos).max()
    largest = start
    for _ in range(300):
        mujoco.mj_step(model, data)
        largest = max(largest, np.abs(data.qpos[2:]).max())
        if largest > RUNAWAY * start:
            break
    return float(largest / start)


@pytest.mark.parametrize("name", ["RK4", "Euler"])
def test_step_limit_is_where_motion_stays_bounded(name: str) -> None:
    with pytest.raises(ModelError, match=r"timestep 0\.01 s is too long") as refused:
        load_chain(text=with_step(0.01, name))
    assert name.upper() in str(refused.value)
    omega = highest_frequency(load_chain(CHAIN6).model)
    limit = {"RK4": 2.8, "Euler": 2.0}[name] / omega  # 2.8: 2 sqrt(2), rounded to the safe side
    load_chain(text=with_damping("0", with_step(limit / MARGIN, name)))
    with pytest.raises(ModelError, match="too long"):
        load_chain(text=with_damping("0", with_step(limit * MARGIN, name)))


def test_beyond_the_limit_of_rk4_motion_runs_away() -> None:
    """Holds the limit against MuJoCo's own steps, in the straight pose."""
    model = load_chain(CHAIN6).model
    M, K = mass_matrix(model, np.zeros(8)), stiffness_matrix(model)
    omega = np.sqrt(np.linalg.eigvals(np.linalg.solve(M, K)).real.max())
    limit = 2 * np.sqrt(2) / omega
    rk4 = mujoco.mjtIntegrator.mjINT_RK4
    assert growth(limit / MARGIN, rk4) < BOUNDED
    assert growth(limit * MARGIN, rk4) > RUNAWAY


def test_damped_hinges_shorten_the_step_of_rk4() -> None:
    """Explicit steps must resolve the damping too; at the step advised the motion settles."""
    with pytest.raises(ModelError, match=r"damping at \d+ 1/s; use less than") as refused:
        load_chain(text=with_damping("0.01"))
    advised = float(str(refused.value).split()[-2])
    text = with_damping("0.01", with_step(advised / MARGIN))
    plant = ChainPlant(P, load_chain(text=text))
    state = np.zeros(16)
    state[2:8] = 0.02
    motion = drive(plant, setting("none"), np.zeros((2000, 2)), plant.step, state=state)
    assert motion.energy[-1] < SETTLED * motion.energy[0]
    assert (np.diff(motion.energy) <= 0).all()
    euler = with_damping("0.01", with_step(1e-3, "Euler"))
    assert load_chain(text=euler).step == 1e-3  # takes the damping implicitly


def test_only_discrete_has_no_such_limit() -> None:
    assert load_chain(text=with_step(0.005, "discrete")).step == 0.005
    for name in ("implicit", "implicitfast"):  # in velocities only, not in the springs
        with pytest.raises(ModelError, match=f"too long for {name.upper()}"):
            load_chain(text=with_step(0.005, name))


MOTOR = '<motor name="motor2" joint="joint2" gear="1"/>'
REFUSED: dict[str, tuple[Callable[[], str], str]] = {
    "hub on the link": (
        lambda: edited('<site name="hub"/>', "").replace(
            '<body name="hub"', '<site name="hub" pos="0.32 0 0"/>\n<body name="hub"'
        ),
        "site 'hub' moves with body 'link1'; put it on 'hub'",
    ),
    "tip on the hub": (
        lambda: edited('<site name="tip" .*/>', "").replace(
            '<site name="hub"/>', '<site name="hub"/><site name="tip" pos="0.575 0 0"/>'
        ),
        "site 'tip' moves with body 'hub'; put it on 'segment6'",
    ),
    "branch": (
        lambda: (
            edited(
                '<site name="hub"/>',
                '<site name="hub"/><body name="b" pos="0.08 0 0"><joint name="jb"/>'
                '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body>',
            )
            .replace('0 0 0 0 0 0"/>', '0 0 0 0 0 0 0"/>')
            .replace(' 0.001598"', ' 0.001598 0"')
        ),
        "'(hinge1|jb)' starts another chain",
    ),
    "motors crossed": (
        lambda: edited('"motor1" joint="joint1"', '"motor1" joint="joint2"'),
        "'motor1' is not a plain motor on joint1",
    ),
    "motor on a hinge": (
        lambda: edited('"motor2" joint="joint2"', '"motor2" joint="hinge1"'),
        "'motor2' is not a plain motor on joint2",
    ),
    "servo": (
        lambda: edited(MOTOR, '<position name="motor2" joint="joint2" kp="3"/>'),
        "'motor2' is not a plain motor on joint2; write <motor",
    ),
    "motors in the other order": (
        lambda: exchanged("motor1", "motor2"),
        "the arm needs motor1, then motor2",
    ),
    "third motor": (
        lambda: edited(MOTOR, MOTOR + '<motor name="motor3" joint="hinge1"/>'),
        "then motor2, and no other",
    ),
    "muscle": (
        lambda: edited(
            MOTOR, MOTOR.replace("<motor", "<muscle").replace(' gear="1"', ' lengthrange="0 1"')
        ),
        "plain motor|not valid|activations",
    ),
    "second motor gone": (lambda: edited(MOTOR, ""), "lacks the motor named 'motor2'"),
    "equality": (
        lambda: edited("<sensor>", '<equality><joint joint1="hinge1"/></equality><sensor>'),
        "has an equality without a name",
    ),
    "named equality": (
        lambda: edited(
            "<sensor>", '<equality><joint name="lock" joint1="hinge1"/></equality><sensor>'
        ),
        "has the equality 'lock'",
    ),
    "tendon": (
        lambda: edited(
            "<sensor>",
            '<tendon><fixed name="cord"><joint joint="hinge1" coef="1"/></fixed></tendon><sensor>',
        ),
        "has the tendon 'cord'",
    ),
    "filtered motor": (
        lambda: edited(
            MOTOR,
            '<general name="motor2" joint="joint2" gainprm="1" dyntype="filter" dynprm="0.1"/>',
        ),
        "the actuator 'motor2' with an activation|not a plain motor",
    ),
    "flipped hinge": (
        lambda: edited('<joint name="hinge3"', '<joint name="hinge3" axis="0 0 -1"'),
        "'hinge3' has the axis 0 0 -1; it must turn about z",
    ),
    "flipped joint": (
        lambda: edited('<joint name="joint2"', '<joint name="joint2" axis="0 0 -1"'),
        "'joint2' has the axis 0 0 -1",
    ),
    "arm away from the origin": (
        lambda: edited('<body name="link1"', '<body name="link1" pos="0.1 0 0"'),
        "'joint1' is at 0.1 0 0 m .* start in the origin",
    ),
    "mass of a geom": (
        lambda: edited(
            '<site name="tip"',
            '<geom name="ball" type="sphere" size="0.01" mass="0.05"/><site name="tip"',
        ),
        "geom 'ball' of body 'segment6' has mass 0.05, which inertiafromgeom=false ignores",
    ),
    "simply a ball joint": (
        lambda: edited('<joint name="hinge3"', '<joint name="hinge3" type="ball"'),
        "'hinge3' is a ball joint",
    ),
    "ball": (
        lambda: (
            edited('<joint name="hinge3"', '<joint name="hinge3" type="ball"')
            .replace('<jointpos name="hinge3" joint="hinge3"/>', "")
            .replace("<key ", "<!-- key ")
            .replace('0 0 0 0"/>', '0 0 0 0" -->')
            .replace('0.001598"/>', '0.001598" -->')
        ),
        "'hinge3' is a ball joint",
    ),
    "joints in the other order": (
        lambda: exchanged("joint1", "joint2"),
        "the arm needs joint1, joint2",
    ),
    "hinge backwards": (
        lambda: edited('name="segment2" pos="0.073515', 'name="segment2" pos="-0.073515'),
        "'hinge2' is -0.073515 m along x from joint 'hinge1'; it must lie beyond it",
    ),
    "tilted axis": (
        lambda: edited('<joint name="hinge3"', '<joint name="hinge3" axis="0 1 0"'),
        "'hinge3' has the axis 0 1 0",
    ),
    "joint position nan": (
        lambda: edited('<joint name="hinge3"', '<joint name="hinge3" pos="nan 0 0"'),
        "'hinge3' has a pos that is not a finite number",
    ),
    "gear nan": (
        lambda: edited('joint="joint1" gear="1"', 'joint="joint1" gear="nan"'),
        "'motor1' has a gear",
    ),
    "springref nan": (
        lambda: edited('<joint name="hinge3"', '<joint name="hinge3" springref="nan"'),
        "'hinge3' has a springref that is not a finite number",
    ),
    "friction loss negative": (
        lambda: edited('<joint name="hinge3"', '<joint name="hinge3" frictionloss="-1"'),
        "'hinge3' has friction loss -1",
    ),
    "armature negative": (
        lambda: edited('damping="0.0002" armature="0"', 'damping="0.0002" armature="-1"'),
        "'joint1' has armature -1",
    ),
    "stiffness infinite": (
        lambda: edited('hinge1" stiffness="[^"]*"', 'hinge1" stiffness="inf"'),
        "'hinge1' has stiffness inf",
    ),
    "no step": (lambda: with_step(0.0), "timestep is 0 s; give more than 0"),
    "negative step": (lambda: with_step(-1e-3), "timestep is -0.001 s"),
    "step nan": (lambda: with_step(float("nan")), "timestep is nan s"),
}


@pytest.mark.parametrize("edit", REFUSED)
def test_what_is_not_the_arm_is_refused(
    edit: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    make, words = REFUSED[edit]
    with pytest.raises(ModelError, match=words) as refused:
        load_chain(text=make())
    assert "\n" not in str(refused.value) and "the MJCF text: " in str(refused.value)
    assert capfd.readouterr() == ("", "") and not list(tmp_path.iterdir())


@pytest.mark.parametrize("path", ["none.xml", ".", "bytes.xml", "zeros.xml"])
def test_what_is_no_text_is_refused(
    path: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bytes.xml").write_bytes(bytes(range(256)))
    (tmp_path / "zeros.xml").write_bytes(bytes(100))
    with pytest.raises(ModelError, match=re.escape(path)) as refused:
        load_chain(path)
    assert "\n" not in str(refused.value)


def test_something_must_be_given() -> None:
    with pytest.raises(ModelError, match="no MJCF given"):
        load_chain()
    with pytest.raises(ModelError, match="is empty"):
        load_chain(text=" \n")


@pytest.mark.parametrize("flag", [' autoreset="disable"', ""])
def test_divergence_is_quiet_and_never_reset(
    flag: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """An edit that lets MuJoCo reset a runaway changes nothing: it is off for the loop."""
    monkeypatch.chdir(tmp_path)
    plant = ChainPlant(P, load_chain(text=edited(' autoreset="disable"', flag)))
    assert plant.chain.model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_AUTORESET
    with pytest.raises(DivergenceError, match=r"ran away at t = 0\.\d+ s; use smaller torques"):
        drive(plant, setting("none"), np.full((100, 2), 1e7))
    circle = reference(trajectory("circle"), P)
    (b1, a1), (b2, a2) = TUNED_IDEAL["circle"].filters(1e-3)
    wild = ((-1e3 * b1, a1), (-1e3 * b2, a2))
    calm, lost = closed_loop(plant, setting("none"), circle, [((b1, a1), (b2, a2)), wild])
    assert calm.diverged is None
    assert lost.diverged is not None and lost.diverged < 1.0
    assert len(lost.time) < len(calm.time) and np.isfinite(lost.tip).all()
    assert capfd.readouterr() == ("", "") and not list(tmp_path.iterdir())


def test_projection_is_the_integral_of_the_chain_with_a_mode() -> None:
    """eta_i = (1/L) int chi_i v dx of the polyline, by a fine sum of its own."""
    plant = ChainPlant.designed(P)
    rng = np.random.default_rng(4)
    states = np.hstack([0.2 * rng.standard_normal((3, 8)), np.zeros((3, 8))])
    _, across = plant.shape(states)
    nodes = np.concatenate([[0.0], plant.chain.hinges, [P.L]]) / P.L
    x = (np.arange(200_000) + 0.5) / 200_000
    found = plant.observe(states, energy=False).modal
    for k in range(3):
        bent = np.interp(x, nodes, across[k])
        wanted = mode_shapes(3, x).T @ bent / len(x)
        assert found[k] == pytest.approx(wanted, rel=1e-6, abs=1e-9)
