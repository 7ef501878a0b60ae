"""How a recording looks when it is opened: one tab per case, both arms beside their curves.

The layout is stored in the recording itself, so that `rerun RUN/run.rrd` opens already arranged.
"""

from __future__ import annotations

import uuid
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import rerun.blueprint as rrb
from numpy.typing import NDArray
from rerun.components import Plane3D

from flexsim.recording.rerun_file import fix_ids
from flexsim.recording.traces import TIMELINE, panels

if TYPE_CHECKING:
    from flexsim.recording.case import Case
FLOOR = -0.05  # height of the grid below the plane of motion [m]; display only
GRID_SPACING = 0.1  # [m]
EYE = np.array([0.04, -0.46, 0.86])  # of the eye from the centre, in spans of the scene
SCENE_TITLE = "orange: assumed modes · blue: MuJoCo chain · dashed: reference · grid 0.1 m"
CROWDED = ("torque", "joint", "modal")  # a legend would hide the curves; their titles explain
BANDED = ("tip_error", "v")  # so it would where all runs are shown, too
BAND_TITLE = " · dark: ends of all runs"


def _eye(corners: NDArray[np.float64]) -> rrb.EyeControls3D:
    """Return an eye above the arm, a little to its front, that has corners (2, 3) [m] in sight."""
    centre = corners.mean(axis=0)
    span = float(np.linalg.norm(corners[1] - corners[0]))
    return rrb.EyeControls3D(
        kind=rrb.Eye3DKind.Orbital,
        position=centre + span * EYE,
        look_target=centre,
        eye_up=(0.0, 0.0, 1.0),
    )


def _scene(case: Case, corners: NDArray[np.float64]) -> rrb.Spatial3DView:
    """Return the view of both arms over the reference."""
    return rrb.Spatial3DView(
        origin=f"/{case.name}/scene",
        name=SCENE_TITLE,
        background=[24, 26, 30],
        line_grid=rrb.LineGrid3D(
            spacing=GRID_SPACING,
            plane=Plane3D.XY.with_distance(FLOOR),
            color=[255, 255, 255, 28],
        ),
        eye_controls=_eye(corners),
    )


def _plot(case: Case, panel: str, title: str) -> rrb.TimeSeriesView:
    """Return one plot; all of them share the time axis."""
    banded = bool(case.bands) and panel in BANDED
    return rrb.TimeSeriesView(
        origin=f"/{case.name}/{panel}",
        name=title + BAND_TITLE * banded,
        axis_x=rrb.TimeAxis(link="LinkToGlobal"),
        plot_legend=rrb.PlotLegend(
            rrb.Corner2D.RightTop, visible=panel not in CROWDED and not banded
        ),
    )


def _tab(case: Case, corners: NDArray[np.float64]) -> rrb.Horizontal:
    """Return the tab of one case."""
    texts = rrb.Tabs(
        rrb.TextDocumentView(origin=f"/{case.name}/notes", name="about this case"),
        rrb.TextDocumentView(origin="/parameters", name="robot"),
        rrb.TextDocumentView(origin="/run", name="run"),
    )
    left = rrb.Vertical(_scene(case, corners), texts, row_shares=[7, 3])
    plots = rrb.Grid(
        *(_plot(case, panel, title) for panel, title in panels(case.motions).items()),
        grid_columns=2,
    )
    return rrb.Horizontal(left, plots, column_shares=[46, 54], name=case.name)


def layout(cases: Sequence[Case], corners: Sequence[NDArray[np.float64]]) -> rrb.Blueprint:
    """Return the blueprint of a whole recording.

    Args:
        cases: at least one.
        corners: per case (2, 3), lowest and highest corner of what moves [m].
    """
    root = rrb.Tabs(*(_tab(case, corner) for case, corner in zip(cases, corners, strict=True)))
    fix_ids(root, uuid.uuid5(uuid.NAMESPACE_URL, "flexsim:blueprint"))
    return rrb.Blueprint(
        root,
        rrb.TopPanel(state="collapsed"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=TIMELINE, loop_mode="all", play_state="playing"),
        auto_views=False,
    )
