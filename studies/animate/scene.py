"""Two arms over their reference, their difference magnified, and their errors, at any time.

>>> scene = Scene(arms, tip, time)                   # doctest: +SKIP
>>> scene.show(1.25)                                 # [s]
>>> image = scene.pixels()                           # (rows, columns, 3)
"""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.lines import Line2D

from flexsim.loop.motion import Motion
from flexsim.numerics.types import Array
from studies.core.figures import drawn, finish, sheet, thinned, unmathed
from studies.core.printed.ticks import MINUS

MM = 1e3  # per metre
WIDTH, HEIGHT = 140.0, 88.0  # [mm]
DPI = 150  # of an animation: 826 pixels wide
STEPS = (1, 2, 3, 4, 5, 6, 8)  # factors of the difference are these, times a power of ten
TITLE_MOST = 26  # letters of a line above the difference
LEAST = 1e-9  # [mm] a difference that nothing magnifies
ROOM = 1.15  # of the largest difference: half the width of its panel
REFERENCE: dict[str, Any] = {"color": "0.8", "linewidth": 4.0}


@dataclass(frozen=True, eq=False)
class Arm:
    """A motion and how it is drawn; joint 2 at `elbow` (K, 2) [m]; link 1 as it bends, if so."""

    name: str
    motion: Motion
    elbow: Array
    look: dict[str, Any]

    def row(self, time: float) -> int:
        """Return the sample at a time [s], the last one if it ended before."""
        found = int(np.searchsorted(self.motion.time, time + 1e-9, side="right")) - 1
        return min(max(found, 0), len(self.motion.time) - 1)

    def link(self, k: int) -> Array:
        """Return points (P, 2) along link 1 at a sample [m]."""
        if self.motion.link1 is not None:
            return self.motion.link1[k]
        return np.stack([np.zeros(2), self.elbow[k]])

    @property
    def error(self) -> Array:
        """Distance of the tip from the reference at the same time (K,) [mm]."""
        apart = self.motion.tip - self.motion.reference_tip
        return MM * np.hypot(apart[:, 0], apart[:, 1])


class Scene:
    """A figure of arms that is redrawn for any time, what does not move only once.

    Attributes:
        figure: as it is. factor: by which the difference is magnified, against the arms; 0 if
            there is one arm.
    """

    @drawn
    def __init__(self, arms: Sequence[Arm], reference: Array, end: float, words: str = ""):
        self.arms = arms
        self.figure = sheet(HEIGHT, WIDTH)
        self.figure.set_dpi(DPI)
        self._canvas: Any = FigureCanvasAgg(self.figure)
        grid = self.figure.add_gridspec(1, 2, width_ratios=[1.1, 1])
        right = grid[1].subgridspec(2, 1, height_ratios=[1.2, 1])
        self.plan = self.figure.add_subplot(grid[0], label="plan")
        self.errors = self.figure.add_subplot(right[1], label="error")
        self.zoom: Axes | None = None
        if len(arms) == 2:
            self.zoom = self.figure.add_subplot(right[0], label="difference")
        self._moving: list[tuple[Axes, Any]] = []
        self.factor = 0.0
        self._draw_plan(reference)
        self._draw_errors(end)
        panels = [self.plan, self.errors]
        finish(self.figure, panels, legend=4, caption=words)
        if self.zoom is not None:
            self._draw_difference(self.zoom)
        self.figure.draw_without_rendering()
        self.figure.set_layout_engine("none")
        if self.zoom is not None:
            self._magnify(self.zoom)
        self._background: Any = None

    def _add(self, axes: Axes, **how: Any) -> Line2D:
        """Return a line that moves."""
        (line,) = axes.plot([], [], **how)
        self._moving.append((axes, line))
        return line

    def _draw_plan(self, reference: Array) -> None:
        """Draw the reference, and what there will be of arms and of their tips' paths."""
        axes = self.plan
        axes.plot(*reference.T, **REFERENCE, label="reference")
        axes.plot(0, 0, "s", color="0.3", markersize=7, label="joint 1")
        self._trails = [self._add(axes, **{**arm.look, "alpha": 0.6}) for arm in self.arms]
        self._links, self._beams = [], []
        for arm in self.arms:
            thick = 2.0 * arm.look["linewidth"]
            how = {"color": arm.look["color"], "solid_capstyle": "round"}
            self._links.append(self._add(axes, **how, linewidth=thick + 1.6))
            beam = {"marker": "o", "markevery": [-1], "markersize": 4.0 + thick / 2, "lw": thick}
            self._beams.append(self._add(axes, **how, **beam, label=unmathed(arm.name)))
        every = np.concatenate(
            [[[0.0, 0.0]], reference, *(np.r_[a.elbow, a.motion.tip] for a in self.arms)]
        )
        (left, low), (far, high) = every.min(axis=0) - 0.04, every.max(axis=0) + 0.04
        axes.set(xlim=(left, far), ylim=(low, high), xlabel="x [m]", ylabel="y [m]")
        axes.set_aspect("equal", adjustable="box")
        self._clock = axes.set_title("t = 0.00 s", loc="left")
        self._clock.set_animated(True)

    def _draw_errors(self, end: float) -> None:
        """Draw the frame of the errors over time."""
        most = max(float(arm.error.max(initial=0.0)) for arm in self.arms)
        axes = self.errors
        axes.set(xlim=(0, end), ylim=(0, 1.08 * most or 1.0))
        axes.set(xlabel="time [s]", ylabel="tip error [mm]")
        self._curves = [self._add(axes, **arm.look) for arm in self.arms]

    def _draw_difference(self, axes: Axes) -> None:
        """Draw the frame of the difference."""
        rows = min(len(arm.motion.time) for arm in self.arms)
        one, other = (arm.motion.tip[:rows] for arm in self.arms)
        self._difference = MM * (other - one)
        axes.set(xlabel="x [mm]", ylabel="y [mm]")
        axes.set_title(self._title(), loc="left")
        first, second = (arm.look for arm in self.arms)
        axes.plot(0, 0, "o", color=first["color"], markersize=8)
        self._apart = self._add(axes, color=second["color"], linewidth=0.8)
        self._arrow = self._add(axes, color="0.2", linewidth=1.2)
        self._point = self._add(axes, color=second["color"], marker="o", markersize=6)

    def _title(self) -> str:
        one, other = (arm.name for arm in self.arms)
        lines = textwrap.wrap(f"{other} {MINUS} {one},", TITLE_MOST)
        return "\n".join([*map(unmathed, lines), f"{self.factor:g} times larger"])

    def _magnify(self, axes: Axes) -> None:
        """Give the difference a round factor, the largest that fits, once the layout stands."""
        self.figure.draw_without_rendering()
        plan = self.plan.get_window_extent().width / np.ptp(self.plan.get_xlim())  # [px/m]
        box = axes.get_window_extent()
        most = ROOM * max(float(np.abs(self._difference).max(initial=0.0)), LEAST)
        self.factor = round_down(MM * min(box.width, box.height) / (2 * most) / plan)
        wide, high = (MM * each / (2 * self.factor * plan) for each in (box.width, box.height))
        axes.set(xlim=(-wide, wide), ylim=(-high, high))
        axes.set_title(self._title(), loc="left")

    def show(self, time: float) -> None:
        """Let all that moves stand where it is at a time [s]."""
        parts = zip(self.arms, self._links, self._beams, self._trails, self._curves, strict=True)
        for arm, link, beam, trail, curve in parts:
            k = arm.row(time)
            link.set_data(*arm.link(k).T)
            beam.set_data(*np.concatenate([arm.elbow[k : k + 1], arm.motion.beam[k]]).T)
            trail.set_data(*arm.motion.tip[: k + 1].T)
            curve.set_data(*thinned(arm.motion.time[: k + 1], arm.error[: k + 1]))
        self._clock.set_text(f"t = {time:.2f} s")
        if self.zoom is not None:
            k = min(max(arm.row(time) for arm in self.arms), len(self._difference) - 1)
            self._apart.set_data(*self._difference[: k + 1].T)
            x, y = self._difference[k]
            self._arrow.set_data([0, x], [0, y])
            self._point.set_data([x], [y])

    @drawn
    def pixels(self) -> Any:
        """Return the picture as it is now (rows, columns, 3), what does not move drawn once."""
        if self._background is None:
            for _, line in self._moving:
                line.set_animated(True)
            self._canvas.draw()
            self._background = self._canvas.copy_from_bbox(self.figure.bbox)
        self._canvas.restore_region(self._background)
        for axes, line in self._moving:
            axes.draw_artist(line)
        self.plan.draw_artist(self._clock)
        return np.asarray(self._canvas.buffer_rgba())[..., :3].copy()

    def still(self) -> None:
        """Let the figure be drawn whole, as for a file."""
        self._clock.set_animated(False)
        for _, line in self._moving:
            line.set_animated(False)


def round_down(number: float) -> float:
    """Return the largest of `STEPS` times a power of ten that is no more than a number."""
    power = 10.0 ** np.floor(np.log10(number))
    return float(max(step * power for step in STEPS if step * power <= number * (1 + 1e-12)))
