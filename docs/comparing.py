"""What became of quoted numbers: lines of a document held against what a command prints now.

>>> compared(["line   5.3 [5.1, 5.5]"], ["line   5.4 [5.2, 5.5]"], {}).inside
1

Lines are paired in their order, each printed one once; a document may leave lines out, a command
may not. A number is `same`, digit for digit; `inside`, within the interval that stands behind the
quoted one; `left`, if it is not, or is no number any more; `moved`, another one that has no
interval, or other words around it.
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain
from typing import Any

NUMBER = re.compile(  # not a part of a name, but x1.1 is one; no number with letters behind it
    r"(?:(?<![\w.:])|(?<=\bx))[-+−]?(?:\d{1,3}(?:,\d{3})+|\d+)(?:\.\d+)?(?:e[-+]?\d+)?(?!\w|\.\d)"
)
END = r"([-+−]?\d[\d.,]*(?:e[-+]?\d+)?|\?)"  # of an interval; ? where there is none
INTERVAL = re.compile(rf"\s*\[\s*{END},\s*{END}\s*\]")
OPENED = re.compile(rf"\s*\[\s*{END},(?!\s*{END}\s*\])")  # its end in the same cell's next line
CLOSED = re.compile(rf"(?<![\w.,:-])(?<!, ){END}\]")
WIDTH = 80  # of a terminal; longer lines are wrapped in documents
ALIKE = 0.6  # of two lines' words: less is another line
Interval = tuple[float, float]


@dataclass
class Found:
    """What became of a block's numbers: `moved`, `left`, `missing` and `failed` in words."""

    same: int = 0
    inside: int = 0
    moved: list[str] = field(default_factory=list)
    left: list[str] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)
    failed: list[str] = field(default_factory=list)

    @property
    def holds(self) -> bool:
        """Whether it was printed, nothing left its interval, and every line is there."""
        return not self.left and not self.missing and not self.failed


def compared(block: list[str], printed: list[str], item: Mapping[str, Any]) -> Found:
    """Return what became of a block's numbers in what was printed.

    Args:
        item: `skip`, parts of lines, and `machine`, patterns of parts, that are not compared.
    """
    found = Found()
    of_machine = [re.compile(pattern) for pattern in item.get("machine", [])]
    block, printed = ([_without(line, of_machine) for line in lines] for lines in (block, printed))
    lines = [
        line
        for line in _unwrapped(block, [shape(line) for line in printed])
        if line.strip(" ─|-:") and not any(part in line for part in item.get("skip", []))
    ]
    for line, near, intervals in zip(
        lines, _paired(lines, printed), _intervals(lines), strict=True
    ):
        if near is None:
            found.missing.append(line.strip())
        else:
            _numbers(line, printed[near], intervals, found)
    return found


def in_words(words: Sequence[str], printed: list[str]) -> Found:
    """Return which numbers of some words are printed, those with an interval together with it."""
    found = Found()
    rows = [[value(each) for each in NUMBER.findall(line)] for line in printed]
    for text in words:
        at = 0
        while match := NUMBER.search(text, at):
            behind = INTERVAL.match(text, match.end())
            at = behind.end() if behind else match.end()
            wanted = [value(each) for each in (match.group(), *(behind.groups() if behind else ()))]
            count = len(wanted)
            if any(row[i : i + count] == wanted for row in rows for i in range(len(row))):
                found.same += count
            else:
                found.missing.append(f"{text[match.start() : at]} is not printed, in: {text}")
    return found


def value(text: str) -> float:
    """Return a number as it is printed."""
    return float(text.replace(",", "").replace("−", "-"))


def shape(line: str) -> str:
    """Return a line's words, # for its numbers."""
    return " ".join(NUMBER.sub("#", line).split())


def _without(line: str, parts: list[re.Pattern[str]]) -> str:
    """Return a line without what is the machine's."""
    for pattern in parts:
        line = pattern.sub("", line)
    return line


def _unwrapped(block: list[str], shapes: list[str]) -> list[str]:
    """Return a block's lines, those joined again that are printed as one and wrapped in it."""
    longs = [each.split() for each in shapes if len(each) > WIDTH]
    own = [shape(line).split() for line in block]
    lines, i = [], 0
    while i < len(block):
        count = 1
        for words in longs:
            ends = (j for j in range(i + 2, len(block) + 1) if [*chain(*own[i:j])] == words)
            count = max(count, next(ends, i + 1) - i)
        lines.append(
            " ".join(line.strip() for line in block[i : i + count]) if count > 1 else block[i]
        )
        i += count
    return lines


def _paired(lines: list[str], printed: list[str]) -> list[int | None]:
    """Return which printed line each line is, both in their order, the most alike in all."""
    scores = [[0.0] * (len(printed) + 1) for _ in range(len(lines) + 1)]
    own, theirs = ([(shape(e), NUMBER.findall(e)) for e in each] for each in (lines, printed))
    alike = [[_alike(one, other) for other in theirs] for one in own]
    for i, row in enumerate(alike):
        for j, score in enumerate(row):
            both = scores[i][j] + score if score else 0.0
            scores[i + 1][j + 1] = max(scores[i][j + 1], scores[i + 1][j], both)
    found: list[int | None] = [None] * len(lines)
    i, j = len(lines), len(printed)
    while i and j:
        if scores[i][j] == scores[i - 1][j]:
            i -= 1
        elif scores[i][j] == scores[i][j - 1]:
            j -= 1
        else:
            i, j = i - 1, j - 1
            found[i] = j
    return found


def _alike(one: tuple[str, list[str]], other: tuple[str, list[str]]) -> float:
    """Return how much two lines are one: 0 not, below 1 with other words, most the same numbers."""
    if one[0] == other[0]:
        same = sum(a == b for a, b in zip(one[1], other[1], strict=True))
        return 1.0 + 0.5 * same / max(len(one[1]), 1)
    words, others = one[0].split(), other[0].split()
    if words[:1] != others[:1]:
        return 0.0
    ratio = difflib.SequenceMatcher(None, words, others, autojunk=False).ratio()
    return 0.9 * ratio if ratio >= ALIKE else 0.0


def _intervals(lines: list[str]) -> list[dict[int, Interval]]:
    """Return the intervals behind numbers, by where these begin, also those that cells wrap."""
    found: list[dict[int, Interval]] = []
    for line, below in zip(lines, [*lines[1:], ""], strict=False):
        own: dict[int, Interval] = {}
        opened: list[tuple[int, str]] = []
        for match in NUMBER.finditer(line):
            if behind := INTERVAL.match(line, match.end()):
                own[match.start()] = _ends(*behind.groups())
            elif behind := OPENED.match(line, match.end()):
                opened.append((match.start(), behind.group(1)))
        closed = CLOSED.findall(below)
        if len(opened) == len(closed):
            own |= {at: _ends(low, high) for (at, low), high in zip(opened, closed, strict=True)}
        found.append(own)
    return found


def _ends(low: str, high: str) -> Interval:
    return (
        -math.inf if low == "?" else value(low),
        math.inf if high == "?" else value(high),
    )


def _numbers(line: str, other: str, intervals: dict[int, Interval], found: Found) -> None:
    """Compare the numbers of two lines, in their order, and the words between them."""
    ours, theirs = list(NUMBER.finditer(line)), NUMBER.findall(other)
    changed = f"{line.strip()} -> {other.strip()}"
    if len(ours) != len(theirs):
        matcher = difflib.SequenceMatcher(None, [m.group() for m in ours], theirs, autojunk=False)
        kept = {k for b in matcher.get_matching_blocks() for k in range(b.a, b.a + b.size)}
        found.same += len(kept)
        gone = [m for k, m in enumerate(ours) if k not in kept and m.start() in intervals]
        found.left += [f"{m.group()} -> ? in: {changed}" for m in gone]
        found.moved.append(changed)
        return
    if shape(line) != shape(other):
        found.moved.append(changed)
    for match, new in zip(ours, theirs, strict=True):
        old = match.group()
        text = f"{old} -> {new} in: {line.strip()}"
        if old == new:
            found.same += 1
        elif match.start() not in intervals:
            found.moved.append(text)
        else:
            low, high = intervals[match.start()]
            if low <= value(new) <= high:
                found.inside += 1
            else:
                found.left.append(text)
