"""Figures with intervals out of a run's tables, each with what it is of.

>>> points = points_of(frame)
>>> points[0].metric, points[0].of, points[0].plant, points[0].value, points[0].low
('envelope', 'line, tuned line', 'assumed-modes', 6.846..., None)

What a row is of, its key, are its columns of names; numbers where these leave rows alike.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from flexsim.recording.traces import spoken
from studies.report.frames import Frame, Value, finite
from studies.report.names import ENDS, PARTS, in_words
from studies.report.sheets import short

FIRST = (  # what names a row, in the order in which they are taken
    *("what", "case", "trajectory", "controllers", "controller", "plant", "robot", "setting"),
    *("group", "reference", "hardware", "figure", "against", "ladder", "variant", "misprint"),
    *("realisation", "structure", "order", "range", "part", "ground", "v", "name", "integrator"),
    *("tuned_on", "tuned_for", "run_on", "from_plant", "to_plant", "generation", "individual"),
    *("terms", "theta2", "step", "size", "screen", "seed", "hold"),
)
NEVER = ("unit", "simulated", "why", "ended", "status", "note", "refused", "confirmed", "cheapest")
PLANT = "plant"
LONG = ("figure", "median", "low", "high")  # a row for each figure, as of a study file's summary
PAIRED = ("difference", "ratio")


@dataclass(frozen=True)
class Point:
    """A figure of a row.

    Attributes:
        frame: name of the file. metric: what it is, unit: as in the file.
        of: the row's key in words, as far as it varies, but for its plant; key: all of it.
        plant: empty if the table has none. value, low, high: None where there is none.
    """

    frame: str
    metric: str
    unit: str
    meaning: str
    of: str
    key: tuple[Value, ...]
    plant: str
    value: float | None
    low: float | None
    high: float | None


def keys_of(frame: Frame) -> list[str]:
    """Return the columns that tell a table's rows apart, none where they are just numbered."""
    texts = [name for name in frame.columns if _names(frame, name)]
    numbers = [
        name
        for name in frame.columns
        if frame.numeric(name) and not name.endswith(PARTS) and name not in frame.figures
    ]
    order = [name for name in FIRST if name in texts]
    order += [name for name in texts if name not in FIRST]
    numbered = [name for name in FIRST if name in numbers] + [n for n in numbers if "." in n]
    order += list(dict.fromkeys(numbered))
    taken: list[str] = []
    for name in order:
        if (name in texts and name in FIRST) or not _apart(frame, taken):
            taken.append(name)
    return taken if _apart(frame, taken) else []


def _names(frame: Frame, name: str) -> bool:
    """Return whether a column has names, texts that say what a row is of."""
    values = [value for value in frame.column(name) if value is not None]
    return name not in NEVER and bool(values) and all(isinstance(each, str) for each in values)


def _apart(frame: Frame, names: Sequence[str]) -> bool:
    return len({key(frame, row, names) for row in frame.rows}) == len(frame.rows)


def key(frame: Frame, row: Sequence[Value], names: Sequence[str]) -> tuple[Value, ...]:
    """Return what a row is of."""
    return tuple(row[frame.places[name]] for name in names)


def words(names: Sequence[str], values: Sequence[Value]) -> str:
    """Return a key in words; numbers with their names."""
    said = []
    for name, value in zip(names, values, strict=True):
        if isinstance(value, str):
            said.append(spoken(value) if name == PLANT else value)
        elif value is not None:
            said.append(f"{in_words(name)} {short(value)}")
    return ", ".join(said)


def varying(frame: Frame, names: Sequence[str]) -> list[str]:
    """Return those of some columns that are not the same in every row."""
    return [name for name in names if len(set(frame.column(name))) > 1]


def points_of(frame: Frame, names: Sequence[str] | None = None) -> list[Point]:
    """Return all figures with intervals of a table; none where its rows cannot be told apart.

    Args:
        frame: as named. names: the columns that tell them apart, found if not given.
    """
    names = keys_of(frame) if names is None else names
    if not names:
        return []
    if set(LONG) <= set(frame.columns):
        return list(_long(frame, names))
    return list(_wide(frame, names))


def _wide(frame: Frame, names: Sequence[str]) -> Iterator[Point]:
    """Give the figures of a table with a column for each."""
    told = [name for name in varying(frame, names) if name != PLANT] or list(names[:1])
    for metric in frame.figures:
        about = frame.known(metric)
        for row in frame.rows:
            yield Point(
                frame.name,
                in_words(metric),
                about.unit,
                about.meaning,
                words(told, key(frame, row, told)),
                key(frame, row, names),
                _plant(frame, row),
                *(finite(row[frame.places[f"{metric}{end}"]]) for end in ("", *ENDS)),
            )


def _long(frame: Frame, names: Sequence[str]) -> Iterator[Point]:
    """Give the figures of a table with a row for each."""
    told = [n for n in varying(frame, names) if n not in (PLANT, "figure", "what", "against")]
    for row in frame.rows:
        at = dict(zip(frame.columns, row, strict=True))
        figure, unit = str(at["figure"]), str(at.get("unit") or "")
        of, plant = words(told, key(frame, row, told)), _plant(frame, row)
        about = (figure, unit, frame.known(figure).meaning, of, key(frame, row, names), plant)
        if at.get("against") is None:
            low, high = finite(at["low"]), finite(at["high"])
            yield Point(frame.name, *about, finite(at["median"]), low, high)
            continue
        for kind in (name for name in PAIRED if name in frame.places):
            ends = (finite(at.get(f"{kind}{end}")) for end in ("", *ENDS))
            metric = f"{in_words(figure)}, {kind} of {in_words(str(at.get('what')))}"
            yield Point(frame.name, metric, unit * (kind != "ratio"), *about[2:], *ends)


def _plant(frame: Frame, row: Sequence[Value]) -> str:
    return str(row[frame.places[PLANT]] or "") if PLANT in frame.places else ""
