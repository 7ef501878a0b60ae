"""What is different between runs: configuration, versions, machine, numbers, files.

>>> for sheet in differences([first, second]):
...     sheet.caption
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from flexsim.recording.traces import spoken
from studies.core.figures import raised
from studies.report.charts import Chart, interval_chart
from studies.report.frames import finite
from studies.report.kept import STUDY, Kept
from studies.report.names import PLAIN
from studies.report.pairs import (
    DIFFERENT,
    SAME,
    Pair,
    Side,
    Unpaired,
    counted,
    pairs_of,
    shared_key,
)
from studies.report.points import Point, points_of
from studies.report.sheets import MISSING, Cell, Head, Sheet, short, with_ends

ABOUT = ("out", "force", "json", "threads", "resume", "workers", "cluster", "example")
PAIRS_MOST = 1500  # rows of a table of numbers
DEEPEST = 12  # levels of a configuration
NO_TEST = (
    "Overlap and apart say it of the two intervals, which is no test of a difference: where one "
    "matters, compare in one run, pair by pair. A difference is the second less the first."
)


def named(runs: Sequence[Kept]) -> list[str]:
    """Return what the columns of runs are called."""
    return [f"run {i}: {run.folder}" for i, run in enumerate(runs, 1)]


def differences(runs: Sequence[Kept]) -> list[Sheet]:
    """Return the tables of what differs in what runs were asked for and made with, and left."""
    asked = [_asked(run) for run in runs]
    made = [_flat({k: run.config.get(k) for k in ("versions", "machine")}) for run in runs]
    return [
        _sheet(
            "Configuration",
            runs,
            asked,
            "Left out is what decides nothing: folders, threads, how it is printed.",
        ),
        _sheet("Versions and machine", runs, made),
        _files(runs),
    ]


def _asked(run: Kept) -> dict[str, str]:
    """Return what a run was asked for: its configuration, and its study file if it has one."""
    content = {"command": run.study, **run.config["configuration"]}
    found = _flat({key: value for key, value in content.items() if key not in ABOUT})
    return found | (_flat({STUDY: run.study_file}) if run.study_file else {})


def _flat(content: Any, path: str = "", depth: int = 0) -> dict[str, str]:
    """Return nested values by their paths, 'robot.EI', 'points[2]'."""
    found: dict[str, str] = {}
    if isinstance(content, Mapping) and content and depth < DEEPEST:
        for name, value in content.items():
            found |= _flat(value, f"{path}.{name}" if path else str(name), depth + 1)
    elif isinstance(content, list) and content and depth < DEEPEST:
        for i, value in enumerate(content):
            found |= _flat(value, f"{path}[{i}]", depth + 1)
    else:
        found[path] = short(content) if not isinstance(content, list | dict) else str(content)
    return found


def _sheet(
    caption: str, runs: Sequence[Kept], values: Sequence[Mapping[str, str]], note: str = ""
) -> Sheet:
    """Return the paths whose values differ."""
    paths = dict.fromkeys(path for each in values for path in each)
    rows = []
    for path in paths:
        cells = [each.get(path, MISSING) for each in values]
        if len(set(cells)) > 1:
            rows.append([Cell(path), *map(Cell, cells)])
    heads = [Head("item", "", "", False), *(Head(name, "", "", False) for name in named(runs))]
    alike = f"All {len(paths)} items are the same."
    return Sheet(caption, note if rows else alike, heads, rows)


def _files(runs: Sequence[Kept]) -> Sheet:
    """Return the files that some runs have and others have not."""
    own = [{path.name for path in run.folder.iterdir() if path.name[0] != "."} for run in runs]
    rows = []
    for name in sorted(set().union(*own)):
        here = [name in names for names in own]
        if not all(here):
            rows.append([Cell(name), *(Cell("yes" if each else "no") for each in here)])
    heads = [Head("file", "", "", False), *(Head(name, "", "", False) for name in named(runs))]
    return Sheet("Files", "" if rows else "All have the same files.", heads, rows)


def numbers(runs: Sequence[Kept]) -> Iterator[tuple[Sheet, Chart | None]]:
    """Give the numbers of the first run beside those of each other, and a figure of them."""
    for i, other in enumerate(runs[1:], 2):
        pairs, unpaired = pairs_of(runs[0], other)
        chart = _chart(f"differences-{i}", i, runs[0], other)
        yield _numbers(f"Numbers: run 1 and run {i}", i, pairs, unpaired), chart


def _numbers(caption: str, i: int, pairs: Sequence[Pair], unpaired: Sequence[Unpaired]) -> Sheet:
    """Return the numbers that differ, those with intervals first."""
    if not pairs:
        note = "They have no table with rows of the same key."
        return Sheet(caption, " ".join([note, *map(_alone, unpaired)]), [], [])
    differ = [each for each in pairs if each.verdict != SAME]
    differ.sort(key=lambda each: each.verdict == DIFFERENT)  # stable: else as they come
    rows = [_pair_cells(each) for each in differ[:PAIRS_MOST]]
    sides = [f"run 1 [interval], run {i} [interval], difference".split(", ")[n] for n in range(3)]
    heads = [Head(text, "", "", False) for text in ("file", "of", "figure")]
    heads += [Head(text, "", "", True) for text in sides]
    heads.append(Head("compared", "", "", False))
    lead = " ".join([counted(pairs), *map(_alone, unpaired)])
    more = len(differ) - len(rows)
    left = f"{more:,} more that differ are left out." if more else ""
    return Sheet(caption, NO_TEST if rows else "", heads, rows, left, lead)


def _alone(rows: Unpaired) -> str:
    return (
        f"{rows.file}: {rows.first} rows of the first and {rows.second} of the second have none "
        f"beside them, such as {rows.such_as}."
    )


def _pair_cells(pair: Pair) -> list[Cell]:
    difference = pair.difference
    unit = "" if pair.unit in PLAIN else f" [{raised(pair.unit)}]"
    return [
        *(Cell(text) for text in (pair.file, pair.of, pair.metric + unit)),
        *(_side_cell(side) for side in (pair.first, pair.second)),
        Cell(MISSING if difference is None else f"{difference:+.4g}", difference, True),
        Cell(pair.verdict),
    ]


def _side_cell(side: Side) -> Cell:
    return Cell(with_ends(side.value, side.low, side.high), finite(side.value), True)


def _chart(key: str, i: int, first: Kept, other: Kept) -> Chart | None:
    """Return the intervals of both, line by line; None if they have none in common."""
    names = (f"run 1: {first.folder}", f"run {i}: {other.folder}")
    points = []
    for frame, its in ((each, other.frame(each.name)) for each in first.frames):
        if its is None or not (told := shared_key(frame, its)):
            continue
        sides = [_by_key(points_of(each, told)) for each in (frame, its)]
        for at in (each for each in sides[0] if each in sides[1]):
            point = sides[0][at]
            of = ", ".join(word for word in (point.of, spoken(point.plant)) if word)
            metric = f"{point.metric} ({point.frame})"
            points += [
                replace(side[at], of=of, metric=metric, plant=name)
                for name, side in zip(names, sides, strict=True)
            ]
    if not points:
        return None
    return interval_chart(key, f"Run 1 and run {i}", points, by="run")


def _by_key(points: Sequence[Point]) -> dict[tuple[Any, ...], Point]:
    """Return figures by what they are of."""
    return {(p.metric, p.key): p for p in points if p.value is not None}
