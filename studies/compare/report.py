"""What `flexsim compare` shows: its folder of figures and recording, and its tables."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table

from flexsim.recording.case import Case
from flexsim.recording.rrd import write_recording
from flexsim.recording.traces import spoken
from flexsim.robot import Robot
from studies.core.figures import case_figure, summary_figure
from studies.core.folder import versions, write_config, write_rows


@dataclass(frozen=True, eq=False)
class Comparison:
    """Rows for the table, two per case, cases for figures, the robot; MJCF texts by file name."""

    rows: list[dict[str, Any]]
    cases: list[Case]
    robot: Robot
    mjcf: dict[str, str]


def write_report(folder: Path, config: Any, result: Comparison) -> None:
    """Write configuration, MJCF, table, figures and recording into a folder."""
    write_config(folder, config, cases=[case.name for case in result.cases])
    for name, text in result.mjcf.items():
        (folder / name).write_text(text)
    write_rows(folder / "results.csv", result.rows)
    (folder / "figures").mkdir()
    for case in result.cases:
        case_figure(case, folder / "figures" / f"{case.name}.png")
    shown = [row for row in result.rows if row["group"] != "true tip"]
    summary_figure(shown, folder / "figures" / "envelopes.png")
    about = {name.replace("-", "_"): text for name, text in versions().items()}
    about |= {"seed": str(config.seed), "control_period": f"{config.period} s"}
    write_recording(folder / "run.rrd", result.cases, about, result.robot.parameters)


def _mm(value: float | None, digits: int = 1) -> str:
    """Return a length in mm, without decimals from 100 on."""
    if value is None:
        return "-"
    return f"{1e3 * value:.{digits if abs(value) < 0.1 else 0}f}"


def table(rows: list[dict[str, Any]], title: str) -> Table:
    """Return a table in the manner of Table 3, in mm; the paper's columns beside ours."""
    grid = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1))
    grid.add_column("trajectory", no_wrap=True)
    for heading in ("envelope", "paper sim | lab", "rms error", "max |v|"):
        grid.add_column(heading, justify="right", no_wrap=True)
    for modes, chain in zip(rows[::2], rows[1::2], strict=True):
        pairs = [
            f"{_mm(modes[name])} | {_mm(chain[name])}"
            for name in ("envelope", "rms_error", "max_v")
        ]
        paper = f"{_mm(modes['paper_simulation'])} | {_mm(modes['paper_laboratory'])}"
        devised = modes["controllers"].rsplit(" ", 1)[1]
        own = modes["trajectory"] == devised
        name = modes["trajectory"] if own else f"{modes['trajectory']} by {devised}"
        grid.add_row(name, pairs[0], paper, *pairs[1:])
        for row in (modes, chain):
            if row["diverged"]:
                grid.add_row(f"  {100 * row['diverged_share']:.0f} % diverged, {row['plant']}")
    return grid


def true_tip_table(rows: list[dict[str, Any]]) -> Table:
    """Return envelopes by kind of reference, and what the dead zone of joint 2 hides, in mm."""
    title = "References for the true tip: envelope half-width, and its share of the first"
    grid = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1))
    grid.add_column("trajectory, setting; reference", no_wrap=True)
    for heading in ("envelope", "share", "dead zone"):
        grid.add_column(heading, justify="right", no_wrap=True)
    cases: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for row in rows:
        cases.setdefault((row["trajectory"], row["setting"]), []).append(row)
    for case, mine in cases.items():
        plain, *others = (mine[k : k + 2] for k in range(0, len(mine), 2))  # a pair per reference
        grid.add_row(", ".join(case), "", "", _mm(plain[0]["dead_zone_error"]))
        for pair in (plain, *others):
            width = " | ".join(_mm(row["envelope"], 2) for row in pair)
            share = "" if pair is plain else _shares(pair, plain)
            grid.add_row(f"  {pair[0]['reference']}", width, share, "")
    return grid


def _shares(pair: list[dict[str, Any]], plain: list[dict[str, Any]]) -> str:
    """Return the envelopes of two plants as shares of those on plain references."""
    return " | ".join(
        "-" if None in (a["envelope"], b["envelope"]) else f"{a['envelope'] / b['envelope']:.2f}"
        for a, b in zip(pair, plain, strict=True)
    )


def verdict(rows: list[dict[str, Any]]) -> str:
    """Return in words whether the controllers hold and the plants agree, for one setting's rows."""
    held = sum(not row["diverged"] for row in rows)
    ratios = [
        chain["envelope"] / modes["envelope"]
        for modes, chain in zip(rows[::2], rows[1::2], strict=True)
        if chain["envelope"] and modes["envelope"]
    ]
    spread = f"{min(ratios):.2f} to {max(ratios):.2f} times" if ratios else "an unknown multiple of"
    one, other = (spoken(row["plant"]) for row in rows[:2])
    return f"{held} of {len(rows)} hold; envelopes of the {other} are {spread} those of the {one}."


def print_report(result: Comparison, out: Path) -> None:
    """Print a table for our controllers and one for Table 2's, each with its verdict."""
    console = Console(highlight=False)
    plants = " | ".join(spoken(row["plant"]) for row in result.rows[:2])
    console.print(f"In mm: {plants}\n")
    for group, name in (("ours", "Our controllers"), ("Table 2", "The paper's Table 2")):
        mine = [row for row in result.rows if row["group"] == group]
        title = f"{name}, setting {mine[0]['setting']}: envelope half-width, errors, v"
        console.print(table(mine, title))
        console.print(f" {verdict(mine)}\n")
    shaped = [row for row in result.rows if row["group"] == "true tip"]
    if shaped:
        console.print(true_tip_table(shaped))
    console.print(
        "Medians over runs whose gains differ in their fourth digits; quartiles in results.csv.\n"
        f"{out}: results.csv, figures/, run.rrd (flexsim view {out})",
        soft_wrap=True,
    )
