"""Figures for print: sizes of journals, text as text, the same bytes; what those of cases show."""

from __future__ import annotations

import re
import zlib
from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from figure_rules import faults
from matplotlib.colors import to_rgb
from matplotlib.image import imread
from recorded_cases import DIVERGED, SAMPLES, STEP, made_up_cases

from flexsim import ParameterError, Parameters, RunError
from flexsim.loop.trajectories import Trajectory, reference
from flexsim.recording.case import Case
from studies.compare.figures import case_figure, summary_figure
from studies.compare.rows import CompareRow
from studies.core.evidence.repeats import medians
from studies.core.figures import (
    CAPTIONS,
    DOUBLE,
    DPI,
    INCH,
    SINGLE,
    STYLES,
    canvas,
    finish,
    interval,
    log_axis,
    raised,
    save,
    styles,
    thinned,
    unmathed,
    write_figures,
)
from studies.core.paper import paper_envelopes
from studies.core.study_options import FORMATS

CURVE_PIXELS = 300  # a curve across half a figure colours at least this many
VECTOR_MOST = 1_000_000  # bytes
PANELS = {"path", "along", "across", "tau1", "tau2", "difference", "v"}


@pytest.fixture(scope="module")
def cases() -> list[Case]:
    return made_up_cases()


@pytest.fixture(scope="module")
def written(cases: list[Case], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A case's figure in all formats."""
    folder = tmp_path_factory.mktemp("run")
    write_figures(folder, [("line", case_figure(cases[0]))])
    return folder / "figures"


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


def test_a_png_is_as_wide_as_two_columns_and_shows_both_plants(written: Path) -> None:
    path = written / "line.png"
    assert imread(path).shape[1] == int(DOUBLE / INCH * DPI)
    for plant in ("assumed-modes", "chain"):
        assert pixels(path, STYLES[plant]["color"]) > CURVE_PIXELS, plant


def test_text_is_text_in_an_svg(written: Path) -> None:
    text = (written / "line.svg").read_text()
    shown = re.findall(r"<text[^>]*>([^<]+)</text>", text)
    assert {"time [s]", "v [mm]", "(g) tip deflection", "chain"} <= set(shown)
    width = re.search(r'<svg[^>]* width="([\d.]+)pt"', text)
    assert width and float(width[1]) == pytest.approx(72 * DOUBLE / INCH, abs=0.01)
    assert len(text) < VECTOR_MOST and "<dc:date>" not in text


def test_text_is_text_in_a_pdf(written: Path) -> None:
    """TrueType fonts, and strings that are shown; no outlines as Type 3 has them."""
    content = (written / "line.pdf").read_bytes()
    assert b"/FontFile2" in content and b"/Type3" not in content and b"/CreationDate" not in content
    streams = re.findall(rb"stream\r?\n(.*?)\r?\nendstream", content, re.DOTALL)
    drawn = b""
    for each in streams:
        try:
            drawn += zlib.decompress(each)
        except zlib.error:
            continue
    assert drawn.count(b" Tj") + drawn.count(b"] TJ") > 50
    box = re.search(rb"/MediaBox \[ 0 0 ([\d.]+) ", content)
    assert box and float(box[1]) == pytest.approx(72 * DOUBLE / INCH, abs=0.01)
    assert len(content) < VECTOR_MOST


def test_captions_lie_beside(written: Path, cases: list[Case]) -> None:
    assert {path.name for path in written.iterdir()} == {
        *(f"line.{each}" for each in FORMATS),
        CAPTIONS,
    }
    text = (written / CAPTIONS).read_text()
    assert text.startswith("# Captions\n\n**line** Trajectory line; controllers tuned fractional")


def test_a_caption_is_no_markup(tmp_path: Path) -> None:
    hostile = "[x](y) <b> $a$ _b_ `c`\n# d"
    figure, panels = canvas(height=30, width=SINGLE)
    panels[0, 0].set_title(unmathed(hostile))
    write_figures(tmp_path, [("a", finish(figure, panels.flat, caption=hostile))], ("png", "svg"))
    text = (tmp_path / "figures" / CAPTIONS).read_text()
    assert r"\[x\](y) \<b\> \$a\$ \_b\_ \`c\` \# d" in text
    assert "&lt;b&gt; $a$" in (tmp_path / "figures" / "a.svg").read_text()


def test_a_legend_of_long_names_stays_in_the_figure() -> None:
    """In fewer columns than were asked for; short ones have them all."""
    for length, columns in ((60, 1), (3, 2)):
        figure, panels = canvas(height=60, width=DOUBLE)
        for letter in "abcd":
            panels[0, 0].plot([0, 1], [0, 1], label=letter * length)
        finish(figure, panels.flat, legend=2)
        figure.draw_without_rendering()
        (legend,) = figure.legends
        box = legend.get_window_extent()
        assert box.x0 >= 0 and box.x1 <= figure.bbox.width
        assert legend._ncols == columns  # type: ignore[attr-defined]


def test_units_have_their_powers_raised() -> None:
    assert raised("N m2") == "N m²" and raised("kg m2/s10") == "kg m²/s¹⁰"
    assert raised("10 mm") == "10 mm" and raised("") == ""


def test_no_figures_leave_no_folder(tmp_path: Path) -> None:
    write_figures(tmp_path, [])
    assert list(tmp_path.iterdir()) == []


def test_case_figures_can_be_printed(cases: list[Case]) -> None:
    for case in cases:
        assert faults(case_figure(case)) == []


def test_rules_find_what_they_are_for() -> None:
    """Another width, small letters, an unexplained marker, a log axis that cannot be read."""
    figure, panels = canvas(height=30, width=100)
    axes = panels[0, 0]
    axes.plot([2.1, 2.9], [1, 1], "*")
    axes.set_xscale("log")
    axes.set_xticks([2.0], labels=["2"])
    axes.set_xticks([], minor=True)
    axes.set_title("small", fontsize=5)
    axes.text(0.5, 0.5, "one", transform=axes.transAxes)
    axes.text(0.5, 0.5, "two", transform=axes.transAxes)
    figure.text(0.99, 0.5, "cut off here")
    found = "\n".join(faults(figure))
    for words in (
        "is 100 mm wide",
        "has no caption",
        "'small' has 5 pt",
        "marker '*' is not explained",
        "a logarithmic axis has",
        "'one' overlaps 'two'",
        "'cut off here' is cut off",
    ):
        assert words in found, words


@pytest.mark.parametrize(
    "ends", [(1.2, 1.9), (4.0, 60.0), (0.9, 1.1), (1e-9, 3.0), (2e-5, 7e-4), (3.0, 3000.0)]
)
def test_logarithmic_axes_can_be_read(ends: tuple[float, float]) -> None:
    figure, panels = canvas(2, 1, height=80, width=SINGLE)
    for axes in panels.flat:
        axes.plot(ends, ends)
        for axis in (axes.xaxis, axes.yaxis):
            log_axis(axis)
    assert faults(finish(figure, panels.flat, caption="Both.")) == []


def test_case_figure_holds_the_motions(cases: list[Case]) -> None:
    figure = case_figure(cases[0])
    axes = {a.get_label(): a for a in figure.axes}
    assert set(axes) == PANELS
    chain = cases[0].motions["chain"]
    apart = 1000 * (chain.tip - chain.reference_tip)
    along = apart @ np.array([-1.0, 1.0]) / np.sqrt(2)  # of the line from (0.7, 0.2) to (0.3, 0.6)
    for name, wanted in (
        ("v", 1000 * chain.v),
        ("tau1", chain.torque[:, 0]),
        ("tau2", chain.torque[:, 1]),
        ("along", along),
        ("across", apart @ np.array([-1.0, -1.0]) / np.sqrt(2)),
    ):
        lines = [line for line in axes[name].lines if line.get_color() == STYLES["chain"]["color"]]
        assert lines[0].get_ydata() == pytest.approx(wanted, abs=1e-6), name
    other = cases[0].motions["assumed-modes"]
    lines = {line.get_label(): line for line in axes["difference"].lines}
    found = lines["difference along path"].get_ydata()
    assert found == pytest.approx(
        1000 * (chain.tip - other.tip) @ np.array([-1.0, 1.0]) / np.sqrt(2), abs=1e-6
    )
    broad = [line for line in axes["path"].lines if line.get_label() == "reference"]
    assert np.array_equal(broad[0].get_xydata(), chain.reference_tip)
    assert axes["path"].get_aspect() == 1.0
    assert all("[" in each.get_ylabel() for each in axes.values())
    caption = figure.get_label()
    assert all(word in caption for word in ("line", "tuned fractional PIDs", "opposing", "ideal"))


def test_a_small_difference_has_its_own_unit(cases: list[Case]) -> None:
    chain = cases[0].motions["chain"]
    near = replace(chain, tip=chain.tip + 1e-6, plant="assumed-modes")
    case = replace(cases[0], motions={"assumed-modes": near, "chain": chain})
    axes = {a.get_label(): a for a in case_figure(case).axes}
    assert axes["difference"].get_ylabel() == "tips apart [µm]"


def test_limits_are_shown_where_they_are_near(cases: list[Case]) -> None:
    def dotted(limit: float) -> list[float]:
        case = replace(cases[0], torque_limit=(limit, 100.0))
        axes = {a.get_label(): a for a in case_figure(case).axes}
        assert not [line for line in axes["tau2"].lines if line.get_linestyle() == ":"]
        lines = [line for line in axes["tau1"].lines if line.get_linestyle() == ":"]
        return [float(line.get_ydata()[0]) for line in lines]

    assert dotted(1.2) == [-1.2, 1.2] and dotted(10.0) == []


def test_case_figure_marks_divergence(cases: list[Case]) -> None:
    figure = case_figure(cases[1])
    axes = {a.get_label(): a for a in figure.axes}
    marks = [line for line in axes["along"].lines if line.get_marker() == "X"]
    assert [float(line.get_xdata()[0]) for line in marks] == [pytest.approx((DIVERGED - 1) * STEP)]
    assert axes["along"].get_xlim()[1] == pytest.approx((SAMPLES - 1) * STEP)
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "chain, diverged at 1.800 s" in labels and "assumed modes" in labels
    assert "end of a run that diverged" in labels


def test_reference_is_whole_when_all_diverge(cases: list[Case]) -> None:
    whole = reference(Trajectory("line"), Parameters(), STEP)
    lost = {"chain": cases[1].motions["chain"]}
    figure = case_figure(replace(cases[1], motions=lost, reference=whole))
    (path,) = (a for a in figure.axes if a.get_label() == "path")
    broad = [line for line in path.lines if line.get_label() == "reference"]
    assert np.array_equal(broad[0].get_xydata(), whole.tip)


def test_summary_shows_rows_and_paper() -> None:
    figure = summary_figure(summary_rows())
    (axes,) = figure.axes
    values = {round(float(x), 9) for line in axes.lines for x in np.atleast_1d(line.get_xdata())}
    assert values == {4.0, 5.0, 34.0, 16.0, 53.0, 33.0, 42.0}
    assert axes.get_xscale() == "log" and axes.get_xlabel().endswith("[mm]")
    assert [text.get_text() for text in axes.texts] == ["chain diverged"]
    assert len(axes.get_yticks()) == 2
    assert faults(figure) == []


def test_an_interval_that_is_unknown_is_not_drawn() -> None:
    """Neither as one of no width; an end that is unknown is no end."""
    drawn = []
    for ends in ((None, None), (1.0, None), (1.0, 4.0)):
        _, panels = canvas(height=30)
        interval(panels[0, 0], 2.0, 0.0, ends, "o", color="k")
        axes = panels[0, 0]
        bars = [each.get_segments()[0][:, 0].tolist() for each in axes.collections]
        lines = [np.atleast_1d(line.get_xdata()).tolist() for line in axes.lines]
        drawn.append((bars, sorted(lines)))
    assert drawn[0] == ([], [[2.0]])
    assert drawn[1] == ([], [[1.0, 2.0], [2.0]])
    assert drawn[2] == ([[1.0, 4.0]], [[2.0]])


def test_two_plants_of_a_kind_look_different() -> None:
    looks = styles(["chain:6", "chain:10", "assumed-modes", "rod"])
    assert len({(each["color"], str(each["linestyle"])) for each in looks.values()}) == 4
    assert looks["assumed-modes"] == STYLES["assumed-modes"]


def test_thin_curves_keep_their_ends() -> None:
    x = np.arange(100_000.0)
    y = np.sin(x / 300)
    y[12_345], y[54_321] = 9.0, -9.0
    few_x, few_y = thinned(x, y, bins=100)
    assert len(few_x) <= 202 and {9.0, -9.0} <= set(few_y)
    assert (few_x[0], few_x[-1]) == (0.0, 99_999.0) and (np.diff(few_x) > 0).all()
    assert np.array_equal(thinned(x[:200], y[:200], bins=100)[1], y[:200])


def test_paper_envelopes_are_table_3() -> None:
    assert paper_envelopes("line", "paper-line") == (0.016, 0.053)
    assert paper_envelopes("two_loop", "paper_two_loop") == (0.014, 0.021)
    assert paper_envelopes("circle", "tuned") == (0.006, 0.018)
    assert paper_envelopes("line", "paper two-loop".replace(" ", "-")) == (0.033, 0.042)
    assert paper_envelopes("spiral", "tuned") is None


def test_nothing_global_is_touched(tmp_path: Path) -> None:
    before = dict(matplotlib.rcParams)
    save(summary_figure(summary_rows()), tmp_path / "a.png")
    assert dict(matplotlib.rcParams) == before


def test_what_is_set_outside_changes_nothing(tmp_path: Path) -> None:
    row = summary_rows()
    save(summary_figure(row), tmp_path / "a.svg")
    with matplotlib.rc_context({"font.size": 30, "svg.fonttype": "path", "axes.grid": False}):
        save(summary_figure(row), tmp_path / "b.svg")
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()


def test_same_case_same_bytes(cases: list[Case], written: Path, tmp_path: Path) -> None:
    write_figures(tmp_path, [("line", case_figure(cases[0]))])
    for each in FORMATS:
        again = (tmp_path / "figures" / f"line.{each}").read_bytes()
        assert again == (written / f"line.{each}").read_bytes(), each


def test_errors_say_what_to_do(cases: list[Case], tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="nothing to summarise"):
        summary_figure([])
    with pytest.raises(RunError, match="cannot write the figure"):
        save(summary_figure(summary_rows()), tmp_path / "missing" / "line.png")
    assert not list(tmp_path.iterdir())
