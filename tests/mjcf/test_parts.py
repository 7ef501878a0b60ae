"""A beam in other people's files: right where it is, and nothing else moved."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from flexsim import ModelError, ParameterError
from flexsim.arm.graded_beam import GradedBeam
from flexsim.arm.graded_chain import GradedChain, design_graded
from flexsim.mjcf.parts.attach import attached
from flexsim.mjcf.parts.beam_xml import BeamPart
from flexsim.mjcf.parts.insert import Added, with_keys
from flexsim.numerics.mujoco_c import quiet_warnings

MODELS = Path(__file__).parents[2] / "models"
EXACT = 1e-10  # relative: twelve digits in the file
# A small arm as others write them: degrees, defaults for all joints, a floating base, a mesh, a
# body that is empty, one on a line, keyframes with positions, rates and neither
ARM = """\
<mujoco model="small arm">
  <!-- two dashes -- in a comment -->
  <compiler angle="degree" meshdir="assets"/>
  <option timestep="0.002" integrator="implicitfast"/>
  <default>
    <joint damping="0.5" armature="0.01" limited="true" range="-90 90" frictionloss="0.1"/>
    <geom type="capsule" size="0.02" margin="0.001"/>
    <default class="finger"><joint type="slide" range="0 0.04"/></default>
  </default>
  <asset><mesh name="rock" file="rock.obj"/></asset>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 .1"/>
    <body name="base" pos="0 0 1">
      <freejoint name="float"/>
      <geom type="mesh" mesh="rock"/>
      <body name="upper" pos="0 0 .2">
        <joint name="shoulder" axis="0 1 0"/>
        <geom fromto="0 0 0 .3 0 0" mass="1"/>
        <body name="wrist" pos=".3 0 0"><joint name="roll" axis="1 0 0"/><geom mass=".3"
             fromto="0 0 0 .1 0 0"/></body>
        <body name="tool" pos=".3 0 .1" childclass="finger">
          <joint name="grip" axis="0 1 0"/>
          <geom size=".01" fromto="0 0 0 .05 0 0" mass=".1"/>
        </body>
        <body name="bare" pos="0 .1 0"/>
      </body>
    </body>
    <body name="ball" pos="1 0 1"><freejoint/><geom type="sphere" size=".05" mass=".2"/></body>
  </worldbody>
  <equality><joint joint1="grip" joint2="roll" polycoef="0 .01 0 0 0"/></equality>
  <actuator><position name="p" joint="shoulder" kp="50"/><motor joint="grip"/></actuator>
  <sensor><jointpos joint="roll"/></sensor>
  <keyframe>
    <key name="home" qpos="0 0 1 1 0 0 0
      .1 .2 .01
      1 0 1 1 0 0 0" qvel='0 0 0 0 0 0  1 2 3  4 5 6 7 8 9' ctrl=".1 0"/>
    <key name="still" ctrl=".2 0"/>
  </keyframe>
</mujoco>
"""
ROCK = "v 0 0 0\nv .1 0 0\nv 0 .1 0\nv 0 0 .1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
PARENTS = ("wrist", "bare", "base", "tool", "ball", "world")


@pytest.fixture(scope="module")
def chain() -> GradedChain:
    return design_graded(GradedBeam.uniform(0.5, 0.349, 0.157, EI_out=20.0), 4)


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    (tmp_path / "assets").mkdir()
    (tmp_path / "assets" / "rock.obj").write_text(ROCK)
    path = tmp_path / "arm.xml"
    path.write_text(ARM)
    return path


def compiled(text: str, folder: Path) -> mujoco.MjModel:
    path = folder / "compiled.xml"
    path.write_text(text)
    with quiet_warnings():
        return mujoco.MjModel.from_xml_path(str(path))


def without(text: str, added: str) -> bool:
    """Return whether text is another with lines put in, its own in their order."""
    lines = iter(added.splitlines())
    return all(any(line == other for other in lines) for line in text.splitlines())


@pytest.mark.parametrize("parent", PARENTS)
@pytest.mark.parametrize("out", [False, True])
def test_a_beam_is_itself_on_any_body(
    arm: Path, chain: GradedChain, parent: str, out: bool
) -> None:
    made = attached(arm, parent, BeamPart(chain, out=out, eta=1e-3))
    np.testing.assert_allclose(made.frequency, made.wanted, rtol=EXACT)
    np.testing.assert_allclose(made.frequency_out, made.wanted_out, rtol=EXACT)
    assert len(made.frequency_out) == (3 if out else 0)
    model, before = compiled(made.text, arm.parent), compiled(ARM, arm.parent)
    assert model.nq == before.nq + 4 * (1 + out)
    assert model.body(model.body("beam_root").parentid[0]).name == parent
    for i in range(1, 5):
        joint = model.joint(f"beam_hinge{i}")
        assert joint.damping == pytest.approx(1e-3 * joint.stiffness, rel=1e-10)
        assert model.dof_armature[joint.dofadr[0]] == model.dof_frictionloss[joint.dofadr[0]] == 0


@pytest.mark.parametrize("parent", PARENTS)
def test_keyframes_keep_what_they_said(arm: Path, chain: GradedChain, parent: str) -> None:
    model = compiled(attached(arm, parent, BeamPart(chain)).text, arm.parent)
    before = compiled(ARM, arm.parent)
    for key in ("home", "still"):
        now, then = model.key(key), before.key(key)
        np.testing.assert_array_equal(now.ctrl, then.ctrl)
        for i in range(before.njnt):
            name = before.joint(i).name or None
            ours = [j for j in range(model.njnt) if (model.joint(j).name or None) == name]
            (j,) = ours if name else [ours[-1]]
            for values, was, place, old in (
                (now.qpos, then.qpos, model.jnt_qposadr, before.jnt_qposadr),
                (now.qvel, then.qvel, model.jnt_dofadr, before.jnt_dofadr),
            ):
                width = 7 if before.jnt_type[i] == 0 else 1
                width -= width == 7 and values is now.qvel
                np.testing.assert_array_equal(
                    values[place[j] : place[j] + width], was[old[i] : old[i] + width]
                )
        for i in range(1, 5):
            joint = model.joint(f"beam_hinge{i}")
            assert now.qpos[joint.qposadr[0]] == now.qvel[joint.dofadr[0]] == 0


@pytest.mark.parametrize("name", ["chain6.xml", "chain4.xml", "rod.xml"])
@pytest.mark.parametrize("parent", ["hub", "world"])
def test_our_own_models_carry_a_second_beam(name: str, parent: str, chain: GradedChain) -> None:
    made = attached(MODELS / name, parent, BeamPart(chain, prefix="boom"))
    np.testing.assert_allclose(made.frequency, made.wanted, rtol=EXACT)
    text = (MODELS / name).read_text()
    assert without(text[: text.index("  <keyframe>")], made.text)


def test_all_other_text_stays(arm: Path, chain: GradedChain) -> None:
    made = attached(arm, "tool", BeamPart(chain))
    keys = ARM.index("  <keyframe>")
    assert without(ARM[:keys], made.text) and not without(made.text, ARM)
    arm.write_bytes(ARM.replace("\n", "\r\n").encode())
    windows = attached(arm, "tool", BeamPart(chain)).text
    assert windows == made.text.replace("\n", "\r\n")


def test_two_beams_have_two_prefixes(arm: Path, chain: GradedChain) -> None:
    arm.write_text(attached(arm, "wrist", BeamPart(chain)).text)
    with pytest.raises(ParameterError, match="has a default class 'beam' already; give the beam"):
        attached(arm, "tool", BeamPart(chain))
    made = attached(arm, "beam_segment4", BeamPart(chain, prefix="second"))
    np.testing.assert_allclose(made.frequency, made.wanted, rtol=EXACT)


def test_place_and_attitude_are_as_asked_for(arm: Path, chain: GradedChain) -> None:
    half = 0.5**0.5
    part = BeamPart(chain, pos=(0.0, 0.1, 0.2), quat=(half, 0.0, half, 0.0), axis="y")
    model = compiled(attached(arm, "world", part).text, arm.parent)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    tip, hinge = data.site("beam_tip").xpos, data.xaxis[model.joint("beam_hinge1").id]
    np.testing.assert_allclose(tip, [0.0, 0.1, 0.2 - 0.5], atol=1e-10)  # x turned about y: down
    np.testing.assert_allclose(hinge, [0.0, 1.0, 0.0], atol=1e-10)  # the clamp's y


def test_includes_stay_includes(arm: Path, chain: GradedChain) -> None:
    scene = arm.with_name("scene.xml")
    scene.write_text(
        '<mujoco>\n  <include file="arm.xml"/>\n'
        '  <worldbody><body name="post"/></worldbody>\n</mujoco>'
    )
    with pytest.raises(ModelError, match="body 'wrist' is in a file that it includes"):
        attached(scene, "wrist", BeamPart(chain))
    with pytest.raises(ModelError, match="keyframe with positions is in a file that it includes"):
        attached(scene, "post", BeamPart(chain))
    arm.write_text(ARM[: ARM.index("  <keyframe>")] + "</mujoco>")
    made = attached(scene, "post", BeamPart(chain))
    assert '<include file="arm.xml"/>' in made.text and "shoulder" not in made.text
    assert compiled(made.text, arm.parent).joint("beam_hinge4").id > 0


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("<joint damping", "<joint bad='1' damping", "not valid MJCF"),
        ('file="rock.obj"', 'file="none.obj"', "does not compile"),
        ('angle="degree"', 'angle="degree" settotalmass="9"', "settotalmass"),
        ('angle="degree"', 'angle="degree" inertiafromgeom="true"', "inertiafromgeom=true"),
        ('integrator="implicitfast"/>', '><flag spring="disable"/></option>', "disables springs"),
    ],
)
def test_files_that_make_another_beam_are_refused(
    arm: Path, chain: GradedChain, old: str, new: str, words: str
) -> None:
    assert old in ARM
    arm.write_text(ARM.replace(old, new))
    with pytest.raises(ModelError, match=words) as error:
        attached(arm, "wrist", BeamPart(chain))
    assert "\n" not in str(error.value)


def test_a_near_miss_is_named(arm: Path, chain: GradedChain) -> None:
    with pytest.raises(ParameterError, match=r"no body 'wirst'.*Did you mean 'wrist'"):
        attached(arm, "wirst", BeamPart(chain))


def test_zeros_go_where_they_belong() -> None:
    text = '<mujoco><keyframe><key qpos="1 2\n 3" qvel="4 5 6"/></keyframe></mujoco>'
    assert 'qpos="1 0 0 2\n 3" qvel="0 0 4 5 6"' in with_keys(text, Added(1, 0, 2), "", text)
    assert 'qpos="1 2\n 3 0 0" qvel="4 5 6 0 0"' in with_keys(text, Added(3, 3, 2), "", text)
