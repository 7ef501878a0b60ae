"""How a recording looks when it is opened: a tab per case, the map beside the plots, an overview.

    >>> layout([Beside("", plans)])                        # one recording
    >>> layout([Beside("one", plans), Beside("two", other)])       # two, side by side

The layout is stored in the recording itself, so that `rerun RUN/run.rrd` opens already arranged.
"""

from __future__ import annotations

import math
import uuid
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import rerun.blueprint as rrb
from rerun import SeriesLines
from rerun.blueprint.encodings import ComponentSourceKind, VisualizerComponentMapping
from rerun.components import Plane3D

from flexsim.errors import ParameterError
from flexsim.recording.colours import BACKGROUND
from flexsim.recording.drawn.states import KEY
from flexsim.recording.panels import Page, Panel, Plan, Series
from flexsim.recording.rerun_file import fix_ids
from flexsim.recording.traces import TIMELINE

CAMERA, SOLIDS = "top", "solids"  # of the scene, see `flexsim.recording.scene`
WORDS, GLASSES = "words", ("about_reference", "about_first")  # of it, too
GRID_SPACING = 0.1  # [m]
EYE = np.array([0.03, -0.47, 0.54])  # of the eye from the centre, in spans of the scene
OVERVIEW = "overview"
NARROW_PLOTS = 2  # above each other, where recordings stand side by side
SHARES: dict[type, float] = {rrb.StateTimelineView: 1.3}  # of the height, where plots have 1
ABOUT = (("robot", "parameters"), ("run", "run"))  # texts that a recording has once


class Named(NamedTuple):
    """A part of a recording under the name by which its like in another is found."""

    key: str
    part: Any


@dataclass(frozen=True)
class Beside:
    """One recording among those that are laid out: where its entities are, and its cases.

    Attributes:
        root: path of its entities, '' for the recording's own root. plans: of its cases.
        title: as a heading names it. pages: what else it has to show.
    """

    root: str
    plans: Sequence[Plan] = ()
    title: str = ""
    pages: Sequence[Page] = ()

    def path(self, entity: str) -> str:
        """Return the path of an entity."""
        return f"/{self.root}/{entity}" if self.root else f"/{entity}"


def _without(scene: str, *parts: str) -> list[str]:
    """Return a query for a scene with some of its parts left out."""
    return [f"{scene}/**", *(f"- {scene}/{part}/**" for part in parts)]


def top_view(of: Beside, plan: Plan, small: bool = False) -> rrb.Spatial2DView:
    """Return the map of a case: the scene as its camera sees it; y upwards.

    Texts have one size however small the map is: on a small one the title says what they do.
    """
    scene = of.path(f"{plan.name}/scene")
    if small:
        return _map(scene, _without(scene, WORDS), plan.short, plan.bounds)
    return _map(scene, _without(scene), plan.title, plan.bounds)


def _map(
    scene: str, contents: list[str], title: str, bounds: tuple[float, float, float, float]
) -> rrb.Spatial2DView:
    """Return a view of a scene from above."""
    x0, x1, y0, y1 = bounds
    return rrb.Spatial2DView(
        origin=f"{scene}/{CAMERA}",
        contents=contents,
        name=title,
        background=list(BACKGROUND),
        visual_bounds=rrb.VisualBounds2D(x_range=(x0, x1), y_range=(-y1, -y0)),
    )


def space_view(of: Beside, plan: Plan) -> rrb.Spatial3DView:
    """Return the same arms and paths in space, to be turned; words and glasses are the map's."""
    x0, x1, y0, y1 = plan.within
    centre = np.array([(x0 + x1) / 2, (y0 + y1) / 2, 0.0])
    span = math.hypot(x1 - x0, y1 - y0)
    scene = of.path(f"{plan.name}/scene")
    eye = rrb.EyeControls3D(
        kind=rrb.Eye3DKind.Orbital,
        position=centre + span * EYE,
        look_target=centre,
        eye_up=(0.0, 0.0, 1.0),
    )
    return rrb.Spatial3DView(
        origin=scene,
        contents=[
            *_without(scene, CAMERA, WORDS, *GLASSES),
            f"+ {of.path(plan.name)}/{SOLIDS}/**",
        ],
        name="in space (drag to turn)",
        background=list(BACKGROUND),
        line_grid=rrb.LineGrid3D(
            spacing=GRID_SPACING,
            plane=Plane3D.XY.with_distance(-0.05),
            color=[255, 255, 255, 20],
        ),
        eye_controls=eye,
    )


def _visualizer(series: Series) -> rrb.Visualizer:
    """Return how one curve is drawn from its component."""
    source = VisualizerComponentMapping(
        "Scalars:scalars",
        ComponentSourceKind.SourceComponent,
        source_component=series.component,
        selector=f".{series.field}",
    )
    lines = SeriesLines(colors=[series.colour], names=[series.name], widths=[series.width])
    return lines.visualizer(mappings=[source])


def plot(of: Beside, plan: Plan, panel: Panel) -> rrb.TimeSeriesView:
    """Return one plot: title with the key, explicit range; all share the time that is seen."""
    drawn: dict[Any, list[rrb.Visualizer]] = {}
    for series in panel.series:
        path = of.path(f"{plan.name}/{series.entity}")
        drawn.setdefault(path, []).append(_visualizer(series))
    return rrb.TimeSeriesView(
        origin=of.path(plan.name),
        contents=list(drawn),
        overrides=dict(drawn),
        name=panel.title,
        axis_x=rrb.TimeAxis(link="LinkToGlobal"),
        axis_y=rrb.ScalarAxis(range=(panel.low, panel.high)),
        plot_legend=rrb.PlotLegend(visible=False),  # it would cover curves: the title has the key
    )


def _plots(of: Beside, plan: Plan, narrow: bool = False) -> rrb.Container:
    """Return the plots of a case, a tab for each kind; its states below its joints' plots."""
    tabs: dict[str, list[rrb.View]] = {}
    for panel in plan.panels:
        tabs.setdefault(panel.tab, []).append(plot(of, plan, panel))
    if plan.states:
        lanes = rrb.StateTimelineView(origin=of.path(f"{plan.name}/states"), name=f"joints · {KEY}")
        tabs.setdefault("joints", []).append(lanes)
    if not tabs:
        return rrb.Vertical(*_texts(of, plan))
    columns = [
        rrb.Vertical(*views, name=title, row_shares=[SHARES.get(type(v), 1.0) for v in views])
        for name, every in tabs.items()
        for title, views in _stacks(name, every, NARROW_PLOTS if narrow else len(every))
    ]
    return columns[0] if len(columns) == 1 else rrb.Tabs(*columns)


def _stacks(
    name: str, views: Sequence[rrb.View], most: int
) -> Iterator[tuple[str, Sequence[rrb.View]]]:
    """Give the views of a tab in stacks of so many at most: lower ones have no room for labels."""
    for i, start in enumerate(range(0, len(views), most)):
        yield (f"{name} {i + 1}" if i else name), views[start : start + most]


def _texts(of: Beside, plan: Plan) -> list[rrb.View]:
    """Return the texts about a case."""
    texts = [("about this case", f"{plan.name}/notes")] * plan.notes
    return [
        rrb.TextDocumentView(origin=of.path(entity), name=name)
        for name, entity in (*texts, *plan.texts)
    ]


def _tab(of: Beside, plan: Plan, narrow: bool = False) -> rrb.Container:
    """Return what is shown of one case: its map and plots, beside or above each other."""
    if not plan.scene:
        plots, texts = _plots(of, plan), rrb.Tabs(*_texts(of, plan))
        if narrow:
            return rrb.Vertical(plots, texts, row_shares=[7, 3], name=of.title or plan.name)
        return rrb.Horizontal(plots, texts, column_shares=[7, 3], name=plan.name)
    if narrow:
        views = rrb.Tabs(top_view(of, plan, small=True), *_texts(of, plan), space_view(of, plan))
        parts = (views, _plots(of, plan, narrow))
        return rrb.Vertical(*parts, row_shares=[4, 7], name=of.title or plan.name)
    below = rrb.Tabs(*_texts(of, plan), space_view(of, plan))
    left = rrb.Vertical(top_view(of, plan), below, row_shares=[7, 3])
    return rrb.Horizontal(left, _plots(of, plan), column_shares=[50, 50], name=plan.name)


def _overview(of: Beside) -> rrb.Container:
    """Return the maps of all cases, too small for words and glasses, over one table."""
    maps = []
    for plan in of.plans:
        scene = of.path(f"{plan.name}/scene")
        maps.append(_map(scene, _without(scene, WORDS, *GLASSES), plan.name, plan.within))
    columns = min(4, math.ceil(math.sqrt(len(maps))))
    text = rrb.TextDocumentView(origin=of.path(OVERVIEW), name="all cases")
    grid = rrb.Grid(*maps, grid_columns=columns)
    return rrb.Vertical(grid, text, row_shares=[6, 4], name=OVERVIEW)


def _page(of: Beside, page: Page) -> rrb.View:
    """Return the view of an image or a text."""
    kind = rrb.Spatial2DView if page.image else rrb.TextDocumentView
    return kind(origin=of.path(page.entity), name=page.title)


def _alone(of: Beside) -> list[rrb.Container | rrb.View]:
    """Return the tabs of one recording."""
    tabs: list[rrb.Container | rrb.View] = [_tab(of, plan) for plan in of.plans]
    if all(plan.scene for plan in of.plans) and of.plans:
        about = [rrb.TextDocumentView(origin=of.path(entity), name=n) for n, entity in ABOUT]
        tabs = [*([_overview(of)] if len(tabs) > 1 else []), *tabs, *about]
    return [*tabs, *(_page(of, page) for page in of.pages)]


def _paired(every: Sequence[Sequence[Named]]) -> list[list[tuple[int, Named]]]:
    """Return rows of what stands side by side: parts of several owners that have the same name.

    Where none has, the first stands beside the first.

    Returns:
        Per row the owners' numbers and their parts.
    """
    by_name = [{each.key: each for each in parts} for parts in every]
    names = list(dict.fromkeys(name for parts in by_name for name in parts))
    if any(sum(name in parts for parts in by_name) > 1 for name in names):
        return [[(i, p[name]) for i, p in enumerate(by_name) if name in p] for name in names]
    most = max((len(parts) for parts in every), default=0)
    return [[(i, parts[k]) for i, parts in enumerate(every) if k < len(parts)] for k in range(most)]


def _together(every: Sequence[Beside]) -> list[rrb.Container | rrb.View]:
    """Return a tab for each case and page, what every recording has of it side by side."""
    tabs: list[rrb.Container | rrb.View] = []
    for row in _paired([[Named(plan.name, plan) for plan in of.plans] for of in every]):
        parts = [_tab(every[i], each.part, narrow=True) for i, each in row]
        name = " | ".join(dict.fromkeys(each.key for _, each in row))
        tabs.append(rrb.Horizontal(*(rrb.Tabs(part) for part in parts), name=name))
    for row in _paired([[Named(page.title, page) for page in of.pages] for of in every]):
        views = [_page(every[i], each.part) for i, each in row]
        for view, (i, each) in zip(views, row, strict=True):
            view.name = f"{every[i].title}: {each.key}"
        name = " | ".join(dict.fromkeys(each.key for _, each in row))
        tabs.append(rrb.Horizontal(*views, name=name))
    return tabs


def arranged(
    root: rrb.Container, timeline: str = TIMELINE, playing: bool = True, name: str = "blueprint"
) -> rrb.Blueprint:
    """Return a blueprint of a root, panels folded, its ids the same each time."""
    fix_ids(root, uuid.uuid5(uuid.NAMESPACE_URL, f"flexsim:{name}"))
    state: dict[str, Any] = {"loop_mode": "all", "play_state": "playing"} if playing else {}
    return rrb.Blueprint(
        root,
        rrb.TopPanel(state="collapsed"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=timeline, **state),
        auto_views=False,
    )


def layout(
    every: Sequence[Beside], more: Iterable[rrb.Container | rrb.View] = (), shown: str = ""
) -> rrb.Blueprint:
    """Return the blueprint of one recording, or of several side by side.

    Args:
        every: at least one. more: tabs after those of the cases. shown: name of the tab on top,
            the first unless given.

    Raises:
        ParameterError: there is no tab of that name.
    """
    full = [of for of in every if of.plans or of.pages]
    tabs: list[rrb.Container | rrb.View] = []
    if full:
        tabs = _alone(full[0]) if len(full) == 1 else _together(full)
    tabs += more
    names = [str(tab.name) for tab in tabs]
    if shown and shown not in names:
        raise ParameterError(f"there is no tab {shown!r}; choose one of {', '.join(names)}")
    timeline = next((plan.timeline for of in full for plan in of.plans), TIMELINE)
    root = rrb.Tabs(*tabs, active_tab=names.index(shown) if shown else 0)
    return arranged(root, timeline, playing=timeline == TIMELINE)
