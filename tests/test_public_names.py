"""The public names of flexsim: complete, typed, and loaded only when they are asked for."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import flexsim
from flexsim import Robot, drive, model_path, setting

PROMISED = """Robot Parameters setting trajectory reference closed_loop evaluate drive
measures errors
load_chain Motion ChainPlant AssumedModesPlant FlexsimError ParameterError ModelError RunError"""
HEAVY = {"mujoco", "numba", "numpy", "scipy", "rerun", "matplotlib", "tyro", "rich", "cma"}


def test_the_promised_names_are_public() -> None:
    assert set(PROMISED.split()) <= set(flexsim.__all__) <= set(dir(flexsim))
    for name in flexsim.__all__:
        assert getattr(flexsim, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        flexsim.nonsense  # noqa: B018


def test_what_is_typed_is_what_is_loaded() -> None:
    """The imports that a type checker sees are those of the table that names are loaded by."""
    tree = ast.parse(Path(flexsim.__file__).read_text())
    typed = {
        alias.name: (node.module or "").removeprefix("flexsim").removeprefix(".") or alias.name
        for block in tree.body
        if isinstance(block, ast.If)
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert typed == flexsim._HOMES
    assert sorted(typed) == sorted(flexsim.__all__)


@pytest.mark.parametrize(
    "code",
    [
        "import flexsim",
        "import flexsim; flexsim.errors.FlexsimError",
        "from studies.main import main; main(['--help'])",
        "from studies.main import main; main(['help'])",
        "from studies.main import main; main(['--version'])",
        "from studies.main import main; main(['compere'])",
    ],
)
def test_nothing_heavy_is_loaded_before_it_is_needed(code: str) -> None:
    ask = f"import sys; {code}; print(*sys.modules, file=sys.stderr)"
    done = subprocess.run([sys.executable, "-c", ask], capture_output=True, text=True, check=True)
    loaded = {name.partition(".")[0] for name in done.stderr.split()}
    assert loaded & {"flexsim", "studies"} and not loaded & HEAVY


def test_a_robot_a_plant_a_motion() -> None:
    """As the README has it: a file, a plant of it by name, an open loop."""
    robot = Robot.of(model_path("chain6.xml"))
    assert robot.file is not None and Robot.of(model_path("rod.xml")).file is None
    plant = robot.plant("chain", setting("none"))
    torque = np.zeros((20, 2))
    motion = drive(plant, setting("none"), torque, period=1e-3, theta=(0.0, 1.2))
    assert plant.step == 1e-3 and robot.modes_plant(setting("none")).step == 1e-3
    assert motion.tip.shape == motion.joint.shape == (21, 2)
    np.testing.assert_allclose(motion.joint, [[0.0, 1.2]] * 21, atol=1e-12)  # nothing moves


def test_shipped_models_are_found_by_name() -> None:
    assert model_path("chain6.xml").read_text().startswith("<mujoco")
    for name in ("chain7.xml", "../pyproject.toml", "README.md", ""):
        with pytest.raises(flexsim.ModelError, match=r"there is no model .* choose one of chain10"):
            model_path(name)
