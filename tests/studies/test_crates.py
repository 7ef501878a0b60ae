"""Run folders as research objects: a validator of other people's finds nothing against them."""

from __future__ import annotations

import importlib
import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from crates import issues
from quick_run import QuickRun

from flexsim.errors import RunError
from studies.core.carry_out import Study
from studies.core.folders.crate import CRATE, crate_of
from studies.main import COMMANDS, main

STUDY = """
repeats = 1
plants = ["assumed-modes"]
controllers = [{ use = "line" }]
trajectories = [{ use = "line", duration = 0.5, hold = 0.1 }]
"""


@pytest.fixture(scope="module")
def ladder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("crate") / "run"
    assert main(["ladder", "--quick", "--rounds", "1", "--out", str(folder)]) == 0
    return folder


def test_a_studys_folder_is_a_valid_crate(ladder: Path) -> None:
    assert issues(ladder) == []
    graph = json.loads((ladder / CRATE).read_text(encoding="utf-8"))["@graph"]
    by = {each["@id"]: each for each in graph}
    names = {p.relative_to(ladder).as_posix() for p in ladder.rglob("*") if p.is_file()}
    shown = {name for name in names if not name.startswith(".") and name != CRATE}
    assert {part["@id"] for part in by["./"]["hasPart"]} == shown
    assert by["./"]["name"].startswith("How much model") and "tip within" in by["./"]["description"]
    assert by["#run"]["name"].startswith("flexsim") and by["#flexsim"]["softwareVersion"]


def test_a_crate_that_is_not_valid_is_found(ladder: Path, tmp_path: Path) -> None:
    broken = shutil.copytree(ladder, tmp_path / "broken")
    (broken / "rows.csv").unlink()
    said = " ".join(issues(broken))
    assert "rows.csv" in said
    text = (broken / CRATE).read_text(encoding="utf-8")
    (broken / CRATE).write_text(text.replace('"sha256": "http', '"sha512": "http'))
    assert '"sha256" are not allowed' in " ".join(issues(broken))
    (broken / CRATE).write_text(text.replace('"datePublished": "2', '"datePublished": "x'))
    assert "datePublished" in " ".join(issues(broken))


def test_a_run_of_a_study_file_and_a_tuning_are_crates(tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text(STUDY)
    assert main(["run", str(tmp_path / "study.toml"), "--out", str(tmp_path / "mine")]) == 0
    words = ["--trajectory", "line", "--population", "8", "--generations", "2", "--survivors", "2"]
    assert main(["tune", *words, "--out", str(tmp_path / "tuned")]) == 0
    for name in ("mine", "tuned"):
        assert issues(tmp_path / name) == []
    graph = json.loads((tmp_path / "mine" / CRATE).read_text(encoding="utf-8"))["@graph"]
    (action,) = (each for each in graph if each["@type"] == "CreateAction")
    read, made = ({part["@id"] for part in action[of]} for of in ("object", "result"))
    assert {"config.json", "study.toml"} <= read and "results.parquet" in made and not read & made


def test_a_time_that_is_none_is_refused(ladder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for wrong in ("99999999999999", "soon"):
        monkeypatch.setenv("SOURCE_DATE_EPOCH", wrong)
        with pytest.raises(RunError, match=f"SOURCE_DATE_EPOCH is '{wrong}'; give whole seconds"):
            crate_of(ladder, {})


def studies_with_folders() -> list[str]:
    modules = {name: f"studies.{each.module}" for name, each in COMMANDS.items()}
    return [
        name
        for name, module in modules.items()
        if isinstance(getattr(importlib.import_module(module), "command", None), Study)
    ]


@pytest.mark.slow
@pytest.mark.parametrize("name", studies_with_folders())
def test_every_study_leaves_a_crate(name: str, quick: Callable[[str], QuickRun]) -> None:
    assert issues(quick(name).folder) == []


def test_the_same_bytes_at_the_same_time(ladder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    first, second = (crate_of(ladder, {"question": "why?"}) for _ in range(2))
    assert first == second
    root = next(each for each in first["@graph"] if each["@id"] == "./")
    assert root["datePublished"] == "2023-11-14T22:13:20+00:00" and root["name"] == "why?"
