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

from controllers import TABLE_2, TUNED, TUNED_IDEAL, Controller, Gains
from flexsim.errors import ParameterError, RunError
from studies.core.text import word
from studies.main import main
from studies.tuning.distributions import NAMES
from studies.tuning.found import (
    OWN,
    FoundController,
    controller_of,
    controllers_of,
    devised_for,
    found_in,
    label_of,
    period_of,
    v_gain_of,
)
from studies.tuning.individuals import ControllerDesign

ROUNDING = 1e-14  # relative to the largest tap: two orders of summation of eleven terms
FACTORS = np.array([1.1, 0.9, 1.2, 0.8, 1.3, 0.7])  # of k1 to k6


@pytest.fixture
def copied(tuned: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(tuned, tmp_path / "copy"))


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


def test_it_is_the_results(tuned: Path) -> None:
    found, result = found_in(tuned), json.loads((tuned / "result.json").read_text())
    assert (found.name, found.period, found.tuning.trajectory) == ("small", 1e-3, "circle")
    assert found.parameters.tolist() == [result["best_parameters"][name] for name in NAMES]
    pairs = zip(found.filters(1e-3), own(found.parameters).filters(1e-3), strict=True)
    for (b, a), (own_b, own_a) in pairs:
        assert np.array_equal(a, own_a)
        assert np.abs(b - own_b).max() <= ROUNDING * np.abs(own_b).max()


def test_the_folder_may_be_spelled_in_any_way(tuned: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tuned)
    assert found_in(Path(".")).name == found_in(Path("figures/..")).name == "small"


def test_gains_are_perturbed_in_their_order(tuned: Path) -> None:
    found = found_in(tuned)
    scaled = found.parameters * [1.1, 1, 0.9, 1, 1.2, 0.8, 1, 1.3, 1, 0.7]
    (expected,) = ControllerDesign().filters(scaled[None])
    assert expected is not None
    for (b, a), (c, d) in zip(found.perturbed(FACTORS), expected, strict=True):
        assert np.array_equal(b, c) and np.array_equal(a, d)
    for wrong in (np.ones(5), np.full(6, np.nan), np.ones((6, 1))):
        with pytest.raises(ParameterError, match="six finite"):
            found.perturbed(wrong)


def test_another_period_is_refused(tuned: Path) -> None:
    with pytest.raises(ParameterError, match=r"0\.001 s, got 0\.002 s"):
        found_in(tuned).filters(2e-3)


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


def test_other_versions_results_are_read(tuned: Path, copied: Path) -> None:
    """Also those of before an option was there; not those with options that we do not know."""
    change(copied, "config.json", lambda c: c["versions"].update(numpy="1.0", sources="0"))
    change(copied, "config.json", lambda c: c["configuration"].pop("exact_spread"))
    assert same(found_in(copied), found_in(tuned))
    assert main(["tune", "--resume", str(copied)]) == 2
    change(copied, "config.json", lambda c: c["configuration"].update(spin=1.0))
    with pytest.raises(RunError, match="knows no 'spin'"):
        found_in(copied)


def test_an_interrupted_run_gives_its_best_so_far(tuned: Path, copied: Path) -> None:
    (copied / "result.json").unlink()
    assert same(found_in(copied), found_in(tuned))
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


def test_a_controller_is_told_by_its_name_or_its_folder(
    tuned: Path, tuned_otherwise: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A name comes before a folder of that name, which a slash tells from it."""
    monkeypatch.chdir(tmp_path)
    shutil.copytree(tuned, "circle")
    shutil.copytree(tuned, "mine")
    assert controller_of("circle") is TUNED["circle"]
    assert controller_of("ideal-line") is TUNED_IDEAL["line"]
    assert controller_of("figure-4") is TABLE_2["figure-4"]
    assert {devised_for(each) for each in OWN.values()} == {"line", "two-loop", "circle", "turn"}
    assert devised_for(controller_of("figure-4")) == "two-loop"
    for name in ("mine", "./circle", str(tuned)):
        found = controller_of(name)
        assert isinstance(found, FoundController) and same(found, found_in(tuned))
    assert label_of(controller_of("./circle")) == "run circle"
    other = controller_of(str(tuned_otherwise))
    assert (period_of(other), v_gain_of(other), devised_for(other)) == (2e-3, 0.0, "circle")
    assert (period_of(OWN["line"]), v_gain_of(OWN["line"])) == (1e-3, -1.0)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("circel", "'circel' is unknown; choose of line, .* Did you mean circle"),
        ("Ideal-Line", "Did you mean ideal-line"),
        ("", "'' is unknown"),
        ("no/such", "no/such is not a run of flexsim tune"),
    ],
)
def test_what_is_neither_is_said(name: str, words: str) -> None:
    with pytest.raises((ParameterError, RunError), match=words):
        controller_of(name)


def test_runs_of_one_name_are_numbered(tuned: Path, tmp_path: Path) -> None:
    other = Path(shutil.copytree(tuned, tmp_path / "small"))
    found = controllers_of([str(tuned), "line", str(other)])
    assert [label_of(each) for each in found.values()] == ["run small", "line", "run small (2)"]
    alike = ("a b", "a_b", "A|B", "a b (2)", "x" * 80, "x" * 81, "*", "?")
    paths = [str(shutil.copytree(tuned, tmp_path / name)) for name in alike]
    labels = [label_of(each) for each in controllers_of(paths).values()]
    assert labels[:4] == ["run a b", "run a_b (2)", "run A_B (3)", "run a b (2) (2)"]
    assert len({word(each).lower() for each in labels}) == len(alike)


def test_controllers_of_ours_are_scaled_as_those_of_runs(tuned: Path) -> None:
    found = found_in(tuned)
    mine = own(found.parameters).scaled(FACTORS.tolist()).filters(1e-3)
    for (b, _), (c, _) in zip(found.perturbed(FACTORS), mine, strict=True):
        assert np.abs(b - c).max() <= ROUNDING * np.abs(c).max()
