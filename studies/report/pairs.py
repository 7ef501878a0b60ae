"""Two runs' tables, row by row: both numbers with their intervals, and what lies between.

>>> for pair in pairs_of(first, second):
...     pair.of, pair.metric, pair.first.value, pair.second.value, pair.verdict

Rows belong together if their keys are the same. Two 95 % intervals that overlap are no test, and
none is claimed.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from studies.report.frames import Frame, Value, finite, is_number
from studies.report.kept import GENERATIONS, RESULTS, RESULTS_CSV, Kept
from studies.report.names import PARTS, in_words
from studies.report.points import LONG, key, keys_of, words

SAME, APART, OVERLAP, DIFFERENT, NOT_BOTH = (
    *("the same", "apart", "overlap", "different", "in one only"),
)
NEVER_PAIRED = (GENERATIONS,)  # individuals that have nothing to do with each other
NO_FIGURES = ("shown", "run", "seed", "draw", "repeat", "default")  # numbers of something
ENDS_OF = {"median": ("low", "high")}  # of a table with a row for each figure


class Side(NamedTuple):
    """A number of one run with its interval, None where there is none."""

    value: Value
    low: float | None
    high: float | None


class Pair(NamedTuple):
    """A number of two runs.

    Attributes:
        file: name of the table. of: the row's key in words. metric, unit: of the number.
        verdict: one of those above.
    """

    file: str
    of: str
    metric: str
    unit: str
    first: Side
    second: Side
    verdict: str

    @property
    def difference(self) -> float | None:
        """The second less the first."""
        one, other = finite(self.first.value), finite(self.second.value)
        return None if one is None or other is None else other - one


class Unpaired(NamedTuple):
    """Rows that one run has alone: how many, and the first in words."""

    file: str
    first: int
    second: int
    such_as: str


def pairs_of(first: Kept, second: Kept) -> tuple[list[Pair], list[Unpaired]]:
    """Return all numbers that two runs have in common, and which rows they have not."""
    pairs: list[Pair] = []
    unpaired = []
    for one in first.frames:
        other = second.frame(one.name)
        if other is None or not (names := shared_key(one, other)):
            continue
        mine, its = ({key(f, row, names): row for row in f.rows} for f in (one, other))
        alone = [each for each in mine if each not in its], [k for k in its if k not in mine]
        if alone[0] or alone[1]:
            such = words(names, (alone[0] or alone[1])[0])
            unpaired.append(Unpaired(one.name, len(alone[0]), len(alone[1]), such))
        both = [each for each in mine if each in its]
        several = [i for i in range(len(names)) if len({each[i] for each in both}) > 1] or [0]
        for row_key in both:
            told = words([names[i] for i in several], [row_key[i] for i in several])
            pairs += _row(one, other, mine[row_key], its[row_key], told, names)
    return pairs, unpaired


def _whole(one: Frame, other: Frame) -> bool:
    """Return whether tables were read whole, and are not of single runs."""
    if one.name in (RESULTS, RESULTS_CSV) and "run" in one.columns:
        return False
    return all(len(each.rows) == each.total for each in (one, other))


def shared_key(one: Frame, other: Frame) -> list[str]:
    """Return the columns that tell rows apart in both tables, none if there are none."""
    if one.name in NEVER_PAIRED or not _whole(one, other):
        return []
    found = keys_of(one)
    found += [name for name in keys_of(other) if name not in found]
    shared = all(name in one.places and name in other.places for name in found)
    return found if shared else []


def _row(
    one: Frame,
    other: Frame,
    mine: Sequence[Value],
    its: Sequence[Value],
    told: str,
    names: Sequence[str],
) -> Iterator[Pair]:
    """Give the numbers of two rows that belong together."""
    for name in one.columns:
        named = name in names or name in NO_FIGURES
        if named or name not in other.places or _is_end(one, name):
            continue
        first, second = _side(one, mine, name), _side(other, its, name)
        if not any(is_number(each.value) for each in (first, second)):
            continue
        unit = one.known(name).unit
        if set(LONG) <= set(one.columns):
            unit = str(mine[one.places["unit"]] or "") if "unit" in one.places else ""
        yield Pair(one.name, told, in_words(name), unit, first, second, verdict(first, second))


def _is_end(frame: Frame, name: str) -> bool:
    """Return whether a column is the end of an interval, or a quartile, of another."""
    if "median" in frame.columns and name in ENDS_OF["median"]:
        return True
    return any(name.endswith(part) and name.removesuffix(part) in frame.places for part in PARTS)


def _side(frame: Frame, row: Sequence[Value], name: str) -> Side:
    low, high = ENDS_OF.get(name, (f"{name}_low", f"{name}_high"))
    ends = (finite(row[frame.places[end]]) if end in frame.places else None for end in (low, high))
    return Side(row[frame.places[name]], *ends)


def verdict(first: Side, second: Side) -> str:
    """Return how two numbers compare: by their intervals if both have one."""
    if first == second:
        return SAME
    if (finite(first.value) is None) != (finite(second.value) is None):
        return NOT_BOTH
    ends = (first.low, first.high, second.low, second.high)
    if any(end is None for end in ends):
        return SAME if first.value == second.value else DIFFERENT
    low_1, high_1, low_2, high_2 = (end or 0.0 for end in ends)
    return OVERLAP if low_1 <= high_2 and low_2 <= high_1 else APART


def counted(pairs: Sequence[Pair]) -> str:
    """Return in words how many numbers compare how."""
    counts = Counter(each.verdict for each in pairs)
    order = (SAME, OVERLAP, APART, DIFFERENT, NOT_BOTH)
    said = [f"{counts[each]:,} {each}" for each in order if counts[each]]
    return f"{len(pairs):,} numbers in rows of the same key: {', '.join(said)}."
