"""Study files as people write them: what is read, and one clear line for what is not."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest

from flexsim import FlexsimError, ParameterError, RunError
from studies.spec.places import changed, get, places, put, spelled
from studies.spec.reading import given, read_study
from studies.spec.resolving import Resolved, resolve

BASE = """
plants = ["assumed-modes", {model = "closed-chain:5", step = 5e-4}]
controllers = ["line", {use = "circle", trajectories = ["line"]}, {name = "mine", \
joint1 = {kp = 1.0}, joint2 = {kp = 1.0}}]
trajectories = ["line", {points = [[0.7, 0.2], [0.5, 0.4], [0.3, 0.6]], duration = 3}]
"""


def resolved(text: str = BASE, *changes: str, folder: Path = Path(), code: bool = True) -> Resolved:
    return resolve(given(tomllib.loads(text), "study.toml", folder, changes), code)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("robot.zetta=0.002", "robot.zetta is unknown; choose of name,"),
        ("robot.zetta=0.002", "Did you mean zeta?"),
        ("robot.zeta=small", "robot.zeta is 'small'; give a number"),
        ("robot.zeta=true", "robot.zeta is True; give a number"),
        ("robot.EI=-1", "robot: parameter EI (bending stiffness of the flexible link) is -1.0"),
        ("robot.zeta=nan", "robot: parameter zeta"),
        ("repeatz=1", "Did you mean repeats?"),
        ("repeats=0", "repeats is 0; give 1 or more"),
        ("repeats=2.5", "repeats is 2.5; give a whole number"),
        ("batch=10", "batch is 10; give 50 or more"),
        ("seed=-1", "seed is -1; give 0 or more"),
        ("period=0", "period is 0; give more than 0"),
        ("traces=some", "traces is 'some'; choose of none, nominal, all"),
        ("title=3", "title is 3; give text in quotes"),
        ("plants=[]", "plants is empty, so there is nothing to run; give one or more"),
        ("plants=3", "plants is 3; give a list"),
        ("plants=[3]", "plants[0] is 3; give a table"),
        ('plants=["chian"]', "plants[0]: plant 'chian' is unknown"),
        ('plants=["chian"]', "Did you mean chain?"),
        ('plants=["chain", "chain"]', "plants[1].name is 'chain', as of plants[0]"),
        ("plants[0].step=fine", "plants[0].step is 'fine'; give a number"),
        ("plants[0].integrator=rk4", "choose of RK4, Euler, implicitfast, discrete"),
        ("controllers[2].joint1.k1=3", "controllers[2].joint1.k1 is unknown; choose of kp, ki, kd"),
        ("controllers[2].joint1.kpp=3", "Did you mean kp?"),
        ("controllers[mine].joint1.kp=x", "controllers[2].joint1.kp is 'x'; give a number"),
        ("controllers[2].use=line", "use and joint1, joint2 contradict each other"),
        ("controllers[0].terms=5", "controllers[0]: terms has no effect beside use"),
        ("controllers[7].use=a", "controllers has no item '7'; it has 0 to 2, named line, circle"),
        ("controllers[0].run=nowhere", "use and run contradict each other"),
        ('controllers=[{run="nowhere"}]', "controllers[0].run: nowhere is not a run"),
        ('controllers=["lin"]', "controllers[0].use: controller 'lin' is unknown"),
        ('controllers=["lin"]', "Did you mean line?"),
        ("controllers=[{}]", "controllers[0]: says nothing; give one of use; run; function"),
        ("controllers=[{joint1={kp=1.0}}]", "controllers[0]: joint2 is missing; give it"),
        ("controllers=[{A=[[1.0]]}]", "controllers[0]: B, C, D is missing; give it"),
        ('controllers[0].trajectories=["lime"]', "controllers[0].trajectories has 'lime'"),
        ('controllers[0].trajectories=["lime"]', "Did you mean line?"),
        ('trajectories=["lime"]', "trajectories[0]: use is 'lime'; choose of line,"),
        ("trajectories[1].shape=line", "shape and points contradict each other"),
        ("trajectories[1].start=[0.1,0.2]", "start is of a shape, not of waypoints"),
        ("trajectories[0].times=[0.0,1.0]", "times is of waypoints, not of a line"),
        ("trajectories[0].start=[0.1]", "trajectories[0].start[1] is missing"),
        ("trajectories[1].time_law=linear", "choose of quintic, constant-speed, spline"),
        ('hardware=["idea"]', "hardware[0]: use is 'idea'"),
        ("hardware[0].delay=1.5", "hardware[0].delay is 1.5; give a whole number"),
        ("settings[0].dead_zone=[1,2]", "settings[0].dead_zone[0] is 1; give a list"),
        ('settings=["simulnk"]', "Did you mean simulink?"),
        ("robot.mjcf=nofile.xml", "robot.mjcf: nofile.xml: cannot read"),
        ("weights=[1,2]", "weights[2] is missing"),
        ("weights=[nan,1,1]", "weights[0] is nan; give a finite number"),
        ("sweep.robot.EI.linear=[0,inf,3]", "sweep.robot.EI.linear[1] is inf; give a finite"),
        ("sweep.samples=x", "sweep.samples is 'x'; give a whole number"),
        ("sweep.robot.EI.uniforn=[1,2]", "sweep.robot.EI.uniforn is unknown"),
        ("sweep.robot.EI.uniforn=[1,2]", "Did you mean uniform?"),
        ("robots=3", "robots is 3; give a list"),
        ("robots[²].zeta=1", "has no item '²'"),
        ("settings[0].tau_0[0]=4", "settings[0].tau_0 is not in the file; give all of it"),
        ("controllers[0].v_gain=nan", "controllers[0].v_gain is nan; give a finite number"),
        ("seed=4294967296", "seed is 4294967296; give 4,294,967,295 at most"),
        ("controllers[2].joint1=[1.0]", "controllers[2].joint1 is [1.0]; give a table"),
        ("controllers[2].terms=1000000000", "give 5,000 at most"),
        ("x", "--set x: give path=value"),
        ("a b=3", "--set 'a b' is no path"),
    ],
)
def test_one_line_with_its_path(change: str, said: str) -> None:
    with pytest.raises(FlexsimError) as caught:
        resolved(BASE, change)
    message = str(caught.value)
    assert message.startswith("study.toml: ") and said in message
    assert "\n" not in message


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("plants = [", "not TOML"),
        ("plants = ['chain']\nplants = ['rod']", "not TOML"),
        ("controllers = ['line']\ntrajectories = ['line']", "plants is missing; give it"),
        ("[robot]\nzeta = 0.1\n[[robots]]\nzeta = 0.2", "robot and robots are both given"),
        ("\x00", "not TOML"),
        ("a = " + "[" * 5000 + "]" * 5000, "not TOML"),
        ("seed = " + "1" * 5001, "not TOML"),
    ],
)
def test_what_is_no_study(text: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "study.toml"
    path.write_text(text)
    with pytest.raises(ParameterError, match=said):
        resolve(read_study(path))


def test_what_is_no_file(tmp_path: Path) -> None:
    for path in (tmp_path, tmp_path / "none.toml", Path("/dev/zero")):
        with pytest.raises(RunError, match="cannot read the study file"):
            read_study(path)


def test_names_stand_for_tables_and_defaults_for_what_is_not_given() -> None:
    found = resolved()
    assert [each["name"] for each in found.document["plants"]] == [
        "assumed-modes",
        "closed-chain:5",
    ]
    assert found.study.repeats == 20 and found.study.hardware[0].name == "ideal"
    assert found.document["settings"][0]["law"] == "simulink"


def test_sets_values_as_toml_or_bare_text() -> None:
    changes = ("robot.zeta=0.002", "title=my study", 'hardware=["bench"]', "repeats=3")
    found = resolved(BASE, *changes).study
    assert (found.robots[0].zeta, found.title, found.repeats) == (0.002, "my study", 3)
    assert found.hardware[0].counts == 8192


def test_sets_items_by_what_they_use_and_what_is_varied() -> None:
    changes = (
        *("controllers[circle].v_gain=0", "trajectories[line].duration=2", "plants[0].step=5e-4"),
        *("sweep.settings[0].mu[0]=[0.2, 0.3]", "sweep.robot.EI.uniform=[0.3, 0.4]"),
    )
    study = resolved(BASE, *changes).study
    assert study.controllers[1].v_gain == 0 and study.trajectories[0].duration == 2.0
    assert study.sweep.numbers["settings[0].mu[0]"].values == [0.2, 0.3]
    assert study.sweep.numbers["robot.EI"].uniform == (0.3, 0.4)


def test_a_resolved_study_resolves_to_itself(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text("def design(period, parameters, kp):\n    return kp\n")
    extra = BASE.replace(
        '["line", {use', '["line", {function = "own.py:design", options = {kp = 3}}, {use'
    ) + (
        "[robot]\nzeta = 0.002\n[sweep]\nrobot.EI = {uniform = [0.3, 0.4]}\n"
        '"controllers[mine].joint1.kp" = [1, 2]\n'
    )
    first = resolved(extra, folder=tmp_path)
    for name, text in first.inputs.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    (tmp_path / "again.toml").write_text(first.text())
    again = resolve(read_study(tmp_path / "again.toml"))
    assert again.text() == first.text() and again.digest == first.digest
    assert again.study == first.study


def test_quick_cuts_repeats_samples_and_grids() -> None:
    text = (
        BASE + "[sweep]\nrobot.EI = {uniform = [0.3, 0.4]}\nrobot.payload = {linear = [0, 1, 9]}\n"
    )
    document = tomllib.loads(text + "robot.zeta = [0.001, 0.002, 0.003]\n")
    study = given(document, "s", Path(), quick=True).study
    assert (study.repeats, study.sweep.samples) == (2, 8)
    assert study.sweep.numbers["robot.payload"].linear == (0, 1, 2)
    assert study.sweep.numbers["robot.zeta"].values == [0.001, 0.003]


def test_nothing_is_executed_but_the_named_function_and_not_with_no_code(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text("raise SystemExit\n")
    text = BASE.replace('["line", {use', '[{function = "own.py:design"}, "line", {use')
    found = resolved(text, folder=tmp_path)  # named, not run
    assert list(found.inputs) == ["inputs/own.py"]
    with pytest.raises(ParameterError, match="is code, which --no-code refuses"):
        resolved(text, folder=tmp_path, code=False)
    with pytest.raises(ParameterError, match=r"neither .*nope\.py nor a module nope"):
        resolved(text.replace("own.py", "nope"), folder=tmp_path)


def test_a_run_of_tune_becomes_its_gains(tuned: Path) -> None:
    text = BASE.replace('["line", {use', f'[{{run = "{tuned}"}}, {{use')
    (first, *_) = resolved(text).study.controllers
    assert first.joint1 is not None and first.realisation == "tustin" and first.name == tuned.name


def test_a_run_of_tune_for_another_period_is_refused(tuned_otherwise: Path) -> None:
    text = BASE.replace('["line", {use', f'[{{run = "{tuned_otherwise}"}}, {{use')
    with pytest.raises(ParameterError, match=r"controllers\[0\]: .*period of 0.002 s"):
        resolved(text)
    (first, *_) = resolved(text, "period=0.002").study.controllers
    assert (first.v_gain, first.realisation) == (0.0, "oustaloup")


def test_waypoints_from_a_file(tmp_path: Path) -> None:
    (tmp_path / "way.csv").write_text("t,x,y\n5,0.7,0.2\n6,0.5,0.4\n8,0.3,0.6\n")
    text = BASE.replace('["line", {points', '[{file = "way.csv", name = "way"}, "line", {points')
    (first, *_) = resolved(text, folder=tmp_path).study.trajectories
    assert first.times == [0.0, 1.0, 3.0] and first.duration == 3.0
    assert first.points == [(0.7, 0.2), (0.5, 0.4), (0.3, 0.6)]


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("a,b\n1,2\n", "the first line is 'a,b'; give x,y or t,x,y"),
        ("x,y\n1,2,3\n", "line 2: '1,2,3' is not 2 finite numbers"),
        ("x,y\n1,nan\n", "is not 2 finite numbers"),
    ],
)
def test_waypoints_that_are_none(content: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "way.csv").write_text(content)
    text = BASE.replace('["line", {points', '[{file = "way.csv", name = "way"}, "line", {points')
    with pytest.raises(FlexsimError, match=said):
        resolved(text, folder=tmp_path)


# --- places -------------------------------------------------------------------------------------


def test_places_by_number_by_name_and_all() -> None:
    document: dict[str, Any] = {
        "robots": [{"EI": 1.0}],
        "controllers": [{"name": "a", "joint1": {"kp": 1.0}}, {"name": "b.c", "joint1": {}}],
    }
    assert places(document, "robot.EI") == [("robots", 0, "EI")]
    assert places(document, "controllers[b.c].joint1.kp") == [("controllers", 1, "joint1", "kp")]
    every = places(document, "controllers[*].joint1.kp")
    assert [spelled(each) for each in every] == [
        "controllers[0].joint1.kp",
        "controllers[1].joint1.kp",
    ]
    put(document, "controllers[*].joint1.kp", 7.0)
    assert [get(document, each) for each in every] == [7.0, 7.0]


def test_a_changed_copy_shares_what_is_not_on_the_way() -> None:
    node = {"a": [{"b": 1}, {"b": 2}], "c": {"d": 3}}
    other = changed(node, ("a", 1, "b"), 9)
    assert other["a"][1]["b"] == 9 and node["a"][1]["b"] == 2  # type: ignore[index]
    assert other["c"] is node["c"] and other["a"][0] is node["a"][0]
