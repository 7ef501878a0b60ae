"""Figures: written whole, 1600 pixels wide, with the reference, both plants and the paper's."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.image import imread
from recorded_cases import DIVERGED, SAMPLES, STEP, made_up_cases

from flexsim import ParameterError, Parameters, RunError
from flexsim.loop.trajectories import Trajectory, reference
from flexsim.recording.case import Case
from studies.compare.figures import case_figure, summary_figure
from studies.compare.rows import CompareRow
from studies.core.evidence.repeats import medians
from studies.core.figures import STYLES, save
from studies.core.paper import paper_envelopes

WIDTH = 1600  # [pixel]
CURVE_PIXELS = 300  # a curve across half a figure colours at least this many


@pytest.fixture(scope="module")
def cases() -> list[Case]:
    return made_up_cases()


def summary_rows() -> list[CompareRow]:
    """Return rows of two cases, in one of which the chain diverges."""
    return [
        CompareRow(
            *(controllers, "line", plant, "opposing", "ours", "mirrored tip"),
            medians([{"envelope": envelope, "diverged": envelope is None, "diverged_at": 1.0}]),
            *(None, None, 0.0),
        )
        for controllers, plant, envelope in (
            ("tuned line", "assumed-modes", 0.004),
            ("tuned line", "chain", 0.005),
            ("paper two-loop", "assumed-modes", 0.034),
            ("paper two-loop", "chain", None),
        )
    ]


def pixels(path: Path, colour: str) -> int:
    """Return how many pixels of a PNG have a colour, up to rounding."""
    image = imread(path)[..., :3]
    return int((np.abs(image - to_rgb(colour)).max(axis=-1) < 0.02).sum())


def test_case_figure_shows_both_plants(cases: list[Case], tmp_path: Path) -> None:
    path = tmp_path / "line.png"
    save(case_figure(cases[0]), path)
    assert imread(path).shape[1] == WIDTH
    for plant in cases[0].motions:
        assert pixels(path, STYLES[plant]["color"]) > CURVE_PIXELS, plant
    assert list(tmp_path.iterdir()) == [path]


def test_case_figure_holds_the_motions(cases: list[Case]) -> None:
    figure = case_figure(cases[0])
    axes = {a.get_label(): a for a in figure.axes}
    chain = cases[0].motions["chain"]
    for name, wanted in (("x", chain.tip[:, 0]), ("y", chain.tip[:, 1]), ("v", 1000 * chain.v)):
        lines = [line for line in axes[name].lines if line.get_color() == STYLES["chain"]["color"]]
        assert np.array_equal(lines[0].get_ydata(), wanted)
    dashed = [line for line in axes["path"].lines if line.get_label() == "reference"]
    assert np.array_equal(dashed[0].get_xydata(), chain.reference_tip)
    assert dashed[0].get_linestyle() == "--"
    assert axes["path"].get_aspect() == 1.0
    assert all("[m" in axes[name].get_ylabel() for name in ("x", "y", "v", "path"))
    title = figure.get_suptitle()
    assert all(
        word in title for word in ("line", "tuned fractional PIDs", "opposing", "hardware: ")
    )


def test_case_figure_marks_divergence(cases: list[Case]) -> None:
    figure = case_figure(cases[1])
    axes = {a.get_label(): a for a in figure.axes}
    marks = [line for line in axes["x"].lines if line.get_marker() == "X"]
    assert [float(line.get_xdata()[0]) for line in marks] == [pytest.approx((DIVERGED - 1) * STEP)]
    assert axes["x"].get_xlim()[1] == pytest.approx((SAMPLES - 1) * STEP)
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "chain, diverged at 1.800 s" in labels and "assumed modes" in labels


def test_reference_is_whole_when_all_diverge(cases: list[Case]) -> None:
    whole = reference(Trajectory("line"), Parameters(), STEP)
    lost = {"chain": cases[1].motions["chain"]}
    figure = case_figure(replace(cases[1], motions=lost, reference=whole))
    (path,) = (a for a in figure.axes if a.get_label() == "path")
    dashed = [line for line in path.lines if line.get_label() == "reference"]
    assert np.array_equal(dashed[0].get_xydata(), whole.tip)


def test_summary_shows_rows_and_paper(tmp_path: Path) -> None:
    path = tmp_path / "summary.png"
    figure = summary_figure(summary_rows())
    save(figure, path)
    assert imread(path).shape[1] == WIDTH
    (axes,) = figure.axes
    values = {float(x) for line in axes.lines for x in np.atleast_1d(line.get_xdata())}
    assert values == {0.004, 0.005, 0.034, 0.016, 0.053, 0.033, 0.042}
    assert axes.get_xscale() == "log" and axes.get_xlabel().endswith("[m]")
    assert [text.get_text() for text in axes.texts] == ["chain diverged"]
    assert len(axes.get_yticks()) == 2


def test_paper_envelopes_are_table_3() -> None:
    assert paper_envelopes("line", "paper-line") == (0.016, 0.053)
    assert paper_envelopes("two_loop", "paper_two_loop") == (0.014, 0.021)
    assert paper_envelopes("circle", "tuned") == (0.006, 0.018)
    assert paper_envelopes("line", "paper two-loop".replace(" ", "-")) == (0.033, 0.042)
    assert paper_envelopes("spiral", "tuned") is None


def test_nothing_global_is_touched(cases: list[Case]) -> None:
    before = dict(matplotlib.rcParams)
    case_figure(cases[0])
    assert dict(matplotlib.rcParams) == before


def test_same_case_same_bytes(cases: list[Case], tmp_path: Path) -> None:
    for name in ("a.png", "b.png"):
        save(case_figure(cases[0]), tmp_path / name)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_errors_say_what_to_do(cases: list[Case], tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="nothing to summarise"):
        summary_figure([])
    with pytest.raises(RunError, match="cannot write the figure"):
        save(case_figure(cases[0]), tmp_path / "missing" / "line.png")
    assert not list(tmp_path.iterdir())
