"""A tuning's controller read back: by its run's folder, whatever state that is in."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from controllers import Controller, Gains
from flexsim.errors import ParameterError, RunError
from studies.main import main
from studies.tuning.distributions import NAMES
from studies.tuning.found import FoundController, found_in
from studies.tuning.individuals import ControllerDesign

ROUNDING = 1e-14  # relative to the largest tap: two orders of summation of eleven terms
SMALL = (  # some hold from the first generation on
    *("--trajectory", "circle", "--setting", "none", "--distribution", "wide", "--seed", "2"),
    *("--population", "12", "--survivors", "3", "--generations", "4"),
)
FACTORS = np.array([1.1, 0.9, 1.2, 0.8, 1.3, 0.7])  # of k1 to k6


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("found") / "circle-run"
    assert main(["tune", *SMALL, "--out", str(folder)]) == 0
    return folder


@pytest.fixture
def copied(run: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(run, tmp_path / "copy"))


def change(folder: Path, name: str, edit: Callable[[Any], None]) -> None:
    content = json.loads((folder / name).read_text())
    edit(content)
    (folder / name).write_text(json.dumps(content))


def same(one: FoundController, other: FoundController) -> bool:
    pairs = zip(one.filters(1e-3), other.filters(1e-3), strict=True)
    return all(np.array_equal(b, d) and np.array_equal(a, c) for (b, a), (d, c) in pairs)


def own(parameters: np.ndarray) -> Controller:
    halves = (Gains.from_milliseconds(*part) for part in (parameters[:5], parameters[5:]))
    return Controller("", *halves, "")


def test_it_is_the_results(run: Path) -> None:
    found, result = found_in(run), json.loads((run / "result.json").read_text())
    assert (found.name, found.period, found.tuning.trajectory) == ("circle-run", 1e-3, "circle")
    assert found.parameters.tolist() == [result["best_parameters"][name] for name in NAMES]
    pairs = zip(found.filters(1e-3), own(found.parameters).filters(1e-3), strict=True)
    for (b, a), (own_b, own_a) in pairs:
        assert np.array_equal(a, own_a)
        assert np.abs(b - own_b).max() <= ROUNDING * np.abs(own_b).max()


def test_the_folder_may_be_spelled_in_any_way(run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(run)
    assert found_in(Path(".")).name == found_in(Path("figures/..")).name == "circle-run"


def test_gains_are_perturbed_in_their_order(run: Path) -> None:
    found = found_in(run)
    scaled = found.parameters * [1.1, 1, 0.9, 1, 1.2, 0.8, 1, 1.3, 1, 0.7]
    (expected,) = ControllerDesign().filters(scaled[None])
    assert expected is not None
    for (b, a), (c, d) in zip(found.perturbed(FACTORS), expected, strict=True):
        assert np.array_equal(b, c) and np.array_equal(a, d)
    for wrong in (np.ones(5), np.full(6, np.nan), np.ones((6, 1))):
        with pytest.raises(ParameterError, match="six finite"):
            found.perturbed(wrong)


def test_another_period_is_refused(run: Path) -> None:
    with pytest.raises(ParameterError, match=r"0\.001 s, got 0\.002 s"):
        found_in(run).filters(2e-3)


def test_the_realisation_is_the_tunings(copied: Path) -> None:
    change(
        copied,
        "config.json",
        lambda c: c["configuration"].update(realisation="oustaloup", terms=3, period=2e-3),
    )
    found = found_in(copied)
    for (b, a), (c, d) in zip(
        found.filters(2e-3),
        own(found.parameters).filters(2e-3, "oustaloup", 3),
        strict=True,
    ):
        assert np.allclose(b, c, rtol=1e-12) and np.allclose(a, d, rtol=1e-12)


def test_other_versions_results_are_read(run: Path, copied: Path) -> None:
    """Also those of before an option was there; not those with options that we do not know."""
    change(copied, "config.json", lambda c: c["versions"].update(numpy="1.0", sources="0"))
    change(copied, "config.json", lambda c: c["configuration"].pop("exact_spread"))
    assert same(found_in(copied), found_in(run))
    assert main(["tune", "--resume", str(copied)]) == 2
    change(copied, "config.json", lambda c: c["configuration"].update(spin=1.0))
    with pytest.raises(RunError, match="knows no 'spin'"):
        found_in(copied)


def test_an_interrupted_run_gives_its_best_so_far(run: Path, copied: Path) -> None:
    (copied / "result.json").unlink()
    assert same(found_in(copied), found_in(run))
    lines = (copied / "generations.csv").read_bytes().splitlines(keepends=True)
    (copied / "generations.csv").write_bytes(b"".join(lines[:13]) + b"1,0,mutant,3")
    rows = [line.decode().rstrip().split(",") for line in lines[1:13]]
    best = min(rows, key=lambda row: float(row[lines[0].decode().split(",").index("index")]))
    assert found_in(copied).parameters.tolist() == [float(each) for each in best[3:13]]
    (copied / "generations.csv").write_bytes(b"".join(lines[:5]))
    with pytest.raises(RunError, match="no complete generation"):
        found_in(copied)


def test_a_search_that_found_nothing_has_no_controller(tmp_path: Path) -> None:
    small = ["--controller", "pid", "--population", "8", "--generations", "1"]
    assert main(["tune", *small, "--out", str(tmp_path / "run")]) == 0
    with pytest.raises(RunError, match="has no controller"):
        found_in(tmp_path / "run")
    (tmp_path / "run/result.json").unlink()
    with pytest.raises(RunError, match="has no controller"):
        found_in(tmp_path / "run")


def text_of(name: str, text: str) -> Callable[[Path], object]:
    return lambda folder: (folder / name).write_text(text)


def edited(name: str, edit: Callable[[Any], None]) -> Callable[[Path], object]:
    return lambda folder: change(folder, name, edit)


def piped(folder: Path) -> None:
    (folder / "result.json").unlink()
    os.mkfifo(folder / "result.json")


def long(folder: Path) -> None:
    with (folder / "config.json").open("wb") as file:
        file.truncate(1 << 40)


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (shutil.rmtree, "not a run of flexsim tune"),
        (lambda folder: (folder / "config.json").unlink(), "not a run of flexsim tune"),
        (text_of("config.json", "{"), "damaged or not of flexsim tune"),
        (text_of("config.json", "[" * 100_000), "damaged or not of flexsim tune"),
        (text_of("config.json", '{"configuration": {}, "versions": {}}'), "damaged or not"),
        (edited("config.json", lambda c: c.update(configuration={"out": "x"})), "damaged or not"),
        (edited("config.json", lambda c: c["configuration"].update(period="x")), "damaged|period"),
        (edited("config.json", lambda c: c["configuration"].update(terms=2.5)), "terms"),
        (edited("config.json", lambda c: c["configuration"].update(v_gain=10**400)), "damaged"),
        (edited("config.json", lambda c: c["configuration"].update(trajectory="l")), "two-loop"),
        (long, "more than"),
        (text_of("result.json", "null"), "damaged"),
        (text_of("result.json", '{"best_parameters": {"k1": 1}}'), "damaged"),
        (edited("result.json", lambda c: c["best_parameters"].update(k7=1)), "damaged"),
        (edited("result.json", lambda c: c["best_parameters"].update(k1=10**400)), "damaged"),
        (edited("result.json", lambda c: c["best_parameters"].update(k1=1e308)), "damaged|no filt"),
        (edited("result.json", lambda c: c["best_parameters"].update(nu1=None)), "damaged"),
        (piped, "a pipe"),
    ],
)
def test_what_cannot_be_used_is_said_in_one_line(
    copied: Path, spoil: Callable[[Path], object], words: str
) -> None:
    spoil(copied)
    with pytest.raises(RunError, match=words) as caught:
        found_in(copied)
    assert str(caught.value).count("\n") == 0
