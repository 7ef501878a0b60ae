"""The copy that loops step moves as the file does, to the bit, and is without what costs."""

from __future__ import annotations

import warnings
from pathlib import Path

import mujoco
import numpy as np
import pytest
from edits import DEFAULT, EDITS, edited
from random_edits import random_edit

from flexsim import FlexsimError
from flexsim.mjcf.arm_file import ArmFile
from flexsim.mjcf.edits import changed, with_motors, without_damping
from flexsim.mjcf.load import load_arm
from flexsim.numerics.mujoco_c import quiet_warnings
from flexsim.numerics.types import Array
from flexsim.plants.stepped import stepped

MODELS = Path(__file__).parents[2] / "models"
STEPS = 100
RANDOM = 120  # edits of the shipped files
FEWEST = 0.15  # of them that must be accepted, and slimmer: else nothing is tested
SHOWN = ("ngeom", "nsite", "nsensor", "ncam", "nlight")

FROM_GEOMS = edited(  # a payload whose mass is that of its geom
    '<site name="tip" pos="0.03469 0 0"/>',
    '<site name="tip" pos="0.03469 0 0"/><body name="ball" pos="0.03 0.01 0">'
    '<geom type="sphere" size="0.01" mass="0.02" contype="0" conaffinity="0"/></body>',
    edited('inertiafromgeom="false"', 'inertiafromgeom="auto"'),
)
FILES = {
    **{path.stem: path.read_text() for path in sorted(MODELS.glob("*.xml"))},
    **EDITS,
    "mass of a geom": FROM_GEOMS,
    "all mass": edited("<compiler ", '<compiler settotalmass="2" '),
    "energy": edited('contact="disable"', 'contact="disable" energy="enable" fwdinv="enable"'),
    "gravity": edited('gravity="disable"', 'gravity="enable"'),
    "gears": edited('gear="1"', 'gear="2.5"'),
    "range": edited('<joint name="joint2"', '<joint name="joint2" range="-3 1.3"'),
    "dry friction": edited('<joint name="hinge2"', '<joint name="hinge2" frictionloss="0.001"'),
    "Euler": edited('integrator="RK4"', 'integrator="Euler"', EDITS["16 segments"]),
    "implicitfast": edited('integrator="RK4"', 'integrator="implicitfast"', EDITS["16 segments"]),
}
AS_THEY_ARE = ("one_link",)  # its joint 1 is not in the text that a slim copy is made of
TOUCHING = edited('contact="disable" ', "").replace(
    'material="tip"/>', 'material="tip" contype="1" conaffinity="1"/>'
)


def moved(model: mujoco.MjModel, seed: int = 1) -> Array:
    """Return positions, rates and accelerations (STEPS, 3 nv) of a driven motion."""
    rng, data = np.random.default_rng(seed), mujoco.MjData(model)
    data.qpos[:2], data.qvel[:2] = rng.uniform(-2, 2, 2), rng.normal(size=2)
    rows = np.empty((STEPS, 3 * model.nv))
    with quiet_warnings():
        for row in rows:
            data.ctrl[:] = rng.uniform(-1, 1, 2) * (0.5, 0.05)
            mujoco.mj_step(model, data)
            row[:] = np.concatenate([data.qpos, data.qvel, data.qacc_warmstart])
    return rows


def copy_of(arm: ArmFile) -> mujoco.MjModel:
    return stepped(arm.model, arm.text)


def is_the_same(arm: ArmFile) -> bool:
    """Return whether the copy's motion is the model's, to the bit; a nan is one in both."""
    return np.array_equal(moved(copy_of(arm)), moved(arm.model), equal_nan=True)


def is_slim(model: mujoco.MjModel) -> bool:
    return not any(getattr(model, name) for name in SHOWN)


@pytest.mark.parametrize("name", FILES)
def test_it_moves_as_the_file_does_and_shows_nothing(name: str) -> None:
    arm = load_arm(text=FILES[name])
    assert is_slim(copy_of(arm)) == (name not in AS_THEY_ARE) and not is_slim(arm.model)
    assert is_the_same(arm)


def test_numbers_changed_after_compiling_are_taken_along() -> None:
    chain = load_arm(text=DEFAULT)
    for other in (
        changed(chain, stiffness=1.2, density=0.9, payload=0.03),
        with_motors(chain, 0.01, 0.0557),
        without_damping(chain),
    ):
        assert is_slim(copy_of(other)) and is_the_same(other)
        assert not np.array_equal(moved(copy_of(other)), moved(copy_of(chain)))


def test_what_touches_or_flies_is_stepped_as_it_is() -> None:
    for text in (TOUCHING, edited("<option ", '<option density="1.2" ')):
        arm = load_arm(text=text)
        assert copy_of(arm) is arm.model


def test_a_number_that_is_not_taken_along_is_seen() -> None:
    """Negative control: the comparison tells masses a last bit apart."""
    chain = load_arm(text=DEFAULT)
    other = copy_of(chain)
    other.body_mass[-1] *= 1 + 1e-15
    assert not np.array_equal(moved(other), moved(chain.model))


def test_whatever_is_done_to_a_file() -> None:
    rng = np.random.default_rng(2)
    texts = [path.read_text() for path in sorted(MODELS.glob("*.xml"))]
    slim = 0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for i in range(RANDOM):
            done, text = random_edit(rng, texts[i % len(texts)])
            try:
                arm = load_arm(text=text)
            except FlexsimError:
                continue
            assert is_the_same(arm), done
            slim += is_slim(copy_of(arm))
    assert slim > FEWEST * RANDOM
