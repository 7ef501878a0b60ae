"""What can be seen of recordings, in headless renders: axes have ticks, arms stand where they are.

One viewer without a window, drawn by software, shows every arrangement that we make. A view is
looked at when all of the recording is loaded and the view has nothing to complain of.
"""

from __future__ import annotations

import io
import socket
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rerun_cli
from PIL import Image
from programs import missing
from recorded_cases import CHAIN_MJCF, made_up_cases
from rerun.experimental import ViewerClient

from flexsim import Parameters
from flexsim.loop.friction import Friction
from flexsim.recording import rrd
from flexsim.recording.case import Case
from flexsim.recording.colours import BACKGROUND, COLOURS, DIFFERENCE, FAINT, dimmed
from flexsim.recording.curves import columns
from flexsim.recording.drawn.arms import elbow
from flexsim.recording.drawn.map import GRID, sheet_of
from flexsim.recording.joined import Content, Part, write_joined
from flexsim.recording.panels import Page, Plan
from flexsim.recording.rrd import plan_of, write_recording
from flexsim.recording.scene import HOLLOW
from flexsim.recording.tuning.convergence import BEST, MEDIAN, Course, write_convergence
from flexsim.recording.tuning.live import LiveTuning, across
from studies.watch.recording import RecordingFile
from studies.watch.save import answered

VIEWER = Path(rerun_cli.__file__).parent / "rerun"
RENDERERS = ("/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d")
PATIENCE = 60.0  # [s] for a viewer on a busy machine
DRAWN = 0.3  # [s] for what is there to be drawn
NOW = 1.2  # [s] at which is looked
PIXEL = 1.0  # by which what is drawn may be off, beside half a line's width
CLOSE = 60  # of a colour, summed over its channels
LABEL = 110  # brightness of a tick's label and more


@dataclass
class Screen:
    """A viewer, and what it shows."""

    client: ViewerClient

    def show(self, *paths: Path) -> None:
        """Open files and wait until all is there and drawn."""
        self.client.close("all")
        self.client.open([str(path) for path in paths])
        self.settle()

    def settle(self, recordings: int = 1) -> None:
        """Wait until so many recordings are there and drawn, and stop at NOW."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            state = self.client.get_state()
            wrong = [view.reports for view in state.views if view.visible and view.reports]
            ready = len(state.recordings) >= recordings and state.views and not state.loading
            if ready and not wrong:
                break
            time.sleep(0.05)
        else:
            pytest.fail(f"not shown: {state.loading} {wrong}")
        if any(t.name == "simulation_time" for r in state.recordings for t in r.timelines):
            self.client.set_time("simulation_time", duration=NOW, play_state="paused")
        time.sleep(DRAWN)

    def views(self, *kinds: str) -> dict[str, np.ndarray]:
        """Return what is seen of the views of some kinds, (H, W, 3), by their names."""
        found = {}
        for view in self.client.get_state().views:
            if view.view_class in kinds:
                try:
                    png = self.client.take_screenshot(view.view_id)
                except (ConnectionError, RuntimeError) as error:  # in a tab that is not open
                    assert "not found" in str(error)
                    continue
                found[view.name] = np.array(Image.open(io.BytesIO(png)).convert("RGB"), int)
        return found


@pytest.fixture(scope="module")
def screen() -> Iterator[Screen]:
    if not any(list(Path(each).glob("lvp_icd*")) for each in RENDERERS):
        missing("there is no renderer (mesa-vulkan-drivers)")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    how = {"headless": True, "hide_welcome_screen": True, "executable_path": str(VIEWER)}
    with ViewerClient.spawn(port=port, **how) as client:
        yield Screen(client)
        client.quit()


@pytest.fixture(scope="module")
def case() -> Case:
    return replace(made_up_cases()[0], friction=Friction("simulink"))


@pytest.fixture(scope="module")
def recording(case: Case, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("seen") / "run.rrd"
    write_recording(path, [case], {"seed": "1"}, Parameters())
    return path


def written(plan: Plan, case: Case, folder: Path) -> Path:
    """Return a recording of a case that is laid out by another plan."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rrd, "plan_of", lambda *_: plan)
        write_recording(folder / "planned.rrd", [case], {}, Parameters())
    return folder / "planned.rrd"


def of_colour(image: np.ndarray, rgb: Any) -> np.ndarray:
    """Return where a picture has a colour, (H, W)."""
    return np.abs(image - np.array(rgb)).sum(axis=2) < CLOSE


def blocks(lit: np.ndarray) -> int:
    """Return the number of separate runs of what is lit, (n,)."""
    return int(np.count_nonzero(np.diff(np.concatenate([[0], lit.astype(int)])) == 1))


def require_ticks(name: str, image: np.ndarray) -> None:
    """Require two labels or more on both axes: numbers left of the plot, times below it."""
    text = (image.min(axis=2) > LABEL) & (np.ptp(image, axis=2) < 25)  # curves have colours
    height = image.shape[0]
    lit = (image.sum(axis=2) > image[0, 0].sum() + 6)[: height - 26].mean(axis=0)
    left = text[: height - 24, : int(np.flatnonzero(lit > 0.9)[0])]  # of the plot's own edge
    assert blocks(left.any(axis=1)) >= 2, f"{name}: labels of the y-axis"
    below = text[height - 20 :].any(axis=0)
    gaps = np.convolve(below, np.ones(9), "same") > 0  # letters of one label are one
    assert blocks(gaps) >= 2, f"{name}: labels of the time axis"


@dataclass
class Scale:
    """Where a map has points: pixels from metres, by the lines of its grid."""

    x: np.ndarray
    y: np.ndarray

    @classmethod
    def of(cls, image: np.ndarray, corners: np.ndarray) -> Scale:
        """Return the scale of a map, whose grid covers corners (2, 2) [m]."""
        low, high = sum(BACKGROUND) + 12, sum(dimmed(FAINT, 0.6)) + 12
        line = (image.sum(axis=2) > low) & (image.sum(axis=2) < high) & (np.ptp(image, axis=2) < 12)
        found = []
        for axis in (0, 1):
            share = line.mean(axis=axis)
            at = np.flatnonzero(share > 0.6 * share.max())
            groups = np.split(at, np.flatnonzero(np.diff(at) > 2) + 1)
            steps = round((corners[1, axis] - corners[0, axis]) / GRID)
            lines = groups[-steps - 1 :] if axis == 0 else groups[: steps + 1]  # no labels' edges
            centres = np.array([each.mean() for each in lines])
            assert len(centres) == steps + 1, "lines of the grid"
            assert np.ptp(np.diff(centres)) < 2, "lines of the grid"
            metres = corners[0, axis] + GRID * np.arange(steps + 1)
            found.append(np.polyfit(metres, centres if axis == 0 else centres[::-1], 1))
        assert found[0][0] == pytest.approx(-found[1][0], rel=0.01)  # one scale, y upwards
        return cls(*found)

    def pixels(self, points: np.ndarray) -> np.ndarray:
        """Return points (..., 2) [m] in pixels, right and down."""
        return np.stack(
            [np.polyval(self.x, points[..., 0]), np.polyval(self.y, points[..., 1])], -1
        )


def drawn_arms(case: Case, t: float) -> dict[str, np.ndarray]:
    """Return points (n, 2) [m] along both arms' links and hubs, of hollow ones along the edges."""
    found = {}
    for i, (plant, motion) in enumerate(case.motions.items()):
        k = int(np.searchsorted(motion.time, t + 1e-9)) - 1
        k -= k % 2  # poses are at 50 Hz
        corners = [np.zeros(2), elbow(motion, Parameters())[k], motion.beam[k, 0]]
        points = []
        for start, end in pairwise(corners):
            along = start + np.linspace(0.02, 0.98, 60)[:, None] * (end - start)
            normal = np.array([-(end - start)[1], (end - start)[0]]) / np.linalg.norm(end - start)
            sides = (1, -1) if HOLLOW[i] else (0,)
            points += [along + side * HOLLOW[i] / 2 * normal for side in sides]
        found[plant] = np.concatenate(points)
    return found


def test_both_arms_are_where_they_are(screen: Screen, recording: Path, case: Case) -> None:
    """To a pixel of the map's own axes; and not where they were a second before."""
    screen.show(recording)
    (image,) = screen.views("2D").values()
    scale = Scale.of(image, sheet_of(case, Parameters()).corners)
    for plant, rgb in (("chain", COLOURS["chain"]), ("assumed-modes", COLOURS["assumed-modes"])):
        lit = np.argwhere(of_colour(image, rgb))[:, ::-1]

        def away(t: float, plant: str = plant, lit: np.ndarray = lit) -> np.ndarray:
            wanted = scale.pixels(drawn_arms(case, t)[plant])
            return np.linalg.norm(wanted[:, None] - lit[None], axis=2).min(axis=1)

        assert np.quantile(away(NOW), 0.9) <= PIXEL + 0.5, plant
        assert np.quantile(away(NOW - 1.0), 0.9) > 3, plant


@pytest.mark.parametrize("tab", ["tracking", "joints", "errors", "beam"])
def test_every_plot_has_ticks_and_curves(
    screen: Screen, case: Case, tab: str, tmp_path: Path
) -> None:
    own = plan_of(case, sheet_of(case, Parameters()), columns(case))
    chosen = tuple(each for each in own.panels if each.tab == tab)
    screen.show(written(replace(own, panels=chosen, states=tab == "joints"), case, tmp_path))
    seen = screen.views("TimeSeries")
    assert set(seen) == {panel.title for panel in chosen}
    for panel in chosen:
        image = seen[panel.title]
        require_ticks(panel.title, image)
        for series in panel.series:
            lit = of_colour(image, series.colour)
            constant = panel.tab == "errors"  # made up without any
            assert constant or lit.any(axis=1).sum() > 8, f"{panel.title}: {series.name}"
    if tab == "joints":
        (lanes,) = screen.views("StateTimeline").values()
        assert of_colour(lanes, (204, 121, 167)).any() or of_colour(lanes, (120, 124, 130)).any()


def test_the_difference_is_seen(screen: Screen, recording: Path) -> None:
    screen.show(recording)
    (image,) = (v for k, v in screen.views("TimeSeries").items() if k.startswith("tips, chain"))
    distance = of_colour(image, DIFFERENCE[2])
    rows = np.flatnonzero(distance.any(axis=1))
    assert np.ptp(rows) > 0.3 * image.shape[0]
    assert distance.any(axis=0).mean() > 0.5  # all along


def test_cases_beside_each_other_and_all_at_once(
    screen: Screen, recording: Path, tmp_path: Path
) -> None:
    both = tmp_path / "both.rrd"
    write_joined(both, [Part("one", "one", recording), Part("two", "two", recording)])
    screen.show(both)
    state = screen.client.get_state()
    maps = [view.origin for view in state.views if view.view_class == "2D"]
    assert sorted(maps) == ["/one/line_tuned/scene/top", "/two/line_tuned/scene/top"]
    orange = [
        of_colour(image, COLOURS["assumed-modes"]).sum() for image in screen.views("2D").values()
    ]
    assert all(count > 50 for count in orange)
    for name, image in screen.views("TimeSeries").items():
        require_ticks(name, image)


def test_all_cases_are_seen_at_once(screen: Screen, tmp_path: Path) -> None:
    """The first tab: a map of each, both arms in motion, over one table."""
    cases = made_up_cases()
    write_recording(tmp_path / "run.rrd", cases, {}, Parameters())
    screen.show(tmp_path / "run.rrd")
    seen = screen.views("2D", "TextDocument")
    for each in cases:
        for plant in each.motions:
            assert of_colour(seen[each.name], COLOURS[plant]).sum() > 30, (each.name, plant)
    assert (seen["all cases"].min(axis=2) > LABEL).sum() > 500


def test_figures_and_tables_are_pages(screen: Screen, tmp_path: Path) -> None:
    image = io.BytesIO()
    Image.new("RGB", (60, 40), (213, 94, 0)).save(image, "png")
    pages = [Content(Page("a figure", "pages/a", image=True), image.getvalue())]
    write_joined(tmp_path / "pages.rrd", [Part("", "run", None, pages)])
    screen.show(tmp_path / "pages.rrd")
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:  # an image is unpacked beside the drawing
        if of_colour(screen.views("2D")["a figure"], (213, 94, 0)).mean() > 0.2:
            break
    else:
        pytest.fail("the figure is not seen")
    words = [Content(Page("tables", "pages/t"), "| head |\n|---|\n| cell |")]
    write_joined(tmp_path / "words.rrd", [Part("", "run", None, words)])
    screen.show(tmp_path / "words.rrd")
    assert (screen.views("TextDocument")["tables"].min(axis=2) > LABEL).sum() > 20


def test_a_tuning_has_ticks_and_curves(screen: Screen, tmp_path: Path) -> None:
    best = np.array([np.inf, 3e-3, 2e-3, 4e-4, 3e-4, 3e-4])
    write_convergence(tmp_path / "c.rrd", "index (5)", best, 2 * best, np.linspace(0, 1, 6), {})
    screen.show(tmp_path / "c.rrd")
    seen = screen.views("TimeSeries")
    assert len(seen) == 3
    for name, image in seen.items():
        require_ticks(name, image)
        assert of_colour(image, (86, 180, 233)).any() or "share" in name


def test_a_tuning_while_it_runs(screen: Screen, case: Case) -> None:
    """Its course, and the best individual's motion; a better one is a recording of its own."""
    screen.client.close("all")
    alone = replace(case, motions={"assumed-modes": case.motions["assumed-modes"]})
    live = LiveTuning(screen.client.url, "index (5)", 4, Parameters())
    best = np.array([3e-3, 2e-3])
    for count in (1, 2):
        course = Course("index (5)", best[:count], 2 * best[:count], np.ones(count))
        live.show(course, alone)
    screen.settle(recordings=2)
    seen = screen.views("2D", "TimeSeries")
    plots = {name: image for name, image in seen.items() if name.startswith("tip ")}
    assert len(plots) == 2
    for name, image in plots.items():
        require_ticks(name, image)
        assert of_colour(image, COLOURS["assumed-modes"]).any()
    chart = next(image for name, image in seen.items() if name.startswith("index (5), log10"))
    assert of_colour(chart, BEST).any() and of_colour(chart, MEDIAN).any()
    (map_,) = (image for name, image in seen.items() if name.startswith("the best individual"))
    assert of_colour(map_, COLOURS["assumed-modes"]).sum() > 50


def test_generations_count_from_one_to_the_chart_s_end() -> None:
    assert list(across(np.arange(1, 6), 5)) == [0.0, 0.25, 0.5, 0.75, 1.0]
    assert across(1, 1) == 0.0


def test_a_watched_file(screen: Screen, tmp_path: Path) -> None:
    save = answered(CHAIN_MJCF)
    RecordingFile(tmp_path / "watch.rrd").show([save])
    screen.show(tmp_path / "watch.rrd")
    seen = screen.views("2D", "TimeSeries")
    plots = {name: image for name, image in seen.items() if "[" in name and "save" not in name}
    assert len(plots) >= 4
    for name, image in plots.items():
        require_ticks(name, image)
    map_ = next(image for name, image in seen.items() if name.startswith("open loop"))
    for plant in ("assumed-modes", "chain"):
        assert of_colour(map_, COLOURS[plant]).sum() > 50


def test_a_plot_without_labels_would_be_noticed(screen: Screen, case: Case, tmp_path: Path) -> None:
    """Negative control: an axis that just holds its curves may have one label, or none."""
    own = plan_of(case, sheet_of(case, Parameters()), columns(case))
    narrow = replace(own.panels[0], low=0.5, high=19.5)
    screen.show(written(replace(own, panels=(narrow, *own.panels[1:4])), case, tmp_path))
    with pytest.raises(AssertionError, match="labels of the y-axis"):
        require_ticks(narrow.title, screen.views("TimeSeries")[narrow.title])
