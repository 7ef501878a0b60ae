"""Tables 2 and 3 and Figure 6 anew: tables in mm, and a verdict.

>>> verdict(result)      # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flexsim.recording.traces import MM, spoken
from studies.core.evidence.digits import supported, with_interval
from studies.core.paper import CASES
from studies.core.table import Column, Table, value
from studies.tables.rows import ControllerRow, RatioRow, RunRow, TablesResult
from studies.tuning.distributions import NAMES

SHOWN = ("envelope", "rms_error", "max_v", "residual_v")  # in the table
INDEX = 1e4  # the table's indices are in 1e-4 m2 s
HALF = len(NAMES) // 2


@dataclass(frozen=True)
class JointRow:
    """One joint's parameters of a controller, by joint 1's names; index on its first line."""

    controllers: str
    parameters: Mapping[str, float | None]
    index: str


def _mm(length: float | None) -> str:
    return "-" if length is None else f"{MM * length:.1f}"


def _length(key: str, heading: str | None = None, **where: str) -> Column:
    """Return a column of lengths in mm; 'div' where half of the runs diverge, * where some do."""

    def shown(row: RunRow) -> str:
        length = value(row, key)
        if not row.runs:
            return "-"
        if length is None:
            return "div"
        own = key == "envelope"
        text = supported(length, row.envelope_low, row.envelope_high, MM) if own else _mm(length)
        return text + "*" * row.diverged

    return Column(key, heading, form=shown, where=where)


def _paper(row: RunRow) -> str:
    return "" if row.paper is None else "paper " + " | ".join(map(_mm, row.paper))


def tables(result: TablesResult) -> list[Table]:
    """Return Table 3, every controller everywhere, the deterioration, and Table 2."""
    plants = " | ".join(spoken(plant) for plant in dict.fromkeys(r.run_on for r in result.rows))
    if not result.tuned:
        return _given(result, plants)
    about = (
        f"In mm, run on {plants}; the paper's: simulation | laboratory.\n"
        "Medians over runs whose gains differ in their fourth digits; div: half of them\n"
        "diverged; *: fewer did.\n\n"
    )
    return [
        Table(result.rows, key="rows", file="results.csv"),
        Table(result.controllers, key="controllers", file="controllers.csv"),
        Table(result.ratios, key="ratios", file="ratios.csv"),
        _table_3(result.rows, f"{about}Table 3 and Figure 6 anew"),
        _transfer(result.rows),
        _deterioration(result.ratios),
        _table_2(result.controllers),
    ]


def _given(result: TablesResult, plants: str) -> list[Table]:
    """Return what given controllers do on every trajectory, and the plants' ratios."""
    about = (
        f"In mm, run on {plants}.\nMedians over runs whose gains differ in their fourth digits; "
        "div: half of them\ndiverged; *: fewer did.\n\nEvery controller on every trajectory"
    )
    return [
        Table(result.rows, key="rows", file="results.csv"),
        Table(result.ratios, key="ratios", file="ratios.csv"),
        Table(
            result.rows,
            (Column("trajectory"), *map(_length, SHOWN)),
            about,
            line=("controllers", "trajectory"),
            across="run_on",
            section=(Column("controllers"), Column("tuned_for", form=_for)),
            prints="results.csv",
        ),
        Table(
            result.ratios,
            (Column("controllers"), Column("trajectory"), Column("ratio", form=_ratio)),
            f"Ratio of envelopes, {result.ratios[0].direction}, with its 95 % interval",
            tight=True,
            prints="ratios.csv",
        ),
    ]


def _for(row: RunRow) -> str:
    return f"tuned for the {row.tuned_for}"


def _table_3(rows: Sequence[RunRow], title: str) -> Table:
    """Return envelopes, errors and v of Figures 3 to 6's cases, the paper's above ours."""
    return Table(
        [row for case in CASES for row in rows if (row.trajectory, row.tuned_for) == case],
        (Column("plant_tuned_on", "tuned on"), *map(_length, SHOWN)),
        title,
        line=("trajectory", "tuned_for", "plant_tuned_on"),
        across="run_on",
        section=(Column("case"), Column("paper", form=_paper)),
        prints="results.csv",
    )


def _transfer(rows: Sequence[RunRow]) -> Table:
    """Return the envelope of every controller on every trajectory."""
    shapes = dict.fromkeys(row.trajectory for row in rows)
    lines = (Column("tuned_for"), Column("plant_tuned_on", "on"))
    return Table(
        sorted(rows, key=lambda row: list(shapes).index(row.tuned_for)),
        (*lines, *(_length("envelope", shape, trajectory=shape) for shape in shapes)),
        "Every controller on every trajectory: envelope",
        line=("tuned_for", "plant_tuned_on"),
        across="run_on",
        prints="results.csv",
    )


def _ratio(row: RatioRow) -> str:
    return with_interval(row.ratio, row.ratio_low, row.ratio_high)


def _deterioration(ratios: Sequence[RatioRow]) -> Table:
    """Return the envelopes' ratios, a line per case and a column per plant tuned on."""
    direction = {row.tuned_on: row.direction for row in ratios}
    return Table(
        ratios,
        (
            Column("case", "tuned on", once=True),
            *(
                Column(
                    "ratio",
                    f"{spoken(on)}\n{words}",
                    form=_ratio,
                    where={"tuned_on": on},
                    once=True,
                )
                for on, words in direction.items()
            ),
            Column("paper_ratio", "paper\nlab / sim", form=".1f", once=True),
        ),
        "Deterioration: ratio of envelopes from plant to plant, with its 95 % interval",
        line=("trajectory", "tuned_for"),
        across="tuned_on",
        tight=True,
    )


def _joint(row: ControllerRow, joint: int) -> JointRow:
    """Return one joint's line."""
    names = NAMES[:HALF], NAMES[HALF:]
    own = {one: row.parameters[name] for one, name in zip(names[0], names[joint], strict=True)}
    if joint:
        return JointRow(f"  {row.generations} generations", own, "")
    index = "none" if row.index is None else f"{INDEX * row.index:.3g}"
    return JointRow(f"{row.tuned_for}, {spoken(row.tuned_on)}", own, index)


def _number(content: float | None) -> str:
    if content is None:
        return "-"
    return f"{content:.0f}" if abs(content) >= 1e3 else f"{content:.3g}"


def _parameter(name: str, below: str) -> Column:
    return Column(name, f"{name}\n{below}", form=lambda row: _number(row.parameters[name]))


def _table_2(controllers: Sequence[ControllerRow]) -> Table:
    """Return the tuned parameters in Table 1's units, joint 1 above joint 2, and index (5)."""
    pairs = zip(NAMES[:HALF], NAMES[HALF:], strict=True)
    return Table(
        [_joint(row, joint) for row in controllers for joint in (0, 1)],
        (
            Column("controllers"),
            *(_parameter(*pair) for pair in pairs),
            Column("index", form=lambda row: row.index),
        ),
        "Table 2 anew: gains in N m ms^nu/rad, index in 1e-4 m2 s",
        prints="controllers.csv",
    )


def _range(values: Sequence[float | None]) -> str:
    known = [ratio for ratio in values if ratio is not None]
    lost = f", {len(values) - len(known)} of {len(values)} diverged"
    spread = f"{min(known):.2f} to {max(known):.2f}" if known else "none"
    return spread + (lost if len(known) < len(values) else "")


def verdict(result: TablesResult) -> str:
    """Return in words how many runs hold, and what leaving the plant tuned on costs."""
    rows = result.rows
    own = [row for row in rows if row.tuned_for == row.trajectory]
    held, held_own = (sum(not row.diverged for row in these) for these in (rows, own))
    lines = [
        f"{held} of {len(rows)} runs hold, {held_own} of {len(own)} on their own trajectory.",
        "Ratios of envelopes:",
    ]
    if not result.tuned:
        mine = result.ratios
        lines.append(f"  {mine[0].direction:<40}{_range([row.ratio for row in mine])}")
        return "\n".join(lines)
    for tuned_on in dict.fromkeys(row.tuned_on for row in result.ratios):
        mine = [row for row in result.ratios if row.tuned_on == tuned_on]
        name = f"tuned on {spoken(tuned_on)}, {mine[0].direction}"
        lines.append(f"  {name:<40}{_range([row.ratio for row in mine])}")
    paper = _range([row.paper_ratio for row in mine])
    return "\n".join([*lines, f"  {'the paper, laboratory / simulation':<40}{paper}"])


def facts(result: TablesResult) -> dict[str, Any]:
    """Return the controllers of runs of flexsim tune, if any were given."""
    return {"runs": result.given} if result.given else {}


def files(folder: Path, _: Any, result: TablesResult) -> None:
    """Write the chain's MJCF."""
    (folder / "chain.xml").write_text(result.mjcf)
