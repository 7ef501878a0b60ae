"""The wheel: built, installed into a fresh environment, run from an empty folder."""

from __future__ import annotations

import importlib.metadata
import json
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from programs import missing

ROOT = Path(__file__).parents[1]
SETUPTOOLS = 77  # which the build needs; `make install` has it
PATIENCE = 300.0  # [s] for a command that compiles everything anew
PACKAGES = ("flexsim", "controllers", "studies", "models")

SHIPPED = (".py", ".xml", ".c", ".html", ".css", ".js", ".toml")
FREQUENCIES = [3.337288582, 20.914430540, 58.561011112]  # [Hz] of the clamped beam, from (15)
OFFLINE = ("name resolution", "NewConnectionError", "Max retries", "unreachable", "versions: none")


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Built from a copy of the sources, without the network."""
    if int(importlib.metadata.version("setuptools").partition(".")[0]) < SETUPTOOLS:
        missing(f"building needs setuptools {SETUPTOOLS} here: make install")
    sources, built = tmp_path_factory.mktemp("sources"), tmp_path_factory.mktemp("built")
    for name in PACKAGES:
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / name, sources / name, ignore=ignored)
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, sources)
    pip = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-index"]
    subprocess.run([*pip, "--no-build-isolation", "-w", built, sources], check=True)
    (found,) = built.glob("flexsim-*.whl")
    return found


@pytest.fixture(scope="module")
def fresh(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The programs of an environment with the wheel and what it says that it depends on."""
    environment = tmp_path_factory.mktemp("environment") / "venv"
    subprocess.run([sys.executable, "-m", "venv", environment], check=True)
    pip = [environment / "bin" / "python", "-m", "pip", "--disable-pip-version-check", "install"]
    known = ["-c", ROOT / "constraints.txt"]
    command = [*pip, "--quiet", "--no-compile", *known, wheel]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode and any(said in done.stderr for said in OFFLINE):
        missing(f"cannot be installed without the network: {done.stderr.strip()[-200:]}")
    assert done.returncode == 0, done.stderr
    return environment / "bin"


def ran(program: Path, *words: str, folder: Path) -> str:
    """Return what a program prints, run in a folder with nothing of ours in its environment."""
    kept = ("HOME", "PATH", "TMPDIR", "XDG_CACHE_HOME")
    environment = {name: os.environ[name] for name in kept if name in os.environ}
    how = {"cwd": folder, "env": environment, "timeout": PATIENCE}
    done = subprocess.run([program, *words], capture_output=True, text=True, check=False, **how)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_wheel_holds_every_package_and_model(wheel: Path) -> None:
    held = set(zipfile.ZipFile(wheel).namelist())
    wanted = {
        str(path.relative_to(ROOT))
        for name in PACKAGES
        for path in (ROOT / name).rglob("*.*")
        if path.suffix in SHIPPED or (path.suffix == ".csv" and path.parent.name == "files")
    }
    assert wanted <= held
    assert {name.partition("/")[0] for name in held if ".dist-info" not in name} == set(PACKAGES)


def test_it_runs_from_an_empty_folder(fresh: Path, tmp_path: Path) -> None:
    version, models = ran(fresh / "flexsim", "--version", folder=tmp_path).splitlines()
    assert version == f"flexsim {importlib.metadata.version('flexsim')}"  # of no commit
    assert Path(models.removeprefix("models: ")).is_relative_to(fresh.parent)
    assert "compare" in ran(fresh / "python", "-m", "flexsim", "--help", folder=tmp_path)
    found = json.loads(ran(fresh / "flexsim", "modes", "--json", folder=tmp_path))
    models = [found["clamped_hz"][name] for name in ("assumed_modes", "chain")]
    assert models[0] == pytest.approx(FREQUENCIES, rel=1e-6)
    assert models[1] == pytest.approx(FREQUENCIES, rel=1e-6)
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_its_models_agree(fresh: Path, tmp_path: Path) -> None:
    """By all that is compiled, anew."""
    found = json.loads(ran(fresh / "flexsim", "crosscheck", "--json", folder=tmp_path))
    assert found["ok"] and len(found["rungs"]) > 5


@pytest.mark.slow
def test_it_compares_from_an_empty_folder(fresh: Path, tmp_path: Path) -> None:
    ran(fresh / "flexsim", "compare", "--quick", "--out", "run", folder=tmp_path)
    held = {path.name for path in (tmp_path / "run").iterdir()}
    assert {"config.json", "results.csv", "run.rrd", "figures"} <= held
    assert [path.name for path in tmp_path.iterdir()] == ["run"]


@pytest.mark.slow
def test_its_models_are_found(fresh: Path, tmp_path: Path) -> None:
    code = """
import flexsim
path = flexsim.model_path("chain6.xml")
print(path)
print(flexsim.Robot.of(path).plant("chain").step)
"""
    path, step = ran(fresh / "python", "-c", code, folder=tmp_path).split()
    assert Path(path).is_relative_to(fresh.parent) and step == "0.001"
    assert Path(path).read_bytes() == (ROOT / "models" / "chain6.xml").read_bytes()
    assert "Clamped beam" in ran(fresh / "flexsim", "modes", folder=tmp_path)
    shown = ran(fresh / "flexsim", "crosscheck", "--mjcf", path, "--json", folder=tmp_path)
    assert json.loads(shown)["ok"]
