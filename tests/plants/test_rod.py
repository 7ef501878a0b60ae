"""The rod: MuJoCo's own elastic beam against the exact one, the traps around it, and the plant."""

import math
import re
from pathlib import Path

import mujoco
import numpy as np
import pytest
from alike import require_alike
from scipy.linalg import eigh

from controllers import TUNED_IDEAL
from flexsim import ModelError, ParameterError, Parameters
from flexsim.arm.beam import modal_integrals, mode_shapes
from flexsim.loop.metrics import rms_distance
from flexsim.loop.runs import closed_loop, drive
from flexsim.loop.settings import setting
from flexsim.loop.trajectories import Reference, reference, trajectory
from flexsim.mjcf.chain_file import mass_matrix
from flexsim.mjcf.rod_file import load_rod, rod_frequencies, rod_stiffness
from flexsim.mjcf.rod_xml import RADIUS, rod_layout, rod_mjcf, stable_rod_step
from flexsim.plants.modes_plant import AssumedModesPlant
from flexsim.plants.rod_plant import RodPlant
from studies.parity.motions import GENTLE, POSE, trial_torque

ROD = Path(__file__).parents[2] / "models" / "rod.xml"
P = Parameters()
EXACT = modal_integrals(P, 3).frequency
FREE_HZ = (7.77935, 24.3015, 60.6778)  # exact flexible robot, straight arm, joints free

DIGITS = 1e-10  # the file has 12 digits; the points' own inertias add 1e-11
CLAMPED = (4e-4, 5.1e-3, 1.8e-2)  # of 14 elements, as measured, rounded up; (b_i h/L)^2/12, less
FREE = (1.3e-3, 5.8e-3, 1.9e-2)  # likewise
ORDERS = (2.0, 0.15)  # of the frequencies' convergence, and how near 7 to 28 elements come
STATIC = 3e-5  # third order: 2.3e-5 for 14 elements
STATIC_ORDER = 2.8  # at least
VIBRATION = 2e-5  # RK4 at 0.5 ms: -1e-5 and a damping ratio of 5e-6 for mode 3
DIFFERENCES = 1e-9  # relative, of central differences of an energy
SMALL_TIP = 4e-5  # [m rms] of 9 mm: 3.3e-5, from joint-free frequencies 0.1 % low
ENERGY = 1e-9  # relative drift over 2 s: 5e-11
SOFT = 1e-3  # [m rms] by how much default solref and solimp spoil the tip: 3.2e-3
NAIVE = 0.02  # relative error of every frequency with points from clamp to tip: +3.5 %
LOOP_TIP = 1e-5  # [m] at most between loops without friction, in 1 s of the circle: 3e-6
# with friction the loop ends in a chaotic limit cycle, where the chain is 4 mm off as well
TRACKING = 0.02  # [m] a loop that holds: 9e-3 with friction
POLYLINE = 0.01  # of a modal coordinate, 40 elements: (b_3/40)^2/12 and the straight clamped half


@pytest.fixture(scope="module")
def plant() -> RodPlant:
    return RodPlant(P, load_rod(ROD))


def across(model: mujoco.MjModel) -> np.ndarray:
    """Return the dofs of the vertices' motion across the beam."""
    return np.arange(3, model.nv, 2)


@pytest.mark.kernels  # run once more under another BLAS kernel
def test_the_file_is_what_the_function_writes() -> None:
    require_alike(rod_mjcf(P), ROD.read_text())


def test_steps_under_pseudo_random_control_without_warnings(plant: RodPlant) -> None:
    model, rng = plant.rod.model, np.random.default_rng(1)
    data = mujoco.MjData(model)
    for _ in range(500):
        data.ctrl[:] = rng.normal(size=2) * (0.5, 0.05)
        mujoco.mj_step(model, data)
    assert np.isfinite(data.qpos).all() and np.abs(data.qpos[2:]).max() > 1e-4
    assert sum(int(warning.number) for warning in data.warning) == 0


@pytest.mark.parametrize("elements", [4, 14, 33])
def test_mass_and_moments_are_the_beams(elements: int) -> None:
    model = mujoco.MjModel.from_xml_string(rod_mjcf(P, elements))
    beam = slice(model.body("root").id, None)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    mass, x = model.body_mass[beam], data.xipos[beam, 0] - P.L_R
    assert mass.min() > 0
    assert mass.sum() == pytest.approx(P.m_b, rel=DIGITS)
    assert mass @ x == pytest.approx(P.rho * (P.reach**2 - P.r**2) / 2, rel=DIGITS)
    about_joint = mass_matrix(model, np.zeros(model.nq))[1, 1]
    assert about_joint == pytest.approx(P.I_H + P.I_b, rel=DIGITS)


def test_clamped_frequencies(plant: RodPlant) -> None:
    assert (np.abs(rod_frequencies(plant.rod.model)[:3] / EXACT - 1) < CLAMPED).all()


def test_joint_free_frequencies_of_the_straight_arm(plant: RodPlant) -> None:
    found = rod_frequencies(plant.rod.model, locked=False)[2:5] / (2 * np.pi)
    assert (np.abs(found / FREE_HZ - 1) < FREE).all()


def test_frequencies_converge_with_the_second_order() -> None:
    sizes = (7, 14, 28)
    models = [load_rod(text=rod_mjcf(P, n)).model for n in sizes]
    errors = np.array([np.abs(rod_frequencies(model)[:3] / EXACT - 1) for model in models])
    orders = -np.polyfit(np.log(sizes), np.log(errors), 1)[0]
    np.testing.assert_allclose(orders, ORDERS[0], atol=ORDERS[1])


def test_static_deflection_is_nearly_exact() -> None:
    errors = []
    for n in (7, 14):
        model = load_rod(text=rod_mjcf(P, n)).model
        stiffness = rod_stiffness(model)[np.ix_(across(model), across(model))]
        errors.append(np.linalg.inv(stiffness)[-1, -1] / P.static_compliance - 1)
    assert abs(errors[1]) < STATIC
    assert np.log2(errors[0] / errors[1]) > STATIC_ORDER


def modes(model: mujoco.MjModel) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return frequencies, shapes (N, N) and masses (N, N) of the clamped rod."""
    take = np.ix_(across(model), across(model))
    mass = mass_matrix(model, np.zeros(model.nq))[take]
    squared, shapes = eigh(rod_stiffness(model)[take], mass)
    return np.sqrt(squared), shapes, mass


@pytest.mark.parametrize("mode", [0, 1, 2])
def test_free_vibration_has_these_frequencies_and_no_damping(plant: RodPlant, mode: int) -> None:
    model = mujoco.MjModel.from_xml_string(plant.rod.text)
    model.dof_armature[:2] = 1e9  # locks the joints
    model.flex_damping[:] = 0.0
    omega, shapes, mass = modes(model)
    shape, w = shapes[:, mode], omega[mode]
    data = mujoco.MjData(model)
    data.qpos[across(model)] = 2e-4 * shape / shape[-1]
    signal = []
    for _ in range(round(5 * 2 * np.pi / w / plant.step)):
        y, rate = data.qpos[across(model)], data.qvel[across(model)]
        signal.append(shape @ mass @ (y - 1j * rate / w))
        mujoco.mj_step(model, data)
    time = plant.step * np.arange(len(signal))
    turned = np.polyfit(time, np.unwrap(np.angle(signal)), 1)[0]
    decay = -np.polyfit(time, np.log(np.abs(signal)), 1)[0]
    assert turned == pytest.approx(w, rel=VIBRATION)
    assert abs(decay / w) < VIBRATION


def flexcomp(points: np.ndarray, mass: float) -> mujoco.MjModel:
    """Return the arm with a rod that a flexcomp makes of points on x, the first two pinned."""
    row = " ".join(f"{x:.15g} 0 0" for x in points)
    pairs = " ".join(f"{j} {j + 1}" for j in range(len(points) - 1))
    return mujoco.MjModel.from_xml_string(f"""
    <mujoco>
      <option integrator="RK4"><flag contact="disable" gravity="disable"/></option>
      <worldbody>
        <body>
          <joint name="joint1" axis="0 0 1"/>
          <inertial pos="0 0 0" mass="1" diaginertia="0.25 0.25 0.25"/>
          <body name="hub" pos="0.32 0 0">
            <joint name="joint2" axis="0 0 1"/>
            <inertial pos="0 0 0" mass="0.47" diaginertia="0.0013 0.0013 0.0013"/>
            <flexcomp name="rod" type="direct" dim="1" dof="2d" radius="{RADIUS}" mass="{mass}"
                      point="{row}" element="{pairs}">
              <pin id="0 1"/>
              <elasticity young="{P.EI / (math.pi * RADIUS**4 / 4)}"/>
              <edge equality="true"/>
            </flexcomp>
          </body>
        </body>
      </worldbody>
    </mujoco>""")


def test_forces_are_those_of_a_flexcomp(plant: RodPlant) -> None:
    vertices = rod_layout(P, 14).vertices
    macro = flexcomp(P.r + np.append(-vertices[0], vertices), P.m_b)
    forces = []
    for model in (plant.rod.model, macro):
        data = mujoco.MjData(model)
        data.qpos[2:] = np.random.default_rng(1).normal(size=28) * 3e-3
        mujoco.mj_forward(model, data)
        forces.append(data.qfrc_spring)
    np.testing.assert_allclose(*forces, rtol=0, atol=DIGITS * np.abs(forces[0]).max())


def test_a_flexcomp_left_to_itself_fails_those_checks() -> None:
    """Pinned points lose their mass, and an edge pinned from the clamp on shortens the beam."""
    model = flexcomp(np.linspace(P.r, P.reach, 16), P.m_b)
    omega, _, _ = modes(model)
    assert (omega[:3] / EXACT - 1 > NAIVE).all()
    assert model.body_mass[3:].sum() < 0.9 * P.m_b


def test_energy_is_that_of_mujocos_force_which_it_does_not_count(plant: RodPlant) -> None:
    model, step = plant.rod.model, 1e-7
    state = np.zeros((1, 2 * model.nq))
    state[0, : model.nq] = np.random.default_rng(1).normal(size=model.nq) * 3e-3
    slope = [
        (plant.bending_energies(state + e) - plant.bending_energies(state - e))[0] / (2 * step)
        for e in step * np.eye(model.nq, 2 * model.nq)
    ]
    data = mujoco.MjData(model)
    data.qpos[:] = state[0, : model.nq]
    mujoco.mj_forward(model, data)
    allowed = DIFFERENCES * np.abs(data.qfrc_spring).max()
    np.testing.assert_allclose(slope, -data.qfrc_spring, rtol=0, atol=allowed)
    mujoco.mj_energyPos(model, data)
    assert data.energy[0] == 0.0  # the trap: if it counts bending one day, use it


def test_energy_stays_in_free_motion(plant: RodPlant) -> None:
    free = load_rod(text=rod_mjcf(Parameters(F_1=0.0, F_2=0.0)))
    state = plant.rest_state(POSE)
    state[free.model.nq :][:2] = GENTLE
    motion = drive(RodPlant(P, free), setting("none"), np.zeros((2000, 2)), state=state)
    assert np.abs(motion.energy / motion.energy[0] - 1).max() < ENERGY


def test_open_loop_tip_agrees_with_the_assumed_modes(
    plant: RodPlant, modes_plant: AssumedModesPlant
) -> None:
    torque = trial_torque(1.0)
    motions = [drive(each, setting("none"), torque, theta=POSE) for each in (plant, modes_plant)]
    assert rms_distance(motions[0].tip, motions[1].tip) < SMALL_TIP
    soft = plant.rod.text.replace('solref="0.001 1" solimp="0.9999 0.9999 0.001"', "")
    assert soft != plant.rod.text
    stretched = drive(RodPlant(P, load_rod(text=soft)), setting("none"), torque, theta=POSE)
    assert rms_distance(stretched.tip, motions[1].tip) > SOFT


@pytest.fixture(scope="module")
def one_second() -> Reference:
    circle = reference(trajectory("circle"), P)
    return Reference(circle.time[:1001], circle.tip[:1001], circle.joint[:1001])


def test_closed_loop_holds_and_is_the_same_on_any_threads(
    plant: RodPlant, one_second: Reference
) -> None:
    pairs = [TUNED_IDEAL["circle"].filters(1e-3)] * 3
    runs = [
        closed_loop(plant, setting("simulink"), one_second, pairs, threads=threads, energy=False)
        for threads in (1, 2)
    ]
    for motion in (*runs[0], *runs[1]):
        assert motion.diverged is None
        assert np.linalg.norm(motion.tip - motion.reference_tip, axis=1).max() < TRACKING
        np.testing.assert_array_equal(motion.state, runs[0][0].state)


def test_closed_loop_without_friction_is_the_assumed_modes(
    plant: RodPlant, modes_plant: AssumedModesPlant, one_second: Reference
) -> None:
    pair = [TUNED_IDEAL["circle"].filters(1e-3)]
    (rod,), (other,) = (
        closed_loop(each, setting("none"), one_second, pair, energy=False)
        for each in (plant, modes_plant)
    )
    assert np.abs(rod.tip - other.tip).max() < LOOP_TIP


def test_observation_is_mujocos_own_view(plant: RodPlant) -> None:
    model, rng = plant.rod.model, np.random.default_rng(1)
    state = rng.normal(size=2 * model.nq) * 1e-3
    state[:2] = 0.3, 1.2
    data = mujoco.MjData(model)
    data.qpos[:] = state[: model.nq]
    mujoco.mj_forward(model, data)
    seen = plant.observe(state[None])
    np.testing.assert_allclose(seen.tip[0], data.site("tip").xpos[:2], atol=1e-12)
    assert seen.v[0] == pytest.approx(data.sensor("tip_in_hub").data[1], abs=1e-12)
    np.testing.assert_allclose(seen.beam[0, 1:], data.flexvert_xpos[1:, :2], atol=1e-12)


def test_modal_coordinates_of_a_mode_are_its_own() -> None:
    """A fine rod in the shape of a mode, to the error of a polyline."""
    fine = RodPlant.designed(P, 40)
    x = (fine.rod.vertices[1:] - P.r) / P.L
    shapes = np.vstack([np.zeros((1, 3)), mode_shapes(3, x)])
    shapes[1] = 0.0
    np.testing.assert_allclose(fine.projection(3) @ shapes, np.eye(3), atol=POLYLINE)


def test_keyframe_bent_is_nearly_at_rest_under_its_force(plant: RodPlant) -> None:
    model = plant.rod.model
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("bent").id)
    assert data.qpos[-1] == pytest.approx(0.05 * P.L, rel=0.01)
    force = rod_stiffness(model) @ data.qpos
    assert force[-1] == pytest.approx(0.05 * P.L / P.static_compliance, rel=0.01)


def test_longer_steps_are_refused_and_shorter_ones_chosen() -> None:
    assert [stable_rod_step(P, n) for n in (10, 14, 20)] == [1e-3, 5e-4, 2.5e-4]
    with pytest.raises(ModelError, match="too long for RK4"):
        RodPlant.designed(P, 14, step=1e-3)


@pytest.mark.parametrize("elements", [3, 61, 14.0, True])
def test_elements_out_of_range(elements: object) -> None:
    with pytest.raises(ParameterError, match="whole number from 4 to 60"):
        rod_mjcf(P, elements)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('name="motor2"', 'name="elbow"', "lacks the motor named 'motor2'"),
        ('"tip"', '"end"', "lacks the site named 'tip'"),
        ('dim="1"', 'dim="2"', "not valid MJCF"),
        ('<joint name="across14" class="across"/>', "", "two vertices of the flex"),
        ("<mujoco", "<mujco", "not valid MJCF"),
        ('<flex name="edges"', '<flex name="edges" active="false"', "held by an equality"),
        ("<elasticity", '<elasticity section="box" sectionsize="0.001 0.01"', "box"),
    ],
)
def test_other_files_are_refused(old: str, new: str, message: str) -> None:
    text = re.sub("<keyframe>.*</keyframe>", "", rod_mjcf(P), flags=re.DOTALL)
    assert old in text
    with pytest.raises(ModelError, match=message):
        load_rod(text=text.replace(old, new))


def test_a_missing_file_is_named() -> None:
    with pytest.raises(ModelError, match=r"nowhere\.xml: cannot read"):
        load_rod("nowhere.xml")
