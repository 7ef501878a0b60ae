"""The worked examples for contributors: they run, and print what the guide says."""

from __future__ import annotations

import importlib.util
import math
import os
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numba
import numpy as np
import pytest

from flexsim import Robot
from flexsim.errors import ParameterError
from flexsim.loop import populations
from flexsim.loop.stacked import stacked
from flexsim.numerics.jit import is_ours
from flexsim.plants import dispatch

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
GUIDE = ROOT / "docs" / "CONTRIBUTING.md"
BLOCK = re.compile(r"```\n(.*?)```", re.S)
ROUNDING = 1e-12  # of a step, relative to the state


def example(name: str) -> ModuleType:
    """Return an example as a module, imported once."""
    if name not in sys.modules:
        spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
        assert spec is not None and spec.loader is not None
        sys.modules[name] = module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
    return sys.modules[name]


@pytest.fixture(scope="module")
def linear() -> ModuleType:
    return example("linear_plant")


def lines(text: str) -> list[str]:
    return [line.rstrip() for line in text.split("\n") if line.strip()]


def quoted(first: str) -> list[str]:
    (found,) = (m for m in BLOCK.findall(GUIDE.read_text(encoding="utf-8")) if first in m)
    return lines(found)


def test_the_plant_prints_what_the_guide_says(
    linear: ModuleType, capsys: pytest.CaptureFixture[str]
) -> None:
    linear.main()
    assert lines(capsys.readouterr().out) == quoted("tips apart")


def test_the_plant_moves_as_its_matrices_say(linear: ModuleType) -> None:
    arm = linear.LinearArm(Robot().modes_plant(), pose=1.2)
    near = arm.linearised(0.0)
    m = len(near.M)
    state = np.concatenate([np.zeros(2), [0.01, -0.002, 0.0005], np.full(5, 0.1)])
    whole = np.zeros((2 * m + 2, 2 * m + 2))
    whole[: 2 * m, : 2 * m], whole[: 2 * m, 2 * m :] = near.A, near.B
    torques = np.array([0.3, -0.1])
    terms = [np.linalg.matrix_power(whole * arm.step, k) / math.factorial(k) for k in range(5)]
    expected = (sum(terms) @ np.concatenate([state, torques]))[: 2 * m]  # RK4 of a linear system
    with arm.running(1) as coefficients:
        moved = state.copy()
        dispatch.physics_step(coefficients, 0, moved, *torques, dispatch.work_space(m))
        wrong = state.copy()
        dispatch.physics_step(coefficients, 0, wrong, *-torques, dispatch.work_space(m))
    scale = np.abs(expected).max()
    assert np.abs(moved - expected).max() < ROUNDING * scale
    assert np.abs(wrong - expected).max() > 1e9 * ROUNDING * scale  # the sign of the torques


def test_the_plant_keeps_its_energy_undamped(linear: ModuleType) -> None:
    arm = linear.LinearArm(Robot().modes_plant(), pose=1.2).undamped()
    state = np.concatenate([np.zeros(2), [0.01, 0.0, 0.0], np.zeros(5)])
    states = [state.copy()]
    with arm.running(1) as coefficients:
        for _ in range(100):
            dispatch.physics_step(coefficients, 0, state, 0.0, 0.0, dispatch.work_space(5))
            states.append(state.copy())
    energy = arm.observe(np.array(states)).energy
    assert np.abs(energy / energy[0] - 1).max() < 1e-4  # of RK4 at 368 rad/s and 1 ms


def test_it_needs_the_force_that_moves_it(linear: ModuleType) -> None:
    arm = linear.LinearArm(Robot().modes_plant(), pose=1.2)
    rng = np.random.default_rng(1)
    q, w = rng.normal(size=(2, 4, 5))
    with arm.running(1) as c:
        a, work = np.empty((4, 5)), np.empty(5)
        for k in range(4):
            linear.linear_acceleration(c, q[k], w[k], 0.3, -0.1, a[k], work)
    expected = np.broadcast_to(arm.linearised(0.0).S @ [0.3, -0.1], (4, 5))
    np.testing.assert_allclose(arm.needed_force(q, w, a), expected, atol=1e-9)


def test_a_type_is_registered_once(linear: ModuleType) -> None:
    with pytest.raises(ParameterError, match="LinearCoefficients is registered already"):
        dispatch.register(linear.LinearCoefficients, linear.linear_step, linear.linear_tip)


def test_code_for_a_plant_that_is_not_ours_is_not_kept(linear: ModuleType) -> None:
    """Another process could not read it, and an edit of the plant would not be seen."""
    modes = Robot().modes_plant()
    with linear.LinearArm(modes, 1.2).running(1) as theirs, modes.running(1) as ours:
        assert not is_ours(numba.typeof(theirs)) and is_ours(numba.typeof(ours))
        assert not is_ours(numba.typeof(stacked([theirs]).items))
        assert is_ours(numba.typeof(stacked([ours]).items))
        assert not is_ours(numba.typeof((1.0, (theirs,))))
    assert not is_ours(numba.typeof(linear.linear_acceleration))
    assert is_ours(numba.typeof(dispatch.modes_step)) and is_ours(numba.typeof(1.0))
    assert type(populations.run_some._cache).__module__ == "flexsim.numerics.jit"  # type: ignore[attr-defined]


def test_the_controllers_study_runs(tmp_path: Path) -> None:
    words = ["run", EXAMPLES / "notched_pd.toml", "--out", tmp_path / "run", "--set", "repeats=2"]
    done = subprocess.run(
        [sys.executable, "-m", "flexsim", *map(str, words)],
        capture_output=True,
        text=True,
        env={**os.environ, "COLUMNS": "80"},
        cwd=tmp_path,
    )
    assert done.returncode == 0, done.stderr
    assert "16 runs, 0 diverged." in done.stdout
    assert (tmp_path / "run" / "inputs" / "notched_pd.py").is_file()


def test_the_study_prints_what_the_guide_says(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    poses: Any = example("poses")
    monkeypatch.setenv("COLUMNS", "80")
    poses.command(poses.PosesConfig(out=tmp_path / "run"))
    printed = lines(capsys.readouterr().out)
    assert printed[:-1] == quoted("Frequencies with free joints")
    held = {path.name for path in (tmp_path / "run").iterdir()}
    assert {"config.json", "results.csv", "results.tex", "figures", "tables.json"} <= held
    assert "ro-crate-metadata.json" in held
    assert (tmp_path / "run" / "figures" / "poses.pdf").is_file()


def test_the_study_refuses_in_a_line(tmp_path: Path) -> None:
    command = [sys.executable, EXAMPLES / "poses.py", "--poses", "1", "--out", tmp_path / "run"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stderr == "flexsim: poses is 1; give 2 or more\n"
    assert not (tmp_path / "run").exists()
