"""What a study file means: its parts are those of the library, to the bit; its draws are paired."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import signal, stats

from controllers import (
    REALISATIONS,
    TUNED,
    Controller,
    Gains,
    integer_pid,
    oustaloup_pid,
    textbook_pid,
)
from flexsim import (
    HARDWARE,
    SETTINGS,
    TRAJECTORIES,
    FlexsimError,
    ParameterError,
    Parameters,
    Robot,
    model_path,
)
from flexsim.loop.control.stacking import stack
from flexsim.loop.friction import Friction
from flexsim.loop.waypoints import Waypoints
from studies.core.evidence.repeats import PERTURBATION, perturbed
from studies.run.batches import Perturbations
from studies.spec.building import Workshop
from studies.spec.corners import require_buildable
from studies.spec.designs import design_of
from studies.spec.draws import Draws
from studies.spec.matrix import Run
from studies.spec.parts import ControllerPart, NumbersPart, SweepPart
from studies.spec.reading import given
from studies.spec.resolving import resolve

BASE = """
repeats = 3
plants = ["assumed-modes", "closed-chain"]
controllers = ["line", "circle"]
trajectories = ["line", "circle"]
hardware = ["bench"]
"""
ONE, NONE = np.ones((1, 6)), ()
PERIOD = 1e-3


def workshop(text: str = BASE, *changes: str, folder: Path = Path()) -> Workshop:
    return Workshop(resolve(given(tomllib.loads(text), "study.toml", folder, changes)))


def design(**part: object):  # type: ignore[no-untyped-def]
    return design_of(ControllerPart.model_validate(part), PERIOD, Parameters(), {})


def alike(found, expected) -> None:  # type: ignore[no-untyped-def]
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_array_equal(one, other)


def test_worn_joints_and_their_friction_are_given_in_a_file() -> None:
    text = BASE.replace('["bench"]', '[{ use = "worn", cold = [0.3, 0.1], encoder = "motor" }]')
    lugre = '[{ law = "lugre", stiction = [2.0, 1.2], sigma_0 = [900.0, 90.0] }]'
    shop = workshop(f"{text}settings = {lugre}\n")
    stage = shop.stage(shop.matrix.run(0), NONE)
    worn = replace(HARDWARE["worn"].effects, cold=(0.3, 0.1), encoder="motor")
    assert stage.hardware == replace(HARDWARE["worn"], effects=worn, seed=1)
    own = Friction("lugre", stiction=(2.0, 1.2), sigma_0=(900.0, 90.0))
    assert stage.friction == own.numbers()


def test_parts_are_those_of_the_library() -> None:
    shop = workshop()
    run = shop.matrix.run(0)
    stage = shop.stage(run, NONE)
    assert stage.plant.parameters == Robot().parameters
    assert stage.hardware == replace(HARDWARE["bench"], seed=1)
    assert stage.friction == SETTINGS["simulink"].friction.numbers()
    assert shop.path(1, NONE)[1] == TRAJECTORIES["circle"]
    assert stage.loop.v_gain == -1.0
    alike(shop.design(1, NONE)[1].stacked(ONE), stack([TUNED["circle"].filters(PERIOD)], PERIOD))


@pytest.mark.parametrize("realisation", REALISATIONS)
def test_repeats_are_perturbed_as_elsewhere(realisation: str) -> None:
    """To the bit: the series' sums are taken in the order of `fractional_pid`."""
    own = Controller("x", Gains(2.0, 0.4, 3.0, -0.3, 5.0), Gains(4.0, 0.6, 0.0, None, 1.0), "")
    joints = {
        f"joint{i}": {k: v for k, v in vars(g).items() if v is not None}
        for i, g in ((1, own.joint1), (2, own.joint2))
    }
    made = design(**joints, realisation=realisation, terms=5)
    factors = 1 + PERTURBATION * Perturbations(7).of(np.array([1, 2, 3]))
    others = perturbed(own, 3, np.random.default_rng(7))
    expected = stack([each.filters(PERIOD, realisation, 5) for each in others], PERIOD)
    alike(made.stacked(factors), expected)


def test_perturbations_do_not_depend_on_where_one_begins() -> None:
    every = Perturbations(3).of(np.arange(40_000))
    other = Perturbations(3)
    for some in ([39_999], [0, 1], [20_000, 20_001], [16_385], [16_384]):
        np.testing.assert_array_equal(other.of(np.array(some)), every[some])
    assert not every[0].any() and every[1:].all()


def test_every_kind_of_controller_is_the_loops_own() -> None:
    sos = signal.butter(4, 0.2, output="sos")
    A, B, C, D = np.diag([0.5, 0.2]), np.ones((2, 3)), np.ones((2, 2)), np.zeros((2, 3))
    cases = [
        (
            {"joint1": {"kp": 3.0, "ki": 2.0, "kd": 0.1, "filter_time": 0.01},
             "joint2": {"kp": 1.0}},
            [(textbook_pid(3.0, 2.0, 0.1, PERIOD, 0.01), textbook_pid(1.0, 0.0, 0.0, PERIOD))],
        ),
        (
            {"joint1": {"kp": 3.0, "ki": 2.0, "kd": 0.1}, "joint2": {"kp": 1.0, "kd": 1.0},
             "realisation": "tustin"},
            [(integer_pid(0.1, 2.0, 3.0, PERIOD), integer_pid(1.0, 0.0, 1.0, PERIOD))],
        ),
        (
            {"joint1": {"b": [1.0, 0.5], "a": [1.0, -0.2]}, "joint2": {"sos": sos.tolist()}},
            [(([1.0, 0.5], [1.0, -0.2]), sos)],
        ),
        (
            {"joint1": {"zeros": [0.2], "poles": [[0.5, 0.1], [0.5, -0.1]], "gain": 2.0},
             "joint2": {"b": [1.0]}},
            [(([0.2], [0.5 + 0.1j, 0.5 - 0.1j], 2.0), ([1.0], [1.0]))],
        ),
        (
            {"A": A.tolist(), "B": B.tolist(), "C": C.tolist(), "D": D.tolist()},
            [(A, B, C, D)],
        ),
        (
            {"joint1": {"k1": 2.0, "nu1": 0.5}, "joint2": {"k3": 1.0},
             "realisation": "oustaloup-sections", "terms": 4},
            [(oustaloup_pid(Gains(2.0, 0.5, 0.0, None, 0.0), PERIOD, 4),
              oustaloup_pid(Gains(0.0, None, 0.0, None, 1.0), PERIOD, 4))],
        ),
    ]  # fmt: skip
    for part, expected in cases:
        made = design(**part)
        alike(made.stacked(ONE), stack(expected, PERIOD))
        louder = made.stacked(2 * ONE)  # twice the gains are twice the torque
        quiet = made.stacked(ONE)
        np.testing.assert_allclose(louder.D, 2 * quiet.D)
        assert not np.array_equal(louder.b, quiet.b) or quiet.A.size


def test_a_function_designs(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(
        "import numpy as np\n"
        "def design(period, parameters, kp, where=1.0):\n"
        "    assert period == 1e-3 and parameters.EI == 0.349\n"
        "    if kp < 0:\n"
        "        raise ValueError('kp below 0')\n"
        "    return (np.array([kp]), np.ones(1)), (np.array([where]), np.ones(1))\n"
    )
    text = (
        BASE.replace(
            '["line", "circle"]\ntraj',
            '[{name = "f", function = "own.py:design", options = {kp = 3.0}}]\ntraj',
        )
        + '[sweep]\n"controllers[f].options.kp" = [4.0, -1.0]\n'
    )
    shop = workshop(text, folder=tmp_path)
    found = shop.design(0, shop.matrix.draws.values(0))[1].stacked(ONE)
    assert found.b[0, 0, 0, 0, 0] == 4.0
    with pytest.raises(ParameterError, match=r"controllers\[0\]: .*failed at line 5: .*kp below 0"):
        shop.design(0, shop.matrix.draws.values(1))
    with pytest.raises(ParameterError, match="failed at line 5"):
        require_buildable(shop)  # before anything runs


def test_a_robots_file_is_kept_and_bears_a_payload() -> None:
    text = BASE + f'[robot]\nmjcf = "{model_path("chain6.xml")}"\npayload = 0.02\n'
    shop = workshop(text)
    assert list(shop.resolved.inputs) == ["inputs/chain6.xml"]
    plant = shop.stage(shop.matrix.run(0), NONE).plant
    expected = Robot.of(model_path("chain6.xml")).changed(1.0, 1.0, 0.02)
    assert plant.parameters == expected.parameters


def test_waypoints_are_the_librarys() -> None:
    text = BASE.replace(
        '["line", "circle"]\nhard', "[{points = [[0.7, 0.2], [0.3, 0.6]], lead = 0.5}]\nhard"
    )
    found = workshop(text).path(0, NONE)[1]
    assert found == Waypoints(((0.7, 0.2), (0.3, 0.6)), lead=0.5)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("plants[0].step=0.01", r"study.toml: plants\[0\]: physics step 0.01 s is too long"),
        ("plants[0].step=3e-4", r"plants\[0\]: .*whole"),
        ("plants[0].integrator=Euler", "integrator is of chains, not of assumed-modes"),
        ("trajectories[0].end=[9.0, 9.0]", r"trajectories\[0\]: trajectory 'line'"),
        ("settings[0].tau_0=[-1.0, 0.0]", r"settings\[0\]: friction tau_0"),
        ("hardware[0].delay=-1", r"hardware\[0\]: hardware delay is -1"),
        ("controllers=[{joint1={k1=1.0}, joint2={k3=1.0}}]", "has no order; give its nu"),
        (
            "controllers=[{joint1={k1=1.0, nu1=0.5}, joint2={k3=1.0}, realisation='tustn'}]",
            "realisation 'tustn' is unknown",
        ),
        (
            "controllers=[{joint1={kp=nan}, joint2={kp=1.0}}]",
            r"controllers\[0\].joint1: kp must be",
        ),
        ("controllers=[{joint1={sos=[]}, joint2={kp=1.0}}]", r"controllers\[0\].joint1: sos has"),
        ("controllers=[{A=[[0.5, 1.0], [1.0]], B=[[1.0]], C=[[1.0]], D=[[1.0]]}]", "A has rows of"),
        ("trajectories[0].hold=1e12", r"trajectories\[0\]: .* more than 10,000,000 samples"),
        ("controllers=[{A=[[0.5]], B=[[1.0]], C=[[1.0]], D=[[1.0]]}]", "1 inputs and 1 outputs"),
    ],
)
def test_what_cannot_be_built_is_said_before_anything_runs(change: str, said: str) -> None:
    with pytest.raises(FlexsimError, match=said):
        require_buildable(workshop(BASE, change))


# --- draws and numbers of runs ------------------------------------------------------------------


def draws(
    samples: int = 64, sampler: str = "sobol", seed: int = 1, **numbers: NumbersPart
) -> Draws:
    sweep = SweepPart(sampler=sampler, samples=samples, numbers=numbers)  # type: ignore[arg-type]
    return Draws.of(sweep, seed)


def part(**given: object) -> NumbersPart:
    return NumbersPart.model_validate(given)


@pytest.mark.parametrize("sampler", ["sobol", "latin-hypercube"])
def test_samples_have_their_distribution(sampler: str) -> None:
    found = draws(1024, sampler, a=part(uniform=[2.0, 3.0]), b=part(normal=[5.0, 0.5]),
                  c=part(**{"log-uniform": [0.01, 100.0]}))  # fmt: skip
    a, b, c = found.columns(np.arange(1024))
    for sample, law in (
        (a, stats.uniform(2.0, 1.0)),
        (b, stats.norm(5.0, 0.5)),
        (np.log10(c), stats.uniform(-2.0, 4.0)),
    ):
        distance = stats.kstest(sample, law.cdf).statistic
        assert distance < 3 / 1024  # far more even than chance, 0.03
    assert abs(np.corrcoef(a, b)[0, 1]) < 0.1


def test_a_grid_is_crossed_with_samples_alike_at_each_point() -> None:
    found = draws(8, a=part(uniform=[0.0, 1.0]), g=part(values=[1.0, 2.0]),
                  h=part(linear=[0.0, 0.2, 5]), k=part(log=[1.0, 100.0, 3]))  # fmt: skip
    assert found.paths == ("g", "h", "k", "a") and found.count == 2 * 5 * 3 * 8
    g, h, k, a = found.columns(np.arange(found.count))
    assert list(dict.fromkeys(h)) == [0.0, 0.05, 0.1, 0.15, 0.2]
    assert list(dict.fromkeys(k)) == [1.0, 10.0, 100.0]
    assert len(set(zip(g, h, k, strict=True))) == 30
    np.testing.assert_array_equal(a.reshape(30, 8), np.tile(a[:8], (30, 1)))


def test_another_seed_draws_others_and_the_same_the_same() -> None:
    one, two, other = (draws(16, seed=s, a=part(uniform=[0.0, 1.0])).unit for s in (1, 1, 2))
    np.testing.assert_array_equal(one, two)
    assert not np.array_equal(one, other)


@pytest.mark.parametrize(
    ("given_part", "said"),
    [
        ({}, "says nothing; give one of values"),
        ({"uniform": [1, 2], "normal": [1, 2]}, "has uniform and normal"),
        ({"uniform": [2, 1]}, r"give \[low, high\]"),
        ({"log-uniform": [0, 1]}, "give more than 0"),
        ({"normal": [1, 0]}, r"give \[mean, deviation\]"),
        ({"linear": [0, 1, 2.5]}, "2.5 points; give a whole number"),
        ({"log": [-1, 1, 3]}, "give both above 0"),
        ({"values": []}, "give one or more"),
    ],
)
def test_ranges_that_are_none(given_part: dict[str, object], said: str) -> None:
    with pytest.raises(ParameterError, match=said):
        draws(a=part(**given_part))


@pytest.mark.parametrize(
    ("path", "said"),
    [
        ("robot.name", "no number"),
        ("plants[0].model.x", "has nothing within it"),
        ("repeats", "only numbers in robots, plants"),
        ("perturbation", "perturbation: is 0.5; give 0 or more, less than 0.1; with perturbation"),
        ("controllers[5].terms", "has no item '5'"),
        ("robot.zetta", r"robot: zetta is unknown.*Did you mean zeta\?"),
        ("hardware[0].delay", "hardware.0.: delay is 0.5; give a whole number"),
    ],
)
def test_what_cannot_be_varied(path: str, said: str) -> None:
    with pytest.raises(FlexsimError, match=said):
        require_buildable(workshop(BASE + f'[sweep]\n"{path}" = [0.5, 0.7]\n'))


def test_one_number_is_varied_once() -> None:
    text = BASE + '[sweep]\nrobot.EI = [0.3, 0.4]\n"robots[*].EI" = [0.5, 0.6]\n'
    with pytest.raises(ParameterError, match=r"sweep.robots\[\*\].EI: robots\[0\].EI is varied as"):
        workshop(text)


def test_too_many_draws_are_refused_before_they_are_made() -> None:
    with pytest.raises(ParameterError, match="sweep has 10,000,000,000 draws; give 10,000,000"):
        draws(a=part(linear=[0, 1, 1e5]), b=part(linear=[0, 1, 1e5]))


def test_a_swept_value_that_will_not_do_is_said() -> None:
    text = BASE + "[sweep]\nrobot.EI = [0.3, -0.4]\n"
    with pytest.raises(ParameterError, match=r"robot: parameter EI .* is -0.4; .*; with robot.EI"):
        require_buildable(workshop(text))


FUNCTIONS = {
    "import sys\ndef design(period, parameters):\n    sys.exit()\n": "failed at line 3: SystemExit",
    "raise SystemExit\n": "failed at line 1: SystemExit",
    "def design(period):\n    return 1\n": "unexpected keyword argument 'parameters'",
    "def design(period, parameters):\n    return None\n": "cannot be used",
    "import random\ndef design(period, parameters):\n    x = random.random()\n"
    "    return (([x], [1.0]), ([x], [1.0]))\n": "gives another controller each time",
}


@pytest.mark.parametrize("source", FUNCTIONS)
def test_functions_that_will_not_do(source: str, tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(source)
    text = BASE.replace('["line", "circle"]\ntraj', '[{function = "own.py:design"}]\ntraj')
    with pytest.raises(ParameterError, match=rf"controllers\[0\]: .*{FUNCTIONS[source]}"):
        require_buildable(workshop(text, folder=tmp_path))


def test_a_function_changes_nothing_of_the_study(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own.py").write_text(
        "from __future__ import annotations\nimport os\nfrom dataclasses import dataclass\n"
        "@dataclass\nclass Own:\n    x: int = 1\n"
        "def design(period, parameters, g):\n    g.append(1.0)\n    print(Own())\n"
        "    os.chdir('/')\n    return ((g[:1], [1.0]), (g[:1], [1.0]))\n"
    )
    item = '[{function = "own.py:design", options = {g = [200.0]}}]\ntraj'
    shop = workshop(BASE.replace('["line", "circle"]\ntraj', item), folder=tmp_path)
    before = shop.resolved.text()
    require_buildable(shop)
    assert shop.resolved.text() == before and shop.study.controllers[0].options == {"g": [200.0]}
    assert capsys.readouterr().out == "" and Path.cwd() == tmp_path


def test_runs_are_numbered_one_to_one_and_draws_shared() -> None:
    text = BASE + "[sweep]\nsamples = 4\nrobot.EI = {uniform = [0.3, 0.4]}\n"
    matrix = workshop(text).matrix
    assert matrix.runs == 2 * 4 * 4 * 3
    every = [matrix.run(n) for n in range(matrix.runs)]
    assert len(set(every)) == matrix.runs
    arrays = matrix.indices(np.arange(matrix.runs))
    assert [arrays.nth(n) for n in range(matrix.runs)] == every
    cells = matrix.cells(arrays)
    assert np.bincount(cells).tolist() == [4 * 3] * 8
    assert matrix.cell(int(cells[-1]))[0] == 1


def test_draws_are_the_same_on_every_plant_and_a_number_changes_only_what_it_is_in() -> None:
    text = BASE + (
        "[sweep]\nsamples = 4\nrobot.EI = {uniform = [0.3, 0.4]}\n"
        '"settings[0].mu[0]" = {uniform = [0.2, 0.3]}\n"controllers[line].joint1.k3" = [1.0, 2.0]\n'
    )
    shop = workshop(text)
    one, other = (shop.stage(Run(p, 0, 5, 0, 0), shop.matrix.draws.values(5)) for p in (0, 1))
    assert one.plant.parameters == other.plant.parameters
    assert one.friction is other.friction
    values = shop.matrix.draws.values(5)
    assert one.plant.parameters.EI == values[1] and one.friction.mu_1 == values[2]
    assert shop.design(1, values)[1] is shop.design(1, shop.matrix.draws.values(0))[1]
    assert shop.design(0, values)[1] is not shop.design(0, shop.matrix.draws.values(0))[1]


def test_a_period_may_be_varied() -> None:
    shop = workshop(BASE + "[sweep]\nperiod = [0.001, 0.002]\n")
    periods = [
        shop.stage(Run(0, 0, d, 0, 0), shop.matrix.draws.values(d)).loop.period for d in (0, 1)
    ]
    assert periods == [0.001, 0.002]


def test_an_arm_is_named_and_its_numbers_stand_in_the_file() -> None:
    """Those of `Robot.named`, in a study that stands alone; changed and varied as any."""
    text = """
plants = ["assumed-modes", "closed-chain"]
controllers = ["{arm}"]
trajectories = ["{path}"]
settings = ["none"]
[robot]
arm = "{arm}"
"""
    for arm, path in (("one-link", "turn"), ("two-flexible", "line")):
        found = workshop(text.format(arm=arm, path=path))
        assert "arm" not in found.resolved.document["robots"][0]
        again = workshop(found.resolved.text())
        for each in (found, again):
            _, robot = each.robot(0, NONE)
            named = Robot.named(arm)
            assert (robot.parameters, robot.link1) == (named.parameters, named.link1)
    both = text.format(arm="two-flexible", path="line")
    _, softer = workshop(both, "robot.link1.EI=0.5", "robot.EI=2.0").robot(0, NONE)
    assert softer.link1 is not None and (softer.link1.EI, softer.parameters.EI) == (0.5, 2.0)
    stage = workshop(both).stage(Run(1, 0, 0, 0, 0), NONE)
    assert stage.plant.name == "closed-chain" and stage.loop.v_gain == 0.0


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (("robot.arm='three-link'",), "robot.arm"),
        (("robot.arm='one-link'",), "turns joint 1"),
        (("robot.link1={EI=-1.0, rho=0.2}",), "link 1 has EI -1.0"),
        (("trajectories=[{use='turn', centre=[0.5, 0.3]}]",), "centre is not of a turn"),
    ],
)
def test_an_arm_that_cannot_be_is_one_line(changes: tuple[str, ...], said: str) -> None:
    with pytest.raises(FlexsimError, match=said) as caught:
        require_buildable(workshop(BASE, *changes))
    assert "\n" not in str(caught.value) and "study.toml" in str(caught.value)
