"""One quick run of each study per session, and two small runs of the tuner."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from quick_run import QuickRun, carried_out

from studies.main import main

WIDE = (  # some hold from the first generation on
    *("--trajectory", "circle", "--setting", "none", "--distribution", "wide", "--seed", "2"),
    *("--population", "12", "--survivors", "3"),
)
OTHERWISE = ("--realisation", "oustaloup", "--terms", "3", "--period", "0.002", "--v-gain", "0")


@pytest.fixture(scope="session")
def quick(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], QuickRun]:
    """Return a function from a command's name to its quick run, carried out once."""
    kept: dict[str, QuickRun] = {}

    def run(name: str) -> QuickRun:
        if name not in kept:
            kept[name] = carried_out(name, tmp_path_factory.mktemp(name) / "run")
        return kept[name]

    return run


@pytest.fixture(scope="session")
def tuned(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a small run of flexsim tune, for the circle."""
    folder = tmp_path_factory.mktemp("tuned") / "small"
    assert main(["tune", *WIDE, "--generations", "4", "--out", str(folder)]) == 0
    return folder


@pytest.fixture(scope="session")
def tuned_otherwise(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return that of one with poles, at 2 ms, which ignores v."""
    folder = tmp_path_factory.mktemp("tuned") / "otherwise"
    words = ["tune", *WIDE, *OTHERWISE, "--generations", "2", "--out", str(folder)]
    assert main(words) == 0
    return folder
