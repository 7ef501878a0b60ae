"""The arena's figures: scores with their intervals, profiles, fronts of error against effort."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from studies.arena.conditions import CORE, NOMINAL
from studies.arena.contestants import CLASSES
from studies.arena.rows import ArenaResult
from studies.arena.showing.classes import class_rows
from studies.core.figures import COLOURS, DASHES, canvas, drawn, finish, log_axis


def figures(result: ArenaResult) -> Iterator[tuple[str, Figure]]:
    """Give scores with their intervals, and fronts of error against effort."""
    yield "scores", scores_figure(result)
    yield "profiles", profiles_figure(result)
    if any(row.condition == "search" for row in result.fronts):
        yield "fronts", fronts_figure(result)


@drawn
def scores_figure(result: ArenaResult) -> Figure:
    """Return every class's score on every plant, as it was tuned."""
    classes = [row.contestant for row in class_rows(result)]
    figure, panels = canvas(1, 1, height=30 + 6 * len(classes))
    axes = panels[0, 0]
    count = len(result.plants)
    for k, plant in enumerate(result.plants):
        rows = {
            row.contestant: row
            for row in result.scores
            if row.plant == plant
            and row.condition == NOMINAL
            and row.tuning == CORE
            and row.reference == CLASSES[row.contestant].aid
        }
        its = [(i, rows[name]) for i, name in enumerate(classes) if name in rows]
        places = np.array([i + (k - (count - 1) / 2) * 0.8 / count for i, _ in its])
        values = np.array([[row.score, row.low, row.high] for _, row in its]).T
        ends = np.abs(values[1:] - values[0])
        how = {"color": COLOURS[k % len(COLOURS)], "fmt": "os^vD"[k % 5], "markersize": 2.5}
        axes.errorbar(values[0], places, xerr=ends, linewidth=1.0, label=plant, **how)
    axes.set_yticks(range(len(classes)), classes)
    axes.invert_yaxis()
    axes.set(xlabel="decades of the index (5) below an arm that stands still")
    axes.set_xlim(0.0, 1.03 * axes.get_xlim()[1])
    caption = (
        "Classes tuned alike on the first plant, and run on all: interquartile means over seeds "
        "and trajectories, 95 % intervals. A run that diverged scores 0."
    )
    return finish(figure, panels.ravel(), legend=4, caption=caption)


def _look(k: int) -> dict[str, Any]:
    """Return how the k-th of many lines is drawn."""
    dash = DASHES[k // len(COLOURS) % len(DASHES)]
    return {"color": COLOURS[k % len(COLOURS)], "linestyle": dash}


@drawn
def profiles_figure(result: ArenaResult) -> Figure:
    """Return performance profiles, a panel for the plant of the tuning and one for a chain."""
    chain = next((each for each in result.plants if "chain" in each), result.plants[0])
    plants = list(dict.fromkeys((result.plants[0], chain)))
    figure, panels = canvas(1, len(plants), height=80, sharey=True)
    for k, row in enumerate(class_rows(result)):
        for j, plant in enumerate(plants):
            its = [
                (each.level, each.share)
                for each in result.profiles
                if (each.contestant, each.plant) == (row.contestant, plant)
            ]
            if its:
                levels, shares = np.array(its).T
                panels[0, j].plot(levels, shares, label=row.contestant, **_look(k))
    for j, plant in enumerate(plants):
        panels[0, j].set(title=plant, xlabel="score [decades]", ylim=(0.0, 1.0))
        panels[0, j].margins(x=0)
    panels[0, 0].set(ylabel="share of runs that score more")
    caption = (
        "Performance profiles of classes as they were tuned. Scores are decades of the index (5) "
        "below that of an arm that stands still."
    )
    return finish(figure, panels.ravel(), legend=4, caption=caption)


@drawn
def fronts_figure(result: ArenaResult) -> Figure:
    """Return the index against effort of what searches tried, a line a class."""
    figure, panels = canvas(1, 1, height=100)
    axes = panels[0, 0]
    rows = [row for row in result.fronts if row.condition == "search"]
    for k, name in enumerate(dict.fromkeys(row.contestant for row in rows)):
        its = sorted((row.effort, row.index) for row in rows if row.contestant == name)
        efforts, indices = np.array(its).T
        axes.plot(efforts, 1e4 * indices, drawstyle="steps-post", label=name, **_look(k))
    axes.set(xscale="log", yscale="log", xlabel="effort over that of PIDs that ignore v")
    axes.set(ylabel="index (5) [1e-4 m\u00b2 s]")
    log_axis(axes.xaxis)
    log_axis(axes.yaxis)
    caption = (
        "Fronts of error against effort: what no other individual of its class's searches "
        "dominates. Effort is the largest of total variation and rms of either torque."
    )
    return finish(figure, panels.ravel(), legend=4, caption=caption)
