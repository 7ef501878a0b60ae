"""The cross-check: it holds for the shipped chains, and each check fails for its own reason."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from edits import DEFAULT, EDITS

from flexsim import (
    AssumedModesPlant,
    ChainPlant,
    DivergenceError,
    ParameterError,
    Parameters,
    load_chain,
)
from flexsim.arm.chain_design import design_chain
from flexsim.loop.runs import drive
from flexsim.loop.settings import setting
from flexsim.mjcf.chain_xml import chain_mjcf
from flexsim.mjcf.edits import changed, without_damping
from flexsim.robot import Robot
from flexsim.robot.exudyn_arm import exudyn_plant
from studies.main import main
from studies.parity.beam_checks import (
    DEFAULT_BEAM,
    EDITED_LIMITS,
    Check,
    beam_checks,
    limits_beside,
    model_checks,
)
from studies.parity.crosscheck import CrosscheckConfig, CrosscheckResult, run
from studies.parity.exudyn_checks import still_checks
from studies.parity.motion_checks import (
    CHAIN_ENERGY_LIMIT,
    STATES,
    acceleration_difference,
    energy_drift,
)
from studies.parity.motions import BENT, BRISK, GENTLE, POSE, fitting_torque, trial_torque
from studies.parity.side_by_side import stands_for

ROOT = Path(__file__).parents[2]
CHAIN6 = ROOT / "models" / "chain6.xml"
README = (ROOT / "studies" / "parity" / "README.md").read_text()
TABLE = README.split("Cross-check:")[1].partition("```")[0]  # of the default command

PRINTED = 1e5  # times the drift of the consistent equations: what the printed ones exceed
SMALL, LARGE = 8e-6, 0.11e-3  # [m] rms over 2 s, as the README says
STATED = 0.02  # relative: three digits of the README's table; libraries move the last
ROUNDED = 0.5  # relative, of checks that are sums of rounding errors


@pytest.fixture(scope="module")
def checks() -> dict[str, Check]:
    """Return the default chain's checks by name."""
    return {check.name: check for check in run(CrosscheckConfig()).checks}


def named(checks: dict[str, Check], words: str) -> Check:
    (found,) = (check for name, check in checks.items() if words in name)
    return found


def edited(pattern: str, replacement: str, count: int = 0) -> str:
    text, found = re.subn(pattern, replacement, CHAIN6.read_text(), count=count)
    assert found
    return text


def failures(folder: Path, text: str, beam: Any = "analytic") -> list[str]:
    """Return the checks that fail: the paper's beam in the equations, an edited one in MuJoCo."""
    path = folder / "edited.xml"
    path.write_text(text)
    result = run(CrosscheckConfig(mjcf=path, beam=beam))
    assert result.source == str(path)
    found = [check.name for check in result.checks if not check.ok]
    assert result.ok is (not found)
    return found


def test_default_chain_holds(checks: dict[str, Check]) -> None:
    held = [check for check in checks.values() if check.limit is not None]
    assert len(held) == 10
    assert all(check.ok and check.limit and 0 <= check.value <= check.limit for check in held)
    assert CrosscheckResult("", tuple(held)).ok
    assert not CrosscheckResult("", (*held, Check("", 2.0, 1.0, False))).ok


def test_printed_equations_drift(checks: dict[str, Check]) -> None:
    """Misprints do work: gentle and brisk, the consistent equations drift far less."""
    for motion in ("gentle", "brisk"):
        printed = named(checks, f"printed equations, {motion}")
        consistent = named(checks, f"assumed modes, {motion}")
        assert printed.limit is None
        assert printed.value > PRINTED * consistent.value


def test_readme_states_these_figures(checks: dict[str, Check]) -> None:
    assert named(checks, "small torques").value < SMALL
    assert "within 8 micrometres" in README
    assert named(checks, "large torques").value < LARGE
    assert "within 0.11 mm" in README
    printed = re.findall(r"^ .*?(\d\.\d\de[-+]\d\d)", TABLE, re.MULTILINE)
    assert len(printed) == len(checks)
    for check, figure in zip(checks.values(), printed, strict=True):
        tolerance = ROUNDED if check.value < 1e-9 else STATED
        assert float(figure) == pytest.approx(check.value, rel=tolerance), check.name


def test_shipped_file_climbs_with_its_own_modes_and_with_the_papers() -> None:
    for beam in ("file", "analytic"):
        result = run(CrosscheckConfig(mjcf=CHAIN6, beam=beam))  # type: ignore[arg-type]
        assert result.ok, [check for check in result.checks if not check.ok]


@pytest.mark.parametrize("edit", EDITS)
def test_both_plants_follow_an_edited_file(edit: str, tmp_path: Path) -> None:
    assert failures(tmp_path, EDITS[edit], "file") == []


@pytest.mark.parametrize("factor", [0.25, 4.0])
def test_softer_and_stiffer_beams_hold(factor: float, tmp_path: Path) -> None:
    def scaled(match: re.Match[str]) -> str:
        return f'stiffness="{factor * float(match[1])!r}"'

    step = 'timestep="0.0005"' if factor > 1 else 'timestep="0.001"'
    text = re.sub(r'stiffness="([^"]*)"', scaled, DEFAULT).replace('timestep="0.001"', step)
    assert failures(tmp_path, text, "file") == []


def test_a_transmission_holds(tmp_path: Path) -> None:
    twice = edited('joint="joint1" gear="1"', 'joint="joint1" gear="2"')
    assert failures(tmp_path, twice, "file") == []


@pytest.mark.parametrize("edit", ["payload", "soft hinge"])
def test_the_papers_beam_does_not_follow(edit: str, tmp_path: Path) -> None:
    """Negative control: the same limits find that the equations are of another beam."""
    # a body of another name is a part of the beam, which the payload of a robot is not
    failed = failures(tmp_path, EDITS[edit].replace('<body name="payload"', '<body name="load"'))
    for words in ("joint-free", "couplings", "acceleration", "small torques"):
        assert any(words in name for name in failed), words


def test_rigid_bodies_follow_under_the_papers_beam_too(tmp_path: Path) -> None:
    twice = 'diaginertia="0.001322 0.001322 0.002644"'
    assert failures(tmp_path, edited('diaginertia="0.001322 0.001322 0.001322"', twice)) == []


@pytest.mark.parametrize("text", [DEFAULT, EDITS["payload"], EDITS["soft hinge"]])
@pytest.mark.parametrize("change", [{"stiffness": 1.01}, {"density": 1.01}])
def test_a_model_that_is_one_percent_wrong_fails(text: str, change: dict[str, float]) -> None:
    """Negative control: a chain of 1 % more stiffness or mass than the file's, everything else."""
    robot = Robot.of(text=text)
    stands, right = stands_for(robot), robot.chain_plant()
    factors = {"stiffness": 1.0, "density": 1.0, "payload": 0.0} | change
    wrong = replace(right, chain=changed(right.chain, **factors))
    modes = robot.modes_plant()

    def failed(chain: ChainPlant) -> list[str]:
        beside = limits_beside(stands, 6, default=False)
        found = [*beam_checks(stands, chain, beside)]
        found += model_checks(stands, modes, chain, EDITED_LIMITS)
        return [check.name for check in found if not check.ok]

    assert failed(right) == []
    assert any("clamped" in name for name in failed(wrong))
    assert any("joint-free" in name for name in failed(wrong))


def test_a_default_chain_that_is_one_percent_wrong_fails() -> None:
    right = Robot().chain_plant()
    wrong = replace(right, chain=changed(right.chain, stiffness=1.01))
    found = beam_checks(stands_for(Robot()), wrong, DEFAULT_BEAM)
    assert not any(check.ok for check in found[:3])  # couplings do not depend on it


def test_damping_comes_along_under_the_papers_beam(tmp_path: Path) -> None:
    assert failures(tmp_path, EDITS["damped"]) == []


def test_damping_would_be_missed(tmp_path: Path) -> None:
    """Negative control: hinges that are damped otherwise than the beam fail, in motion only."""
    text = re.sub(r'(name="hinge1".*) damping="[^"]*"', r'\1 damping="0.05"', DEFAULT)
    text = text.replace('timestep="0.001"', 'timestep="0.0005"')
    failed = failures(tmp_path, text)
    assert any("torques" in name for name in failed)
    assert not any("frequencies" in name or "energy" in name for name in failed)


def test_an_integrator_of_low_order_loses_energy() -> None:
    short = edited('timestep="0.001"', 'timestep="0.0005"')
    euler = load_chain(text=short.replace('integrator="RK4"', 'integrator="Euler"'))
    free = Parameters(F_1=0.0, F_2=0.0)
    drift = energy_drift(ChainPlant(free, without_damping(euler)), BRISK)
    assert drift > 10 * CHAIN_ENERGY_LIMIT


def test_friction_would_be_seen_as_drift() -> None:
    """Negative control: with the joints' own friction the energy check would not hold."""
    lossy = ChainPlant(Parameters(), load_chain(CHAIN6))
    assert energy_drift(lossy, GENTLE) > 10 * CHAIN_ENERGY_LIMIT


def test_without_damping_leaves_the_chain_alone() -> None:
    chain = load_chain(CHAIN6)
    before = chain.model.dof_damping.copy()
    assert before[:2].tolist() == [2e-4, 2.3e-4]
    copy = without_damping(chain)
    assert not copy.model.dof_damping.any()
    np.testing.assert_array_equal(chain.model.dof_damping, before)
    np.testing.assert_array_equal(copy.lengths, chain.lengths)


def test_a_file_with_an_include_climbs_the_whole_ladder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From any folder: what a file includes lies beside it."""
    sensors = re.search(r"<sensor>.*</sensor>", CHAIN6.read_text(), re.DOTALL)
    assert sensors
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "sensors.xml").write_text(f"<mujoco>{sensors[0]}</mujoco>")
    text = CHAIN6.read_text().replace(sensors[0], '<include file="sensors.xml"/>')
    (tmp_path / "sub" / "arm.xml").write_text(text)
    monkeypatch.chdir(tmp_path)
    assert run(CrosscheckConfig(mjcf=Path("sub/arm.xml"))).ok


def test_acceleration_check_is_seeded() -> None:
    modes, chain = AssumedModesPlant(Parameters()), ChainPlant.designed(Parameters())
    first, again, other = (acceleration_difference(modes, chain, 5, seed) for seed in (1, 1, 2))
    assert first == again != other
    assert acceleration_difference(modes, chain, STATES, 1) >= first  # its first five are these


def test_trial_torque_is_the_stated_one() -> None:
    torque = trial_torque(2.0, duration=1.0)
    assert torque.shape == (1000, 2)
    np.testing.assert_allclose(torque[200], [1.0, 0.1 * np.sin(0.8 * np.pi)], rtol=1e-12)


def test_seed_out_of_range() -> None:
    with pytest.raises(ParameterError, match="seed is -1; give 0 or more"):
        run(CrosscheckConfig(seed=-1))


def test_verdicts_are_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "soft.xml"
    path.write_text(edited('stiffness="7.811', 'stiffness="3.905'))
    words = ["crosscheck", "--mjcf", str(path), "--beam", "analytic"]
    with pytest.raises(SystemExit) as ended:
        main([*words, "--json"])
    assert ended.value.code == 1
    found = json.loads(capsys.readouterr().out)
    assert found["ok"] is False
    assert all({"name", "value", "limit", "ok"} <= set(check) for check in found["rungs"])
    with pytest.raises(SystemExit):
        main(words)
    text = capsys.readouterr().out
    fails = sum(not check["ok"] for check in found["rungs"])
    holds = sum(check["ok"] and check["limit"] is not None for check in found["rungs"])
    assert (text.count("FAILS"), text.count("holds")) == (fails, holds)


LIGHT_LINK = 'mass="1" diaginertia="0.25 0.25 0.25"', 'mass="1" diaginertia="0.002 0.002 0.002"'


def test_torques_scale_with_a_light_arm(tmp_path: Path) -> None:
    """So that it is not thrown through turns that tell nothing; the default's are as stated."""
    path = tmp_path / "light.xml"
    path.write_text(edited(*LIGHT_LINK).replace('mass="0.47"', 'mass="0.01"'))
    light, usual = Robot.of(path).modes_plant(), Robot().modes_plant()
    assert np.array_equal(fitting_torque(usual, 4.0), trial_torque(4.0))
    share = np.abs(fitting_torque(light, 1.0)).max(axis=0) / np.abs(trial_torque(1.0)).max(axis=0)
    assert share[0] < 0.2 and share[1] <= 1.0
    result = run(CrosscheckConfig(mjcf=path))
    assert all(np.isfinite(check.value) for check in result.checks)


@pytest.mark.parametrize("factor", [20.0, 0.05])
def test_torques_move_heavy_and_light_arms_alike(factor: float) -> None:
    """All inertias and the stiffness times a factor: the same motion under as many times torque."""
    p = Parameters()
    own = {name: factor * getattr(p, name) for name in ("I_R0", "I_H", "m_H", "rho", "EI")}
    arm, usual = AssumedModesPlant(replace(p, **own, F_1=0.0, F_2=0.0)), AssumedModesPlant(p)
    torque = fitting_torque(arm, 1.0)
    np.testing.assert_allclose(torque, factor * trial_torque(1.0), rtol=1e-9)
    moved = [
        np.abs(drive(plant, setting("none"), fitting_torque(plant, 1.0), theta=POSE).v).max()
        for plant in (arm, usual)
    ]
    assert moved[0] == pytest.approx(moved[1], rel=0.02)  # the joints' friction is another share


def test_torques_bend_a_soft_beam_no_further_than_the_papers() -> None:
    soft = AssumedModesPlant(replace(Parameters(), EI=0.02))
    for scale in (1.0, 4.0):
        motion = drive(soft, setting("none"), fitting_torque(soft, scale), theta=POSE)
        bent = np.abs(motion.v).max() / 0.5
        assert 0.3 * BENT * scale < bent <= BENT * scale


def test_assumed_modes_that_are_refused_leave_the_chains_checks(tmp_path: Path) -> None:
    path = tmp_path / "rubbing.xml"
    path.write_text(edited('joint name="joint1"', 'joint name="joint1" frictionloss="0.1"'))
    result = run(CrosscheckConfig(mjcf=path))
    failed = [check for check in result.checks if not check.ok]
    assert "assumed modes" in failed[0].name
    assert all(each.value == np.inf and "friction" in each.name for each in failed)
    assert sum(check.ok and "1-3" in check.name for check in result.checks) == 3


def test_another_robot_with_a_beam_heavy_beside_its_hub_holds(tmp_path: Path) -> None:
    """Three modes leave 3 % of its third joint-free frequency: a limit that knows it."""
    p = replace(Parameters(), L=0.9, EI=2.0, rho=0.5, I_R0=1.5)
    path = tmp_path / "other.xml"
    path.write_text(chain_mjcf(p, design_chain(p, 6), timestep=5e-4))
    assert stands_for(Robot.of(path)).reference.truncation(3) > 0.02
    assert stands_for(Robot()).reference.truncation(3) < 1e-3
    result = run(CrosscheckConfig(mjcf=path))
    assert result.ok, [check for check in result.checks if not check.ok]


@pytest.mark.parametrize("payload", [0.04, 0.0785])
def test_a_robot_with_a_payload_that_turns_holds(payload: float, tmp_path: Path) -> None:
    """A radius of gyration of 0.1 L: higher modes leave the tip still, of which no share counts."""
    p = replace(Parameters(), payload=payload, payload_inertia=payload * (0.1 * 0.5) ** 2)
    path = tmp_path / "loaded.xml"
    path.write_text(chain_mjcf(p, design_chain(p, 6)))
    result = run(CrosscheckConfig(mjcf=path))
    assert result.ok, [check for check in result.checks if not check.ok]


def test_a_motion_that_runs_away_fails_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    def thrown(*_: object, **__: object) -> None:
        raise DivergenceError("the chain plant ran away at t = 0.1 s")

    monkeypatch.setattr("studies.parity.motion_checks.drive", thrown)
    result = run(CrosscheckConfig())
    failed = [check for check in result.checks if not check.ok]
    assert [check.value for check in failed] == [np.inf] * len(failed)
    assert "ran away at t = 0.1 s" in failed[0].name
    assert any(check.ok and "clamped" in check.name for check in result.checks)


def test_a_step_that_only_dampers_allow_is_said_of_the_undamped_energy(tmp_path: Path) -> None:
    """Its springs four times as stiff: at 1 ms semi-implicit steps need the dampers."""
    path = tmp_path / "stiff.xml"
    text = re.sub(r'stiffness="([^"]*)"', lambda m: f'stiffness="{4 * float(m[1])!r}"', DEFAULT)
    text = re.sub(r'(name="hinge\d".*) damping="[^"]*"', r'\1 damping="0.02"', text)
    path.write_text(text.replace('integrator="RK4"', 'integrator="implicitfast"'))
    by_name = {check.name: check for check in run(CrosscheckConfig(mjcf=path)).checks}
    gentle = named(by_name, "chain, gentle, step 1 ms, too long without dampers")
    assert gentle.ok and gentle.limit is None
    assert np.isfinite(named(by_name, "small torques").value)


def test_exudyn_at_rest_is_the_exact_beam_and_a_stiffer_one_fails() -> None:
    pytest.importorskip("exudyn", reason="an extra: pip install 'flexsim[exudyn]'")
    plant = exudyn_plant(Parameters())
    assert [each.verdict for each in still_checks(plant)] == ["holds", "holds"]
    stiff = exudyn_plant(Parameters(EI=1.01 * Parameters().EI))
    plant.__dict__["_straight"] = stiff._straight  # its own M, D, K, in place of those of the beam
    assert [each.verdict for each in still_checks(plant)] == ["FAILS", "FAILS"]


def test_exudyn_and_a_file_contradict_each_other() -> None:
    pytest.importorskip("exudyn", reason="an extra: pip install 'flexsim[exudyn]'")
    with pytest.raises(ParameterError, match="made from a uniform beam, not from"):
        run(CrosscheckConfig(mjcf=CHAIN6, exudyn=True))


@pytest.mark.slow
def test_exudyn_agrees_with_both_plants_in_motion() -> None:
    pytest.importorskip("exudyn", reason="an extra: pip install 'flexsim[exudyn]'")
    checks = [each for each in run(CrosscheckConfig(exudyn=True)).checks if "EXUDYN" in each.name]
    assert len(checks) == 8 and all(each.ok and each.limit is not None for each in checks)
