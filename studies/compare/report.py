"""What `flexsim compare` shows: its tables and words, its figures, its recording."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from flexsim.loop.beyond import beyond
from flexsim.recording.rrd import write_recording
from flexsim.recording.traces import MM, spoken
from studies.compare.figures import case_figure, summary_figure
from studies.compare.rows import CompareRow, Comparison, TrueTipRow
from studies.core.folder import origin, versions
from studies.core.table import Column, Table, value

OURS, TABLE_2, TRUE_TIP = "ours", "Table 2", "true tip"  # groups of cases
TITLES = {OURS: "Our controllers", TABLE_2: "The paper's Table 2"}
MEDIANS = "Medians over runs whose gains differ in their fourth digits; quartiles in results.csv."
EFFORT = (
    "Commanded torques: rms of each, total variation of both [N m]; growth of v in the hold [1/s]"
)
COARSE = 0.1  # [m] from which on no decimals are shown


def _mm(length: float | None, digits: int = 1) -> str:
    """Return a length in mm, without decimals from 100 on."""
    if length is None:
        return "-"
    return f"{MM * length:.{digits if abs(length) < COARSE else 0}f}"


def _length(key: str, heading: str | None = None, digits: int = 1) -> Column:
    """Return a column of lengths in mm."""
    return Column(key, heading, form=lambda row: _mm(value(row, key), digits))


def _number(found: float | None, form: str) -> str:
    return "-" if found is None else format(found, form)


def _plain(name: str, form: str) -> Callable[[CompareRow], str]:
    """Return how a figure is shown that a case may not have."""
    return lambda row: _number(getattr(row.found, name), form)


def _variation(row: CompareRow) -> str:
    """Return the total variation of both joints' torques [N m]."""
    joints = (row.found.variation_1, row.found.variation_2)
    return "-" if None in joints else f"{sum(each or 0.0 for each in joints):.0f}"


def _paper(row: CompareRow) -> str:
    return f"{_mm(row.paper_simulation)} | {_mm(row.paper_laboratory)}"


COLUMNS = (
    Column("case", "trajectory", once=True),
    _length("envelope"),
    Column("paper", "paper sim | lab", form=_paper, once=True),
    _length("rms_error"),
    _length("max_v", "max |v|"),
)
EFFORT_COLUMNS = (
    Column("case", "trajectory", once=True),
    Column("rms_torque_1", "rms torque 1", form=_plain("rms_torque_1", ".2f")),
    Column("rms_torque_2", "rms torque 2", form=_plain("rms_torque_2", ".3f")),
    Column("variation", "variation", form=_variation),
    Column("growth", form=_plain("growth", "+.1f")),
)
TRUE_TIP_COLUMNS = (
    Column("reference", "trajectory, setting; reference", form="", once=True),
    _length("envelope", digits=2),
    Column("share", form=".2f"),
    Column("dead_zone_error", "dead zone", form=lambda _: "", once=True),
)
TRUE_TIP_SECTION = (
    Column("trajectory", form=lambda row: f"{row.trajectory}, {row.setting}"),
    *(Column("reference", form=lambda _: ""),) * 2,
    _length("dead_zone_error"),
)


def tables(result: Comparison) -> list[Table]:
    """Return the rows, and what is shown of them: our controllers, Table 2's, the true tip."""
    plants = " | ".join(dict.fromkeys(spoken(row.plant) for row in result.rows))
    shown = [Table(result.rows, key="rows", file="results.csv")]
    for group, name in TITLES.items():
        mine = [row for row in result.rows if row.group == group]
        title = f"{name}, setting {mine[0].setting}: envelope half-width, errors, v"
        if group == OURS:
            title = f"In mm: {plants}\n\n{title}"
        note = f" {group_verdict(mine)}\n"
        line = ("trajectory", "controllers")
        shown.append(Table(mine, COLUMNS, title, note, line=line))
        if group == OURS:
            shown.append(Table(mine, EFFORT_COLUMNS, EFFORT, "\n", line=line))
    return [*shown, _true_tip(result.rows)]


def _true_tip(rows: Sequence[CompareRow]) -> Table:
    """Return envelopes by kind of reference, and what the dead zone of joint 2 hides, in mm."""
    return Table(
        true_tip_rows(rows),
        TRUE_TIP_COLUMNS,
        "References for the true tip: envelope half-width, and its share of the first",
        line=("trajectory", "setting", "reference"),
        section=TRUE_TIP_SECTION,
    )


def true_tip_rows(rows: Sequence[CompareRow]) -> list[TrueTipRow]:
    """Return every reference's envelope as a share of the mirrored tip's, the first of its case."""
    first: dict[tuple[str, str, str], float | None] = {}
    found = []
    for row in (row for row in rows if row.group == TRUE_TIP):
        names, width = (row.trajectory, row.setting, row.plant), row.found.envelope
        plain = first.setdefault(names, width)
        share = None if width is None or plain is None else width / plain
        found.append(
            TrueTipRow(*names[:2], row.reference, row.plant, width, share, row.dead_zone_error)
        )
    return found


def group_verdict(rows: Sequence[CompareRow]) -> str:
    """Return in words whether controllers hold and the plants agree, for one setting's rows."""
    one, other = dict.fromkeys(row.plant for row in rows)
    widths: dict[tuple[str, str], dict[str, float | None]] = {}
    for row in rows:
        widths.setdefault((row.trajectory, row.controllers), {})[row.plant] = row.found.envelope
    ratios = []
    for case in widths.values():
        first, second = case[one], case[other]
        if first and second:
            ratios.append(second / first)
    spread = f"{min(ratios):.2f} to {max(ratios):.2f} times" if ratios else "an unknown multiple of"
    held = sum(not row.found.diverged for row in rows)
    lost = "".join(
        f"\n {row.case}: {100 * row.found.diverged_share:.0f} % diverged, {row.plant}"
        for row in rows
        if row.found.diverged
    )
    return (
        f"{held} of {len(rows)} hold; envelopes of the {spoken(other)} are {spread} those of the "
        f"{spoken(one)}.{lost}"
    )


def verdict(result: Comparison) -> str:
    """Return what the numbers are, and which model was used beyond itself."""
    return MEDIANS + "".join(f"\nNote: {each}" for each in beyond_itself(result))


def beyond_itself(result: Comparison) -> list[str]:
    """Return a note for each plant that bent further than its equations hold, at its largest."""
    most: dict[str, float] = {}
    for row in result.rows:
        most[row.plant] = max(most.get(row.plant, 0.0), row.found.max_v or 0.0)
    L = result.robot.parameters.L
    return [note for plant, v in most.items() for note in beyond(plant, v, L)]


def figures(result: Comparison) -> Iterator[tuple[str, Figure]]:
    """Give a figure per case, and one of all envelopes."""
    for case in result.cases:
        yield case.name, case_figure(case)
    yield "envelopes", summary_figure([row for row in result.rows if row.group != TRUE_TIP])


def facts(result: Comparison) -> dict[str, Any]:
    """Return the names of the cases, as of figures and recordings; what was beyond itself."""
    cases = [case.name for case in result.cases]
    return {"cases": cases, "beyond": beyond_itself(result)}


def files(folder: Path, config: Any, result: Comparison) -> None:
    """Write MJCF and recording."""
    for name, text in result.mjcf.items():
        (folder / name).write_text(text)
    about = {name.replace("-", "_"): text for name, text in (versions() | origin()).items()}
    about |= {"seed": str(config.seed), "control_period": f"{config.period} s"}
    write_recording(folder / "run.rrd", result.cases, about, result.robot.parameters)
