"""What `flexsim compare` shows: its tables and words, its figures, its recording."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from flexsim.loop.beyond import beyond
from flexsim.recording.rrd import write_recording
from flexsim.recording.traces import MM, spoken
from studies.compare.figures import case_figure, summary_figure
from studies.compare.rows import CompareRow, Comparison, TrueTipRow
from studies.compare.tasks import OF_IDEAL, OURS, TABLE, TRUE_TIP
from studies.core.evidence.check_sample import SAME
from studies.core.evidence.digits import percent, supported, with_interval
from studies.core.evidence.holding_table import holding_table, said
from studies.core.evidence.repeats import Medians
from studies.core.folder import origin, versions
from studies.core.table import Column, Table

TITLES = {
    OURS: "Our controllers",
    OF_IDEAL: "Our controllers of the ideal loop",
    TABLE: "The paper's Table 2",
}
MEDIANS = (
    "Medians over runs whose gains differ in their fourth digits, with 95 % intervals by order "
    "statistics; of ratios, by a bootstrap of the pairs. Digits are those that the interval "
    "supports; intervals and quartiles of all in results.csv."
)
RESULTS = "results.csv"
ERRORS = "Runs; the paper's envelopes; errors and v [mm]"
TORQUES = "Commanded torques: rms, total variation [N m]; growth of v in the hold [1/s]"


def _mm(length: float | None, digits: int = 1) -> str:
    """Return a length in mm."""
    return "-" if length is None else f"{MM * length:.{digits}f}"


def _sure(name: str, scale: float = 1.0, most: int = 2, sign: str = "") -> Callable[[Any], str]:
    """Return how a figure of a row is shown, in the digits that its interval supports."""

    def shown(row: CompareRow) -> str:
        low, high = row.found.interval(name)
        return supported(getattr(row.found, name), low, high, scale, most, sign)

    return shown


def _envelope(row: CompareRow) -> str:
    """Return the median envelope with its interval [mm]."""
    low, high = row.found.interval("envelope")
    return with_interval(row.found.envelope, low, high, scale=MM)


def _envelope_of(row: TrueTipRow) -> str:
    """Return the same of a reference."""
    return with_interval(row.envelope, row.envelope_low, row.envelope_high, scale=MM)


def merit(found: Medians) -> dict[str, str]:
    """Return a plant's figures of merit in words: medians with their 95 % intervals."""
    wanted = (
        ("envelope", "envelope [mm]", MM),
        ("rms_error", "rms error [mm]", MM),
        ("max_v", "max \\|v\\| [mm]", MM),
        ("residual_v", "residual v [mm]", MM),
        ("rms_torque_1", "rms torque 1 [N m]", 1.0),
        ("rms_torque_2", "rms torque 2 [N m]", 1.0),
    )
    words = {
        title: with_interval(getattr(found, name), *found.interval(name), scale=scale)
        for name, title, scale in wanted
    }
    lost = f"{round(found.runs * found.diverged_share)} of {found.runs}"
    return {**words, "runs that diverged": lost}


def _ratio(row: CompareRow) -> str:
    """Return the ratio to the first plant's envelope with its interval."""
    a = row.against
    return with_interval(a.ratio, a.ratio_low, a.ratio_high, most=3)


def _paper(row: CompareRow) -> str:
    return f"{_mm(row.paper_simulation)} | {_mm(row.paper_laboratory)}"


def _columns(plants: Sequence[str]) -> tuple[Column, ...]:
    """Return the columns of envelopes: one for each plant, then the second's ratio to the first."""
    return (
        Column("case", "trajectory", once=True),
        *(
            Column("envelope", spoken(name), form=_envelope, once=True, where={"plant": name})
            for name in plants
        ),
        Column("ratio", form=_ratio, once=True, where={"plant": plants[1]}),
    )


ERROR_COLUMNS = (
    Column("case", "trajectory", once=True),
    Column("runs", form=lambda row: str(row.found.runs)),
    Column("paper", "paper sim | lab", form=_paper, once=True),
    Column("rms_error", form=_sure("rms_error", MM)),
    Column("max_v", "max |v|", form=_sure("max_v", MM)),
)
TORQUE_COLUMNS = (
    Column("case", "trajectory", once=True),
    Column("rms_torque_1", "rms 1", form=_sure("rms_torque_1")),
    Column("rms_torque_2", "rms 2", form=_sure("rms_torque_2", most=3)),
    Column("variation_1", "variation 1", form=_sure("variation_1", most=1)),
    Column("variation_2", "variation 2", form=_sure("variation_2", most=1)),
    Column("growth", form=_sure("growth", most=1, sign="+")),
)


def _true_tip_columns(plants: Sequence[str]) -> tuple[Column, ...]:
    """Return the columns of references: envelope and share of one plant after the other."""
    each = (
        (
            Column("envelope", spoken(name), form=_envelope_of, once=True, where={"plant": name}),
            Column("share", form=".2f", once=True, where={"plant": name}),
        )
        for name in plants
    )
    hidden = Column("dead_zone_error", "hides", form=lambda _: "", once=True)
    return (Column("reference", "reference", form="", once=True), *chain(*each), hidden)


TRUE_TIP_SECTION = (
    Column("trajectory", form=lambda row: f"{row.trajectory}, {row.setting}"),
    *(Column("reference", form=lambda _: ""),) * 4,  # two plants' envelopes and shares
    Column("dead_zone_error", form=lambda row: _mm(row.dead_zone_error)),
)


def tables(result: Comparison) -> list[Table]:
    """Return the rows, and what is shown of them: our controllers, Table 2's, the true tip."""
    plants = " | ".join(dict.fromkeys(spoken(row.plant) for row in result.rows))
    shown = [Table(result.rows, key="rows", file=RESULTS)]
    for group, mine in _groups(result.rows):
        title = f"{_titled(mine)}: envelope half-width [mm]"
        names = list(dict.fromkeys(row.plant for row in mine))
        line = ("trajectory", "controllers")
        note = f" {group_verdict(mine)}\n"
        how: dict[str, Any] = {"line": line, "prints": RESULTS}
        shown.append(Table(mine, _columns(names), title, note, tight=True, **how))
        shown.append(Table(mine, ERROR_COLUMNS, f"{ERRORS}: {plants}", "\n", **how))
        if group not in (OF_IDEAL, TABLE):
            shown.append(Table(mine, TORQUE_COLUMNS, TORQUES, "\n", tight=True, **how))
    return [*shown, holding_table(result.holding), _true_tip(result.rows)]


def _groups(rows: Sequence[CompareRow]) -> Iterator[tuple[str, list[CompareRow]]]:
    """Give what is shown together: our controllers, Table 2's, those of runs."""
    present = dict.fromkeys(row.group for row in rows)
    for group in (*(each for each in TITLES if each in present), *_runs(present)):
        yield group, [row for row in rows if row.group == group]


def _titled(rows: Sequence[CompareRow]) -> str:
    """Return whose controllers a group's rows are of, and in which loop."""
    whose = TITLES.get(rows[0].group) or _called(rows[0])
    return f"{whose}, setting {rows[0].setting}, hardware {rows[0].hardware}"


def _runs(groups: Iterable[str]) -> list[str]:
    """Return those of groups of cases that are runs of flexsim tune."""
    return [each for each in groups if each not in TITLES and each != TRUE_TIP]


def _called(row: CompareRow) -> str:
    """Return what a run's controllers are called in a title."""
    return f"Controllers of {row.group}, tuned for the {row.devised}"


def _true_tip(rows: Sequence[CompareRow]) -> Table:
    """Return envelopes by kind of reference, and what the dead zone of joint 2 hides, in mm."""
    found = true_tip_rows(rows)
    return Table(
        found,
        _true_tip_columns(list(dict.fromkeys(row.plant for row in found))),
        "References for the true tip: envelope, share of the first; what the dead zone hides [mm]",
        line=("trajectory", "setting", "reference"),
        section=TRUE_TIP_SECTION,
        tight=True,
        prints=RESULTS,
    )


def true_tip_rows(rows: Sequence[CompareRow]) -> list[TrueTipRow]:
    """Return every reference's envelope as a share of the mirrored tip's, the first of its case."""
    first: dict[tuple[str, str, str], float | None] = {}
    found = []
    for row in (row for row in rows if row.group == TRUE_TIP):
        names, width = (row.trajectory, row.setting, row.plant), row.found.envelope
        ends = row.found.interval("envelope")
        plain = first.setdefault(names, width)
        share = None if width is None or plain is None else width / plain
        found.append(
            TrueTipRow(
                *names[:2], row.reference, row.plant, width, *ends, share, row.dead_zone_error
            )
        )
    return found


def group_verdict(rows: Sequence[CompareRow]) -> str:
    """Return in words whether runs stay bounded and plants agree, for one setting's rows."""
    one, other = dict.fromkeys(row.plant for row in rows)
    ratios = [row.against.ratio for row in rows if row.against.ratio is not None]
    spread = f"{min(ratios):.2f} to {max(ratios):.2f} times" if ratios else "an unknown multiple of"
    bounded = sum(not row.found.diverged for row in rows)
    lost = "".join(f"\n {_diverged(row)}" for row in rows if row.found.diverged)
    return (
        f"{bounded} of {len(rows)} stay bounded; envelopes of the {spoken(other)} are {spread} "
        f"those of the {spoken(one)}.{lost}"
    )


def _diverged(row: CompareRow) -> str:
    """Return in words how large a share of runs diverged."""
    ends = row.found.interval("diverged_share")
    share = percent(row.found.diverged_share, *(each or 0.0 for each in ends))
    return f"{row.case}, {spoken(row.plant)}: {share} of {row.found.runs} diverged"


def verdict(result: Comparison) -> str:
    """Return what the numbers are, what MuJoCo's own runs say, what was used beyond itself."""
    held = [said(result.holding)] if result.holding else []
    notes = [*held, *_checked(result.rows), *beyond_itself(result)]
    return MEDIANS + "".join(f"\nNote: {each}" for each in notes)


def answer(result: Comparison) -> str:
    """Return what is said of each group of controllers, and the verdict."""
    groups = [f"{_titled(mine)}: {group_verdict(mine)}" for _, mine in _groups(result.rows)]
    return "\n".join([*groups, verdict(result)])


def _checked(rows: Sequence[CompareRow]) -> list[str]:
    """Return what became of the check samples: the same, of the same distribution, or outside."""
    found = []
    for plant in dict.fromkeys(row.plant for row in rows):
        mine = [row for row in rows if row.plant == plant and row.check.check_runs]
        if not mine:
            continue
        same = [row for row in mine if (row.check.check_difference or 0.0) <= SAME]
        inside = sum(bool(row.check.check_inside) for row in mine)
        most = max(row.check.check_runs for row in mine)
        found.append(
            f"{spoken(plant)}: repeats in closed form; {most} of MuJoCo's own in every case: "
            f"in {len(same)} of {len(mine)} cases the same to a micrometre, in {inside} inside"
        )
        found += [
            f"{row.case}, setting {row.setting}: MuJoCo's runs lie outside of the closed form's; "
            f"{row.check.check_outside} of {row.check.check_runs} beyond them all, median "
            f"{_mm(row.check.check_median)} mm"
            for row in mine
            if not row.check.check_inside
        ]
    return found


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
    """Return the names of the cases, as of figures and recordings; what was beyond itself; runs."""
    cases = [case.name for case in result.cases]
    given = {"runs": result.given} if result.given else {}
    return {"cases": cases, "beyond": beyond_itself(result), **given}


def files(folder: Path, config: Any, result: Comparison) -> None:
    """Write MJCF and recording."""
    for name, text in result.mjcf.items():
        (folder / name).write_text(text)
    about = {name.replace("-", "_"): text for name, text in (versions() | origin()).items()}
    about |= {"seed": str(config.seed), "control_period": f"{config.period} s"}
    write_recording(folder / "run.rrd", result.cases, about, result.robot.parameters)
