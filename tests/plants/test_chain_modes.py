"""The robot of an MJCF file: its modes and masses against MuJoCo's own, and against the beam's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from edits import DEFAULT, EDITS, edited

from flexsim import ModelError, Parameters, load_chain
from flexsim.mjcf.as_parameters import parameters_of
from flexsim.mjcf.bodies import parts
from flexsim.mjcf.chain_file import mass_matrix
from flexsim.mjcf.edits import changed, without_damping
from flexsim.plants import assumed_modes as equations
from flexsim.plants.assumed_modes import assumed_modes
from flexsim.plants.chain_as_modes import clamped_damping, modes_of_chain, vibration
from flexsim.plants.modes_plant import AssumedModesPlant

CHAIN6 = Path(__file__).parents[2] / "models" / "chain6.xml"

EXACT = 1e-9  # relative: sums over bodies against MuJoCo's own
CURVATURE = 1e-4  # relative: differences of the mass matrix over 1 mm
COUPLING = 8e-4  # relative: 0.078 % in the second mode
SHORTENING = {1: 0.015, 2: 0.071, 3: 0.2}  # relative: a polyline of 7 pieces is less bent
DIGITS = 1e-11  # relative: the file has 12


@pytest.mark.parametrize("name", EDITS)
def test_mass_matrix_is_the_chains_to_second_order(name: str) -> None:
    """Along the modes: value, slope and curvature of the joints' block; value, slope of the rest.

    The equations' coupling of joint and modes has no second order; the chain's has.
    """
    chain = load_chain(text=EDITS[name])
    p = modes_of_chain(chain, 3)
    V = vibration(chain, parameters_of(chain), 3).hinges
    W = np.zeros((chain.model.nv, 5))
    W[:2, :2], W[2:, 2:] = np.eye(2), V
    rng = np.random.default_rng(1)
    for theta2 in (0.3, 1.2, 2.5):
        eta = rng.normal(size=3) * (1.0, 0.1, 0.01)

        def pair(s: float, theta2: float = theta2, eta: np.ndarray = eta) -> np.ndarray:
            q = np.concatenate([[0.0, theta2], s * eta])
            return np.stack(
                [W.T @ mass_matrix(chain.model, W @ q) @ W, equations.mass_matrix(p, q)]
            )

        h = 1e-3
        value, ahead, behind = pair(0.0), pair(h), pair(-h)
        scale = np.abs(value[0]).max()
        np.testing.assert_allclose(value[1], value[0], atol=EXACT * scale)
        slope = (ahead - behind) / (2 * h)
        np.testing.assert_allclose(slope[1], slope[0], atol=CURVATURE * np.abs(slope[0]).max())
        bend = ((ahead - 2 * value + behind) / h**2)[:, :2, :2]
        np.testing.assert_allclose(bend[1], bend[0], atol=CURVATURE * np.abs(bend[0]).max())


def test_unedited_file_is_the_analytic_beam_to_the_chains_accuracy() -> None:
    own, beam = modes_of_chain(load_chain(CHAIN6), 3), assumed_modes(Parameters(), 3)
    for name in ("L_R", "reach", "A", "J", "I_m2", "first_moment", "F_1", "F_2", "r_1", "r_2"):
        assert getattr(own, name) == pytest.approx(getattr(beam, name), rel=DIGITS), name
    np.testing.assert_allclose(own.stiffness, beam.stiffness, rtol=DIGITS)
    np.testing.assert_allclose(own.mass, beam.mass, rtol=DIGITS)
    for name in ("P", "X", "tip"):
        np.testing.assert_allclose(getattr(own, name), getattr(beam, name), rtol=COUPLING)
    for i, limit in SHORTENING.items():
        for name in ("M", "N", "slope"):
            ratio = getattr(own, name)[i - 1, i - 1] / getattr(beam, name)[i - 1, i - 1]
            assert abs(ratio - 1) < limit, (name, i)


def test_more_hinges_come_nearer_to_the_beam() -> None:
    fine, beam = (
        modes_of_chain(load_chain(text=EDITS["16 segments"]), 3),
        assumed_modes(Parameters()),
    )
    coarse = modes_of_chain(load_chain(text=EDITS["4 segments"]), 3)
    for name in ("M", "N", "slope", "P", "X", "tip"):
        wanted = getattr(beam, name)
        near = np.abs(getattr(fine, name) - wanted).max()
        assert near < np.abs(getattr(coarse, name) - wanted).max() / 5, name


def test_parameters_are_read_from_the_bodies() -> None:
    usual, found = Parameters(), parameters_of(load_chain(CHAIN6))
    for name in ("L_R", "I_R0", "I_H", "m_H", "r", "L", "rho", "F_1", "F_2", "I_m1", "r_1"):
        assert getattr(found, name) == pytest.approx(getattr(usual, name), rel=DIGITS), name
    assert found.EI == pytest.approx(usual.EI, rel=1.1e-4)  # by its compliance
    geared = edited('joint="joint1" gear="1"', 'joint="joint1" gear="2"')
    assert parameters_of(load_chain(text=geared)).r_1 == 2.0
    assert parameters_of(load_chain(text=geared)).F_1 == pytest.approx(usual.F_1 / 4)
    assert parameters_of(load_chain(text=EDITS["heavy link"])).I_R0 == pytest.approx(0.5)
    assert parameters_of(load_chain(text=EDITS["longer"])).L == pytest.approx(0.6)
    loaded = parameters_of(load_chain(text=EDITS["payload"]))
    assert (loaded.m_b, loaded.payload) == (pytest.approx(0.0785), 0.05)


def test_a_tip_mass_is_rayleighs() -> None:
    """A clamped uniform beam with a heavy tip mass: omega^2 = 3 EI/((m + 33/140 m_b) L^3)."""
    p, payload = Parameters(), 5.0
    omega = vibration(changed(load_chain(CHAIN6), payload=payload), p).clamped[0]
    wanted = np.sqrt(3 * p.EI / ((payload + 33 / 140 * p.m_b) * p.L**3))
    assert omega == pytest.approx(wanted, rel=1e-4)  # static and dynamic shapes differ


def test_changes_scale_frequencies() -> None:
    chain = load_chain(CHAIN6)
    usual = vibration(chain, Parameters()).clamped
    np.testing.assert_allclose(
        vibration(changed(chain, stiffness=1.21), Parameters()).clamped, 1.1 * usual, rtol=1e-12
    )
    np.testing.assert_allclose(
        vibration(changed(chain, density=1.21), Parameters()).clamped, usual / 1.1, rtol=1e-12
    )
    np.testing.assert_array_equal(vibration(chain, Parameters()).clamped, usual)  # left alone


def test_a_payload_added_is_that_written_into_the_file() -> None:
    text = EDITS["payload"].replace('diaginertia="5e-6 5e-6 5e-6"', 'diaginertia="0 0 0"')
    written, added = load_chain(text=text), changed(load_chain(CHAIN6), payload=0.05)
    q = np.array([0.3, 1.2, 0.1, -0.05, 0.02, 0.1, 0.0, 0.03])
    np.testing.assert_allclose(
        mass_matrix(added.model, q), mass_matrix(written.model, q), rtol=1e-10
    )


def test_damping_ratio_is_that_of_the_equations() -> None:
    chain = load_chain(text=EDITS["damped"])
    p = modes_of_chain(chain, 3)
    ratio = np.diag(p.damping) / (2 * np.sqrt(p.stiffness * p.mass))
    assert ratio[0] == pytest.approx(0.01, rel=0.02)  # the README's 1 %
    np.testing.assert_allclose(ratio, clamped_damping(chain)[:3], rtol=0.02)  # modes couple
    assert clamped_damping(load_chain(CHAIN6))[0] == pytest.approx(1e-3, rel=1e-9)
    assert not clamped_damping(without_damping(load_chain(CHAIN6))).any()


def test_beam_and_hub_are_told_apart() -> None:
    link, hub, beam = parts(load_chain(text=EDITS["payload"]))
    assert (link.mass.tolist(), hub.mass.tolist()) == ([1.0], [0.47])
    assert beam.mass.sum() == pytest.approx(0.1285) and len(beam.ids) == 8


CANNOT = {
    "limited hinge": (
        edited('<joint name="hinge2"', '<joint name="hinge2" range="-1 1"'),
        "joint 'hinge2' has a limited range",
    ),
    "bent spring": (
        edited('<joint name="hinge2"', '<joint name="hinge2" springref="0.1"'),
        "joint 'hinge2' has a spring that is not at rest",
    ),
    "spring at a joint": (
        edited('damping="0.0002" armature="0"', 'damping="0.0002" armature="0" stiffness="1"'),
        "joint 'joint1' has a spring",
    ),
    "dry friction": (
        edited('<joint name="joint2"', '<joint name="joint2" frictionloss="0.1"'),
        "joint 'joint2' has dry friction",
    ),
    "contacts": (
        edited('contact="disable" gravity', "gravity")
        .replace(
            '<geom name="base" class="motor"',
            '<geom name="wall" type="box" pos="0.5 0.5 0" size="0.1 0.1 0.1"/>'
            '<geom name="base" class="motor"',
        )
        .replace('<geom class="mark"/>', '<geom class="mark" conaffinity="1"/>'),
        "a geom of 'segment6' can make contact with geom 'wall'",
    ),
    "gravity": (
        edited('gravity="disable" autoreset', "autoreset").replace(
            "<option ", '<option gravity="0 -9.81 0" '
        ),
        "gravity is",
    ),
    "air": (edited("<option ", '<option density="1.2" '), "density or viscosity"),
    "mass beside the axis": (
        edited('<inertial pos="0.017345 0 0"', '<inertial pos="0.017345 0.01 0"'),
        "body 'segment6' has its centre of mass 0.01 m beside",
    ),
    "limited torque": (
        edited('<joint name="joint1"', '<joint name="joint1" actuatorfrcrange="-0.01 0.01"'),
        "joint 'joint1' has a limited torque",
    ),
    "motor with an armature": (
        edited('joint="joint1" gear="1"', 'joint="joint1" gear="1" armature="0.1"'),
        "actuator 'motor1' has an armature",
    ),
    "motor with a damper": (
        edited('joint="joint1" gear="1"', 'joint="joint1" gear="1" damping="0.1"'),
        "actuator 'motor1' has a damping",
    ),
    "no springs": (edited('contact="disable"', 'contact="disable" spring="disable"'), "springs"),
    "no dampers": (edited('contact="disable"', 'contact="disable" damper="disable"'), "dampers"),
    "contact pair": (
        edited('contact="disable" gravity', "gravity")
        .replace('material="tip"/>', 'material="tip" name="end"/>')
        .replace(
            'name="base" class="motor" size="0.05 0.038" pos="0 0 -0.062"',
            'name="base" class="motor" size="0.05 0.038" pos="0.3 0.3 0"',
        )
        .replace(
            "<actuator>",
            '<contact><pair name="knock" geom1="base" geom2="end"/></contact>\n  <actuator>',
        ),
        "geom '(base|end)' can make contact with geom '(base|end)'",
    ),
    "limited motor": (
        edited('joint="joint1" gear="1"', 'joint="joint1" gear="1" ctrlrange="-1 1"'),
        "actuator 'motor1' has a limited range",
    ),
    "soft all over": (
        edited('stiffness="3.45787937081"', 'stiffness="0"'),
        "joint 'hinge3' has no stiffness",
    ),
}


def test_geoms_that_reach_nothing_are_no_contact() -> None:
    """A base that could touch, but stands below the arm; a post that it could reach is above."""
    text = edited('contact="disable" gravity', "gravity").replace(
        '<geom name="base" class="motor"', '<geom name="base" type="cylinder"'
    )
    assert AssumedModesPlant.of_chain(load_chain(text=text)).modes == 3


@pytest.mark.parametrize("name", CANNOT)
def test_what_no_mode_has_is_refused_by_name(name: str) -> None:
    text, words = CANNOT[name]
    chain = load_chain(text=text)
    with pytest.raises(ModelError, match=words):
        AssumedModesPlant.of_chain(chain)


def test_mass_beside_the_rigid_link_is_carried() -> None:
    """The link only turns, so a mass beside it is one at the same distance: 0.25 + 0.0125."""
    text = edited(
        '<inertial pos="0 0 0" mass="1" diaginertia="0.25',
        '<inertial pos="0.1 0.05 0" mass="1" diaginertia="0.25',
    )
    assert parameters_of(load_chain(text=text)).I_R0 == pytest.approx(0.25 + 0.1**2 + 0.05**2)


@pytest.mark.parametrize(
    "old, new, words",
    [
        ('joint="joint1" gear="1"', 'joint="joint1" gear="-1"', "'motor1' has the gear -1"),
        ('joint="joint2" gear="1"', 'joint="joint2" gear="0"', "'motor2' has the gear 0"),
        ('mass="0.47"', 'mass="0"', "body 'hub' has the mass"),
    ],
)
def test_what_the_robot_cannot_have_names_its_element(old: str, new: str, words: str) -> None:
    with pytest.raises(ModelError, match=words):
        parameters_of(load_chain(text=edited(old, new)))


def test_more_modes_than_hinges_are_refused() -> None:
    with pytest.raises(ModelError, match="has 6 hinges along the beam; at least 7 are needed"):
        modes_of_chain(load_chain(text=DEFAULT), 7)
