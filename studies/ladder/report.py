"""The ladder in words, tables and figures, and its Pareto fronts.

>>> cost_figure(result, run / "cost_accuracy.png")      # doctest: +SKIP
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator
from rich import box
from rich.console import Console
from rich.table import Table

from flexsim.recording.traces import kind
from studies.core.figures import DPI, FONT, OTHER_STYLE, STYLES, finish, save
from studies.core.folder import write_rows

if TYPE_CHECKING:
    from studies.ladder.ladder import LadderResult

Rows = Sequence[Mapping[str, Any]]

FILES = ("rows.csv", "integrators.csv")
TARGETS = (1e-3, 1e-4, 1e-5)  # [m] of the verdict
MICRO = 1e6
ROUNDING = 1e-9  # of damping ratios, from differences of the one-step map
SAFE = 0.95  # of an integrator's limit: longer steps are none to take
SIZE = (16.0, 8.5)  # [in]
IN_MUJOCO = ("chain", "untuned", "rod")  # kinds of plants
MARKERS = {"rigid": "D", "assumed-modes": "o", "printed": "X", "chain": "s", "untuned": "^"}
CROWDED = ("7", "9", "11", "13", "14", "15")  # segments whose number would cover another
COLOURS = {"RK4": "#0072B2", "Euler": "#D55E00", "implicitfast": "#E69F00", "discrete": "#009E73"}


def front(costs: Sequence[float], errors: Sequence[float]) -> list[bool]:
    """Return which rows no other beats: none is as cheap and as near, and better in one."""
    pairs = list(zip(costs, errors, strict=True))
    return [
        math.isfinite(error)
        and not any(c <= cost and e <= error and (c, e) != (cost, error) for c, e in pairs)
        for cost, error in pairs
    ]


def mark_fronts(
    rows: list[dict[str, Any]], uncertainty: Mapping[str, float]
) -> list[dict[str, Any]]:
    """Return the rows with `pareto_` of each torque; errors count down to the uncertainty [m]."""
    costs, marks = [row["us_per_ms"] for row in rows], {}
    for torque, doubt in uncertainty.items():
        marks[torque] = front(costs, [max(row[f"tip_{torque}"], doubt) for row in rows])
    return [
        row | {f"pareto_{torque}": mark[i] for torque, mark in marks.items()}
        for i, row in enumerate(rows)
    ]


def _micrometres(value: float | None, doubt: float = 0.0) -> str:
    """Return a length in micrometres, two digits; what is below its doubt as that."""
    if value is None or not math.isfinite(value):
        return "ran away"
    if value < doubt:
        return f"< {MICRO * doubt:.2g}"
    return f"{MICRO * value:{'.2g' if MICRO * value < 10 else '.0f'}}"


def _grid(*headings: str) -> Table:
    """Return an empty table, names to the left, figures to the right."""
    grid = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    grid.add_column("", no_wrap=True)
    for heading in headings:
        grid.add_column(heading, justify="right", no_wrap=True)
    return grid


def frequency_table(result: LadderResult) -> Table:
    """Return the frequencies of every rung below those of the beam."""
    grid = _grid("clamped 1", "2", "3", "free 1", "2", "3")
    ref = result.reference
    grid.add_row("reference", *_hertz(ref.clamped_hz), *_hertz(ref.joint_free_hz), end_section=True)
    for row in result.rows:
        grid.add_row(row["plant"], *_hertz(row["clamped_hz"]), *_hertz(row["joint_free_hz"]))
    return grid


def _hertz(values: Iterable[float]) -> Iterator[str]:
    return (f"{value:.3f}" if math.isfinite(value) else "" for value in values)


def rung_table(result: LadderResult) -> Table:
    """Return tips, envelope and cost of every rung; a star marks those on a Pareto front."""
    grid = _grid("step", "small", "large", "envelope", "(shaken)", "cost")
    grid.add_row("", "ms", "um rms ", "um rms ", "mm", "mm", "us/ms", end_section=True)
    doubt = result.reference.uncertainty
    for row in result.rows:
        tips = [
            _micrometres(row[f"tip_{torque}"], doubt[torque])
            + ("*" if row[f"pareto_{torque}"] else " ")
            for torque in doubt
        ]
        lost = row["envelope"] is None
        envelope = f"lost, {row['diverged_at']:.2f} s" if lost else f"{1e3 * row['envelope']:.1f}"
        ends = [row[f"envelope_{end}"] for end in ("low", "high")]
        spread = "" if None in ends else " - ".join(f"{1e3 * end:.1f}" for end in ends)
        step, cost = f"{1e3 * row['step']:g}", f"{row['us_per_ms']:.3g}"
        grid.add_row(row["plant"], step, *tips, envelope, spread, cost)
    return grid


def integrator_table(rows: Rows) -> Table:
    """Return what each integrator and step does: mode 3, energy, tips, cost."""
    grid = _grid("step", "f3 shift", "zeta3", "energy", "small", "large", "us/ms")
    for row in rows:
        cells = [row["integrator"], f"{1e3 * row['step']:g}"]
        if row["stable"]:
            figures = row["frequency_shift"][-1], row["damping_ratio"][-1], row["energy_drift"]
            damping = f"{figures[1]:.1e}" if abs(figures[1]) > ROUNDING else "0"
            cells += [f"{figures[0]:+.1e}", damping, f"{figures[2]:.1e}"]
            cells += [_micrometres(row[f"tip_{torque}"]) for torque in ("small", "large")]
            cells += [f"{row['us_per_ms']:.1f}"]
        else:
            cells += ["unstable"]
        grid.add_row(*cells, end_section=row["step"] == rows[-1]["step"])
    return grid


def cheapest(rows: Rows, torque: str, target: float) -> Mapping[str, Any] | None:
    """Return the cheapest row whose tip is within a target [m] under a torque, None if none is."""
    good = [row for row in rows if row[f"tip_{torque}"] is not None]
    good = [row for row in good if row[f"tip_{torque}"] <= target]
    return min(good, key=lambda row: row["us_per_ms"], default=None)


def _spoken(row: Mapping[str, Any] | None) -> str:
    if row is None:
        return "none"
    name = row.get("plant") or f"{row['integrator']} at {1e3 * row['step']:g} ms"
    return f"{name} ({row['us_per_ms']:.2g} us)"


def verdict(result: LadderResult) -> str:
    """Return in words which rung is the cheapest for which accuracy, and which step."""
    in_mujoco = [row for row in result.rows if kind(row["plant"]) in IN_MUJOCO]
    steps = [row for row in result.integrators if row["step"] <= SAFE * (row["longest_step"] or 1)]
    lines = []
    for torque, doubt in result.reference.uncertainty.items():
        lines.append(
            f"Cheapest under {torque} torques (steps: up to {SAFE} of the limit), tip within"
        )
        for target in TARGETS:
            label = f"  {1e3 * target:g} mm: "
            if target < doubt:
                lines.append(f"{label}the reference does not tell")
                continue
            every = (cheapest(some, torque, target) for some in (result.rows, in_mujoco, steps))
            lines.append(label + "{}; in MuJoCo {}; steps: {}".format(*map(_spoken, every)))
    lines.append(_envelopes(result.rows))
    return "\n".join(lines)


def _envelopes(rows: Rows) -> str:
    """Return how far the envelopes tell the rungs apart."""
    if not (held := [row for row in rows if row["envelope"] is not None]):
        return "Closed loop: lost on every rung."
    widths = [1e3 * row["envelope"] for row in held]
    shaken = max(1e3 * (row["envelope_high"] - row["envelope_low"]) for row in held)
    ends = f"from {min(widths):.1f} to {max(widths):.1f} mm"
    digits = f"a change of the gains' fourth digits moves one by up to {shaken:.1f} mm"
    return f"Closed loop: envelopes {ends} over the rungs; {digits}."


def print_report(out: Console, result: LadderResult) -> None:
    """Print tables and verdict."""
    ref = result.reference
    out.print("Frequencies (Hz), hub locked and both joints free")
    out.print(frequency_table(result))
    out.print("Tip in open loop, small and large torques (*: Pareto front); envelope of one")
    out.print("controller, also with its gains' fourth digits changed; cost on one core")
    out.print(rung_table(result))
    doubts = ", ".join(f"{MICRO * v:.2g} um ({name})" for name, v in ref.uncertainty.items())
    out.print(f"Reference: {ref.name}; its own uncertainty {doubts}\n", soft_wrap=True)
    out.print("What mj_step does to the chain, by step (ms): to mode 3, to the energy of free")
    out.print("motion, to the tip (um rms, against RK4 at a very short step); cost of mj_step")
    out.print(integrator_table(result.integrators))
    out.print(verdict(result), soft_wrap=True)


def flat(row: Mapping[str, Any]) -> dict[str, Any]:
    """Return a row with arrays spread over columns, for CSV."""
    cells: dict[str, Any] = {}
    for name, value in row.items():
        if isinstance(value, np.ndarray):
            cells |= {f"{name}_{i}": each for i, each in enumerate(value.tolist(), 1)}
        else:
            cells[name] = value
    return cells


def write_report(folder: Path, result: LadderResult) -> None:
    """Write tables and figures into a folder."""
    for name, rows in zip(FILES, (result.rows, result.integrators), strict=True):
        write_rows(folder / name, [flat(row) for row in rows])
    (folder / "figures").mkdir()
    cost_figure(result, folder / "figures/cost_accuracy.png")
    integrator_figure(result.integrators, folder / "figures/integrators.png")


def cost_figure(result: LadderResult, path: Path) -> None:
    """Write the tips' errors over the cost, small and large torques, with their Pareto fronts.

    A PNG already there is replaced.

    Raises:
        RunError: the file cannot be written.
    """
    figure = Figure(figsize=SIZE, dpi=DPI, layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    for axes, (torque, doubt) in zip(panels, result.reference.uncertainty.items(), strict=True):
        best = sorted(
            (row["us_per_ms"], max(row[f"tip_{torque}"], doubt))
            for row in result.rows
            if row[f"pareto_{torque}"]
        )
        axes.plot(*zip(*best, strict=True), color="0.8", linewidth=9, label="Pareto front")
        for name in dict.fromkeys(kind(row["plant"]) for row in result.rows):
            _series(axes, [row for row in result.rows if kind(row["plant"]) == name], torque)
        axes.axhspan(0, doubt, color="0.93")
        axes.set(xscale="log", yscale="log", title=f"{torque} torques; n or N beside the marks")
        axes.set_xlabel("us per simulated ms, closed loop, one core")
    panels[0].set_ylabel("tip, rms distance to the reference [m]")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=7, fontsize=FONT)
    finish(figure, panels)
    save(figure, path)


def _series(axes: Axes, rows: Rows, torque: str) -> None:
    """Draw the plants of one kind, each with its size."""
    name = kind(rows[0]["plant"])
    colour = STYLES.get(name, OTHER_STYLE)["color"]
    held = [row for row in rows if math.isfinite(row[f"tip_{torque}"])]
    points = [(row["us_per_ms"], row[f"tip_{torque}"]) for row in held]
    style = {"color": colour, "linewidth": 1, "markersize": 8}
    axes.plot(*np.transpose(points), marker=MARKERS.get(name, "P"), label=name, **style)
    for row, point in zip(held, points, strict=True):
        size = row["plant"].partition(":")[2]
        if size not in CROWDED or name not in ("chain", "untuned"):
            left = name == "chain" or row["plant"] == "assumed-modes:3"
            place = {"xytext": (-8, -5), "ha": "right"} if left else {"xytext": (5, 6)}
            style = {"color": colour, "size": FONT - 2, "textcoords": "offset points"}
            axes.annotate(size or name, point, **style, **place)


def integrator_figure(rows: Rows, path: Path) -> None:
    """Write the tip's error and mode 3's numerical damping over the step, by integrator.

    A PNG already there is replaced.

    Raises:
        RunError: the file cannot be written.
    """
    figure = Figure(figsize=SIZE, dpi=DPI, layout="constrained")
    panels = figure.subplots(1, 3, sharex=True)
    titles = (
        "tip, large torques, rms [m]",
        "mode 3, |frequency shift|",
        "mode 3, |added damping ratio|",
    )
    for name, colour in COLOURS.items():
        mine = [row for row in rows if row["integrator"] == name and row["stable"]]
        steps = [1e3 * row["step"] for row in mine]
        damping = [abs(row["damping_ratio"][-1]) for row in mine]
        columns = (
            [row["tip_large"] for row in mine],
            [abs(row["frequency_shift"][-1]) for row in mine],
            [each if each > ROUNDING else np.nan for each in damping],
        )
        broad = {"linewidth": 5, "markersize": 12} if name == "Euler" else {"linewidth": 1.6}
        for axes, values in zip(panels, columns, strict=True):
            axes.plot(steps, values, "o-", color=colour, label=name, **broad)
    for axes, title in zip(panels, titles, strict=True):
        axes.set(xscale="log", yscale="log", title=title, xlabel="step [ms]")
        axes.set_xticks(list(dict.fromkeys(1e3 * row["step"] for row in rows)))
        axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
        axes.xaxis.set_minor_locator(NullLocator())
    panels[2].set_ylim(bottom=1e-10)
    note = {"transform": panels[2].transAxes, "ha": "right", "size": FONT}
    panels[2].text(0.97, 0.04, f"not drawn: below {ROUNDING:g}", **note)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=FONT)
    finish(figure, panels)
    save(figure, path)
