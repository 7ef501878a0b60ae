"""Files of others, as the reader takes them: chain and rod by one list, all reasons at once."""

from __future__ import annotations

import os
import re
import signal
import sys
import time
from pathlib import Path

import mujoco
import numpy as np
import pytest
from processes import process

from flexsim import ModelError
from flexsim.mjcf.arm_file import ArmFile
from flexsim.mjcf.load import load_arm
from flexsim.mjcf.reading.elements import elements
from flexsim.mjcf.reading.limits import ELEMENTS, require_small
from flexsim.mjcf.reading.names import Names
from flexsim.mjcf.reading.text import MOST_BYTES, with_includes
from studies.main import main

MODELS = Path(__file__).parents[2] / "models"
CHAIN, ROD = (MODELS / "chain6.xml").read_text(), (MODELS / "rod.xml").read_text()
QUICK = 2.0  # [s] within which a signal ends a command
SOON = 0.1  # [s] that reading the usual file may take


def edited(text: str, old: str, new: str) -> str:
    assert old in text, old
    return text.replace(old, new, 1)


def chain(old: str, new: str) -> str:
    return edited(CHAIN, old, new)


def rod(old: str, new: str) -> str:
    return edited(ROD, old, new)


# ---- as MuJoCo reads them


@pytest.mark.parametrize(
    "text",
    [
        chain("<option ", "<!-- a -- b --><option "),
        chain('name="hub" pos', 'name="hu&#27;[2Jb" pos'),
        chain('name="hub" pos', 'name="hub&undefined;" pos'),
        f'\n \t<?xml version="1.0"?>\n{CHAIN}',
        f'\ufeff<?xml version="1.0"?>\n{CHAIN}',
        f'<!DOCTYPE mujoco [<!ENTITY x SYSTEM "file:///dev/zero">]>\n{CHAIN}',
        chain("<worldbody>", '<![CDATA[<include file="nowhere.xml"/>]]><worldbody>'),
        chain("<worldbody>", '<!-- <include file="nowhere.xml"/> --><worldbody>'),
    ],
)
def test_what_mujoco_reads_is_read(text: str, tmp_path: Path) -> None:
    path = tmp_path / "arm.xml"
    path.write_bytes(text.encode())
    arm, own = load_arm(path), mujoco.MjModel.from_xml_path(str(path))
    assert np.array_equal(arm.model.body_mass, own.body_mass)
    assert [arm.model.body(i).name for i in range(own.nbody)] == [
        own.body(i).name for i in range(own.nbody)
    ]
    assert load_arm(text=arm.text).model.nv == own.nv


def test_what_mujoco_does_not_read_is_one_line() -> None:
    for text, words in (
        (chain('name="hub" pos', 'name="hub&#xD800;" pos'), "is no character"),
        ('<!-- --><?xml version="1.0"?>' + CHAIN, "not valid MJCF: XML parse error"),
        (CHAIN[:-30], "not valid MJCF"),
        ("<", "not valid MJCF"),
        (CHAIN.replace("<mujoco ", "<urdf "), "not valid MJCF"),
    ):
        with pytest.raises(ModelError, match=words) as refused:
            load_arm(text=text)
        assert "\n" not in str(refused.value)


def test_elements_are_found_where_they_are() -> None:
    text = "<a><!-- <b> --><c x='1>2' y=\"&lt;\"/><d></d></a><e>"
    found = elements(text)
    assert [(each.tag, each.parent, each.depth) for each in found] == [
        ("a", -1, 0),
        ("c", 0, 1),
        ("d", 0, 1),
        ("e", -1, 0),
    ]
    assert found[1].attributes == {"x": "1>2", "y": "<"}
    assert text[found[0].inner : found[0].inner_end] == text[3:-7]
    assert found[3].end is None


# ---- includes


@pytest.mark.parametrize("text", [CHAIN, ROD], ids=["chain", "rod"])
def test_includes_are_from_the_files_own_folder(
    text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And a run's file needs none of them."""
    for folder, step in (("sub", 0.00025), (".", 0.5)):
        (tmp_path / folder).mkdir(exist_ok=True)
        step_of = f'<mujoco><option timestep="{step}"/></mujoco>'
        (tmp_path / folder / "extra.xml").write_text(step_of)
    included = re.sub(r'<option timestep="[^"]*"', '<include file="extra.xml"/><option', text)
    (tmp_path / "sub" / "arm.xml").write_text(included)
    monkeypatch.chdir(tmp_path)
    arm = load_arm("sub/arm.xml")
    assert arm.step == 0.00025
    (tmp_path / "sub" / "extra.xml").unlink()
    assert load_arm(text=arm.text).step == 0.00025


def test_an_include_within_an_include_is_found_as_mujoco_does(tmp_path: Path) -> None:
    """From the folder of the first file, else from that of the file it is in."""
    (tmp_path / "deep").mkdir()
    (tmp_path / "deep" / "a.xml").write_text('<mujoco><include file="b.xml"/></mujoco>')
    path = tmp_path / "arm.xml"
    path.write_text(chain("<option ", '<include file="deep/a.xml"/><option '))
    for folder, bound in (("deep", 1.5), (".", 2.5)):
        (tmp_path / folder / "b.xml").write_text(f'<mujoco><statistic extent="{bound}"/></mujoco>')
        assert load_arm(path).model.stat.extent == 0.81  # the file's own comes later
        text = with_includes(path.read_text(), tmp_path)
        assert f'extent="{bound}"' in text


def test_includes_that_cannot_be_read_are_one_line(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "big.xml").write_text("<mujoco>" + " " * MOST_BYTES + "</mujoco>")
    (tmp_path / "open.xml").write_text("<mujoco><option>")
    path = tmp_path / "arm.xml"
    for name, words in (
        ("/dev/zero", "it is a device"),
        ("pipe", "it is a pipe"),
        (".", "it is a folder"),
        ("big.xml", f"more than {MOST_BYTES:,} bytes"),
        ("open.xml", "no outermost element"),
        ("gone.xml", "No such file"),
    ):
        path.write_text(chain("<option ", f'<include file="{name}"/><option '))
        with pytest.raises(ModelError, match=rf"arm\.xml: includes .*{re.escape(words)}"):
            load_arm(path)


# ---- limits


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            chain(
                "<worldbody>",
                '<worldbody><replicate count="3000000" offset="0 0 1"><geom size="1"/></replicate>',
            ),
            f"more than {ELEMENTS} elements, most of them <geom>",
        ),
        (
            chain(
                "<worldbody>",
                '<worldbody><replicate count="200"><replicate count="200"><site/></replicate>'
                "</replicate>",
            ),
            f"more than {ELEMENTS} elements, most of them <site>",
        ),
        (chain("<worldbody>", "<worldbody>" + "<geom/>" * 20_000), "elements"),
        (chain("<worldbody>", "<worldbody>" + "<body>" * 400 + "</body>" * 400), "deep"),
        (
            chain(
                "<asset>", '<asset><texture type="2d" builtin="flat" width="40000" height="40000"/>'
            ),
            "textures of more than",
        ),
        (
            chain("<asset>", '<asset><texture type="skybox" builtin="flat" width="9000"/>'),
            "textures of more than",
        ),
        (
            chain("<asset>", '<asset><hfield name="h" nrow="90000" ncol="90000" size="1 1 1 1"/>'),
            "height fields of more than",
        ),
        (
            chain("<asset>", '<asset><mesh name="m" builtin="supertorus" params="9999 1 1"/>'),
            "<mesh> has params over",
        ),
        (
            rod(
                "<worldbody>",
                '<worldbody><flexcomp name="f" type="grid" count="900 900 1" spacing="1 1 1"/>',
            ),
            "elements, most of them <flexcomp>",
        ),
        (
            rod(
                "<worldbody>",
                '<worldbody><body name="b"><flexcomp name="f" type="direct" dim="1" '
                f'point="{"0 " * 60_000}" element="0 1"/></body>',
            ),
            "elements, most of them <flexcomp>",
        ),
        (chain("<asset>", "<asset>" + '<mesh builtin="sphere" params="4"/>' * 30), "20 meshes"),
        (chain("<asset>", f'<asset><mesh vertex="{"0 " * 90_000}"/>'), "20,000 vertices"),
        (chain("<asset>", '<asset><mesh name="m"><plugin instance="t"/></mesh>'), "plugin builds"),
        (
            chain("<actuator>", "<actuator>" + '<muscle joint="hinge1"/>' * 60),
            "more than 50 actuators",
        ),
        (chain("<worldbody>", '<size memory="100G"/><worldbody>'), "<size> has memory '100G'"),
        (chain("<worldbody>", '<size nuserdata="2000000000"/><worldbody>'), "nuserdata"),
        (
            chain(
                "<worldbody>", '<custom><numeric name="n" size="900000000"/></custom><worldbody>'
            ),
            "<numeric> has size over",
        ),
        (
            chain("<compiler ", '<compiler><lengthrange inttotal="1e12"/></compiler><compiler '),
            "<lengthrange> asks for more than",
        ),
        (chain("<asset>", '<asset><mesh file="/dev/zero"/>'), "needs other files"),
        (chain("<sensor>", '<sensor><user name="u" dim="1500000000"/>'), "<user> has dim over"),
        (chain("<sensor>", '<sensor><contact name="c" num="1e9"/>'), "<contact> has num over"),
        (
            chain("<sensor>", '<sensor><rangefinder name="f" camera="wide"/>').replace(
                "<worldbody>", '<worldbody><camera name="wide" resolution="40000 40000"/>'
            ),
            "rangefinder of over 100,000 rays",
        ),
    ],
)
def test_what_would_take_long_to_compile_is_refused_before(text: str, words: str) -> None:
    start = time.perf_counter()
    with pytest.raises(ModelError, match=words) as refused:
        load_arm(text=text)
    assert time.perf_counter() - start < QUICK
    assert "\n" not in str(refused.value)


def test_the_limits_are_named_together() -> None:
    text = chain("<asset>", '<asset><texture type="2d" width="40000" height="40000"/>')
    text = edited(text, "<worldbody>", '<size memory="100G"/><worldbody>')
    with pytest.raises(ModelError, match=r"textures .*; <size> has memory"):
        load_arm(text=text)


def test_what_is_within_the_limits_compiles_at_once(tmp_path: Path) -> None:
    """So that MuJoCo's compiler, which no signal ends, is never long; measured: 0.3 s."""
    many = f'<replicate count="{ELEMENTS - 200}" offset="0 0 1"><geom size="0.01"/></replicate>'
    text = edited(chain("<worldbody>", f"<worldbody>{many}"), "<asset>", "<asset>" + PICTURES)
    load_arm(text=CHAIN)  # what numba compiles of the checks is compiled
    start = time.perf_counter()
    arm = load_arm(text=text)
    assert time.perf_counter() - start < QUICK
    assert arm.model.ngeom > ELEMENTS - 300 and arm.model.ntexdata > 4e7


PICTURES = '<texture name="t" type="2d" builtin="checker" width="4000" height="4000"/>'


def test_the_limits_cost_little() -> None:
    load_arm(text=CHAIN)
    start = time.perf_counter()
    require_small("the text", CHAIN)
    assert time.perf_counter() - start < SOON


@pytest.mark.parametrize(
    "number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.slow)]
)
def test_a_signal_ends_a_command_while_it_reads_a_large_file(
    number: signal.Signals, tmp_path: Path
) -> None:
    many = f'<replicate count="{ELEMENTS - 200}" offset="0 0 1"><geom size="0.01"/></replicate>'
    (tmp_path / "arm.xml").write_text(chain("<worldbody>", f"<worldbody>{many}"))
    code = (
        "import signal, sys, studies.main, flexsim.mjcf.load as load\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"  # as if not started by nohup
        "def often(*a, **k):\n"
        "    print('reading', flush=True)\n"
        "    while True: load.load_arm('arm.xml')\n"
        "import flexsim.robot.robot as robot; robot.load_arm = often\n"
        "sys.exit(studies.main.main(['modes', 'arm.xml']))\n"
    )
    with process([sys.executable, "-c", code], cwd=tmp_path) as reading:
        assert reading.stdout is not None and reading.stdout.readline() == "reading\n"
        time.sleep(0.3)
        start = time.perf_counter()
        reading.send_signal(number)
        reading.wait(10)
        assert time.perf_counter() - start < QUICK
        assert reading.returncode in (130, 143)


# ---- chain and rod, by one list

SPRUNG = '<tendon><fixed stiffness="5"><joint joint="joint1" coef="1"/></fixed></tendon>'
MOTOR = '<motor name="motor1" joint="joint1" gear="1"/>'
PID = '<extension><plugin plugin="mujoco.pid"/></extension>'
NOT_A_TORQUE = {
    "position": '<position name="motor1" joint="joint1" kp="100"/>',
    "velocity": '<velocity name="motor1" joint="joint1" kv="3"/>',
    "affine": '<general name="motor1" joint="joint1" biastype="affine" biasprm="0 -10 0"/>',
    "filtered": '<general name="motor1" joint="joint1" dyntype="filter" dynprm="0.1"/>',
    "plugin": '<plugin name="motor1" joint="joint1" plugin="mujoco.pid">'
    '<config key="kp" value="10"/></plugin>',
    "other joint": '<motor name="motor1" joint="joint2"/>',
    "slow": '<motor name="motor1" joint="joint1" delay="0.005" nsample="10"/>',
    "tiny gear": '<motor name="motor1" joint="joint1" gear="1e-300"/>',
}
FLAG = '<flag contact="disable"'
FOR_BOTH = {  # by name: (old, new, words)
    **{name: (MOTOR, new, "'motor1'") for name, new in NOT_A_TORQUE.items()},
    "tendon": ("<actuator>", f"{SPRUNG}<actuator>", "has a tendon"),
    "sleep": (FLAG, f'{FLAG} sleep="enable"', "enables sleep"),
    "no actuation": (FLAG, f'{FLAG} actuation="disable"', "disables actuation"),
    "no group": ("<option ", '<option actuatorgroupdisable="0" ', "group that is disabled"),
    "turned": ('<joint name="joint2"', '<joint axis="0 1 0" name="joint2"', "turn about z"),
    "negative mass": ('mass="0.47"', 'mass="-0.47"', "-0.47"),
}
FOR_RODS = {
    "slide stiff": ('axis="0 1 0"/>', 'axis="0 1 0" stiffness="20"/>', "'across1' and 13 more"),
    "slide heavy": ('axis="0 1 0"/>', 'axis="0 1 0" armature="0.01"/>', "'across1' and 13 more"),
    "child": (
        '<joint name="across10" class="across"/>',
        '<joint name="across10" class="across"/><body pos="0.02 0 0"><inertial pos="0 0 0" '
        'mass="0.02" diaginertia="1e-6 1e-6 1e-6"/></body>',
        "a body without a name is on the vertex 'vertex10'",
    ),
    "no constraint": (FLAG, f'{FLAG} constraint="disable"', "disables constraint"),
    "no equality": (FLAG, f'{FLAG} equality="disable"', "disables equality"),
    "edges beyond their limits": (
        "<deformable>",
        '<option><flag refsafe="disable"/></option><default/><deformable>',
        "runs away within 50 steps",
    ),
    "slide turned": (
        '<joint name="across3" class="across"/>',
        '<joint name="across3" class="across" axis="0 0 1"/>',
        "slides only beyond them",
    ),
}


@pytest.mark.parametrize("kind", ["chain", "rod"])
@pytest.mark.parametrize("name", FOR_BOTH)
def test_chain_and_rod_refuse_the_same_by_name(kind: str, name: str) -> None:
    old, new, words = FOR_BOTH[name]
    text = edited(CHAIN if kind == "chain" else ROD, old, new)
    if name == "plugin":
        text = edited(text, "<actuator>", f"{PID}<actuator>")
    with pytest.raises(ModelError, match=words) as refused:
        load_arm(text=text)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("name", FOR_RODS)
def test_what_a_rod_is_not_is_refused_by_name(name: str) -> None:
    old, new, words = FOR_RODS[name]
    text = rod(old, new)
    if "edges" in name:
        text = edited(text, 'solref="0.001 1"', 'solref="1e-6 1"')
    with pytest.raises(ModelError, match=words):
        load_arm(text=text)


def test_a_body_that_may_sleep_is_none_while_sleep_is_off() -> None:
    arm = load_arm(text=chain('<body name="link1"', '<body name="link1" sleep="allowed"'))
    assert isinstance(arm, ArmFile)


# ---- all reasons at once

FOREIGN = """<mujoco model="foreign arm">
  <compiler angle="radian"/>
  <option timestep="0.001" integrator="implicit"/>
  <worldbody>
    <body name="link1">
      <inertial pos="0.15 0 0" mass="2" diaginertia="0.01 0.01 0.01"/>
      <joint name="shoulder" axis="0 0 1"/>
      <body name="link2" pos="0.32 0 0">
        <inertial pos="0.0 0 0" mass="0.1" diaginertia="1e-4 1e-4 1e-4"/>
        <joint name="elbow" axis="0 0 1"/>
        BEAM
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor name="act1" joint="shoulder"/><motor name="act2" joint="elbow"/>
  </actuator>
  <sensor><jointpos joint="elbow"/><actuatorfrc actuator="act2"/></sensor>
</mujoco>"""
PIECE = """<body name="v{i}" pos="{at} 0 0">
<inertial pos="0.055 0 0" mass="0.0173" diaginertia="1e-6 1.7e-5 1.7e-5"/>
<joint name="bend{i}" axis="0 0 1" stiffness="3.2" damping="0.001"/>
<geom type="box" size="0.055 0.001 0.025" pos="0.055 0 0" contype="0" conaffinity="0"/>"""
BEAM = "".join(PIECE.format(i=i, at=0.11 if i else 0.025) for i in range(5)) + "</body>" * 5
FOREIGN = FOREIGN.replace("BEAM", BEAM)
NAMES = ["--joint1", "shoulder", "--joint2", "elbow", "--hub", "link2", "--tip", "v4"]
NAMES += ["--motor1", "act1", "--motor2", "act2"]


def test_a_file_that_lacks_six_things_is_told_all_six(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "foreign.xml"
    path.write_text(FOREIGN)
    assert main(["modes", str(path)]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "6 things to mend" in said
    for i, name in enumerate(("joint1", "joint2", "hub", "tip", "motor1", "motor2"), start=1):
        assert f"({i}) lacks the " in said and f"say --{name} NAME" in said
    assert "it has 'shoulder', 'elbow'" in said and "it has 'act1', 'act2'" in said


def test_what_only_the_plant_takes_is_said_with_the_rest() -> None:
    text = FOREIGN.replace(
        '<joint name="elbow"', '<joint range="-3 3" frictionloss="0.1" name="elbow"'
    )
    words = r"6 things .*joint 'elbow' has dry friction .*; joint 'elbow' has a limited range"
    with pytest.raises(ModelError, match=words):
        load_arm(text=text)


@pytest.mark.parametrize("name", ["composite", "cable"])
def test_what_mujoco_has_dropped_names_what_would_do(name: str) -> None:
    text = {
        "composite": chain("<worldbody>", '<worldbody><composite type="cable" count="5 1 1"/>'),
        "cable": chain(
            "<worldbody>",
            '<extension><plugin plugin="mujoco.elasticity.cable"/></extension><worldbody>',
        ),
    }[name]
    with pytest.raises(ModelError, match=r"MuJoCo 4 has dropped it.*flexsim chain"):
        load_arm(text=text)


# ---- other people's names


def test_names_are_mapped_kept_and_needed_no_more(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, run, out = tmp_path / "foreign.xml", tmp_path / "run", tmp_path / "m.csv"
    path.write_text(FOREIGN)
    (tmp_path / "tau.csv").write_text("t,tau1,tau2\n0,0.1,0\n0.001,0.1,0\n")
    drive = ["drive", "--torque", str(tmp_path / "tau.csv"), "--out", str(out)]
    assert main([*drive, "--mjcf", str(path), *NAMES]) == 0
    small = ["--population", "4", "--survivors", "2", "--generations", "1", "--plant", "chain"]
    assert main(["tune", "--mjcf", str(path), *NAMES, *small, "--out", str(run)]) == 0
    kept = (run / "robot.xml").read_text()
    assert '"tip": "v4"' in (run / "config.json").read_text()
    arm = load_arm(text=kept)
    assert arm.reach == pytest.approx(0.025 + 5 * 0.11)
    assert arm.model.sensor_objid.tolist() == [1, 1]  # what referred to the names still does
    assert main(["tune", "--resume", str(run)]) == 0
    assert main(["modes", str(run / "robot.xml")]) == 0
    assert main(["modes", str(path), *NAMES, "--json"]) == 0
    assert main(["watch", str(path), *NAMES, "--once", "--no-viewer"]) == 0
    capsys.readouterr()


def test_a_place_on_a_body_may_be_given() -> None:
    given = Names("shoulder", "elbow", "link2", "v4 0.03 0 0", "act1", "act2")
    assert load_arm(text=FOREIGN, names=given).reach == pytest.approx(0.025 + 4 * 0.11 + 0.03)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--joint1", "knee"], "it has no such joint (it has 'shoulder', 'elbow', 'bend0'"),
        (["--hub", "knee"], "nor is it one of its bodies: 'link1', 'link2'"),
        (["--joint1", "shoulder", "--joint2", "shoulder"], "--joint2"),
    ],
)
def test_names_that_are_not_there_are_one_line(
    options: list[str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "foreign.xml"
    path.write_text(FOREIGN)
    assert main(["modes", str(path), *options]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and words in said


def test_names_without_a_file_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["crosscheck", "--tip", "v4"]) == 2
    assert "--tip v4 has no effect without --mjcf" in capsys.readouterr().err
