"""Make every number again that the documents quote, and say which left its interval.

    python docs/reproduce.py --list              # what there is, and what it costs
    python docs/reproduce.py --quick             # the subset that CI runs
    python docs/reproduce.py compare ladder      # some; all without names

`published.toml` says which block of which document a command prints. The command is run into a
folder of its own, and the block looked for in what it printed, line by line. A number is `same`,
digit for digit; `inside`, within the interval that stands behind the published one; `moved`,
another one that has no interval; or `left`. Lines that are not printed any more are named. Ends
with status 1 if any number left its interval or a line is missing.
"""

from __future__ import annotations

import argparse
import difflib
import os
import re
import shlex
import subprocess
import sys
import tempfile
import time
import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
PUBLISHED = Path(__file__).with_name("published.toml")
NUMBER = re.compile(r"(?<![\w.])[-+]?\d[\d,]*\.?\d*(?:e[-+]?\d+)?(?![\w])")
INTERVAL = re.compile(r"\s*\[\s*([-+\d.,e]+),\s*([-+\d.,e]+)\s*\]")
ALIKE = 0.6  # of two lines' words: less is another line
COST = re.compile(r"\d+(\.\d+)? us\b|\b(us|s|min)\b")


@dataclass
class Found:
    """What became of a block's numbers: `moved`, `left` and `missing` in words."""

    same: int = 0
    inside: int = 0
    moved: list[str] = field(default_factory=list)
    left: list[str] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)

    @property
    def holds(self) -> bool:
        """Whether nothing left its interval, and every line is there."""
        return not self.left and not self.missing


def block_of(item: dict[str, Any]) -> list[str]:
    """Return the lines of an item's block.

    Raises:
        ValueError: the document has no such block.
    """
    lines = (ROOT / item["document"]).read_text(encoding="utf-8").split("\n")
    seen, i = 0, 0
    while i < len(lines):
        if lines[i].startswith("```"):
            end = next(j for j in range(i + 1, len(lines)) if lines[j].startswith("```"))
            block = lines[i + 1 : end]
            first = next((k for k, line in enumerate(block) if item["begins"] in line), None)
            seen += first is not None
            if first is not None and seen == item.get("occurrence", 1):
                behind = block[first + 1 :]
                ends = (k for k, line in enumerate(behind) if item.get("ends", "\n") in line)
                whole = [block[first], *behind[: next(ends, len(behind))]]
                return [line for line in whole if line.strip()]
            i = end
        i += 1
    raise ValueError(f"{item['document']} has no block that begins with {item['begins']!r}")


def compared(block: list[str], printed: list[str], item: dict[str, Any]) -> Found:
    """Return what became of a block's numbers in what was printed."""
    found = Found()
    shapes = [_shape(line) for line in printed]
    at = 0
    for line in block:
        if any(part in line for part in item.get("skip", [])) or not line.strip(" ─"):
            continue
        near = _nearest(line, printed, shapes, at)
        if near is None:
            found.missing.append(line.strip())
            continue
        at = near + 1
        _numbers(line, printed[near], found, bool(item.get("costs")))
    return found


def _shape(line: str) -> str:
    return " ".join(NUMBER.sub("#", line).split())


def _nearest(line: str, printed: list[str], shapes: list[str], at: int) -> int | None:
    """Return which printed line this is, from the place of the last one on if there are several."""
    shape = _shape(line)
    order = [*range(at, len(shapes)), *range(min(at, len(shapes)))]
    same = [k for k in order if shapes[k] == shape]
    if same:  # of several the one with most of the same numbers, the first of those
        numbers = NUMBER.findall(line)
        return max(
            same,
            key=lambda k: sum(
                a == b for a, b in zip(numbers, NUMBER.findall(printed[k]), strict=False)
            ),
        )
    ratios = [
        (difflib.SequenceMatcher(None, shape, shapes[k]).ratio(), -i, k)
        for i, k in enumerate(order)
        if shapes[k].split()[:1] == shape.split()[:1]
    ]
    best = max(ratios, default=(0.0, 0, 0))
    return best[2] if best[0] >= ALIKE else None


def _numbers(line: str, other: str, found: Found, costs: bool) -> None:
    """Compare the numbers of two lines, in their order."""
    ours, theirs = list(NUMBER.finditer(line)), NUMBER.findall(other)
    if len(ours) != len(theirs):
        matcher = difflib.SequenceMatcher(None, [m.group() for m in ours], theirs, autojunk=False)
        kept = sum(block.size for block in matcher.get_matching_blocks())
        found.same += kept
        if kept < len(ours):
            found.moved.append(f"{line.strip()} -> {other.strip()}")
        return
    ends = {m.end(): m for m in ours}
    for match, new in zip(ours, theirs, strict=True):
        old = match.group()
        if old == new:
            found.same += 1
            continue
        behind = INTERVAL.match(line, match.end())
        said = f"{old} -> {new} in: {line.strip()}"
        if behind and ends:
            low, high = (_value(each) for each in behind.groups())
            if low <= _value(new) <= high:
                found.inside += 1
            else:
                found.left.append(said)
        elif not (costs and COST.search(line)):
            found.moved.append(said)


def _value(text: str) -> float:
    return float(text.replace(",", ""))


def run(name: str, item: dict[str, Any]) -> tuple[Found, float]:
    """Return what became of one item, and the minutes that it took.

    Raises:
        RuntimeError: the command failed.
    """
    words = shlex.split(item["command"])
    with tempfile.TemporaryDirectory() as folder:
        own = Path(sys.executable).with_name(words[0])
        began = time.perf_counter()
        out = ["--out", f"{folder}/run"] if item.get("out", True) else []
        done = subprocess.run(
            [str(own) if own.exists() else words[0], *words[1:], *out],
            capture_output=True,
            text=True,
            env=os.environ | {"COLUMNS": "80", "NO_COLOR": "1", "TERM": "dumb"},
            cwd=folder,
        )
        minutes = (time.perf_counter() - began) / 60
    if done.returncode:
        raise RuntimeError(
            f"{name}: {item['command']} ended with {done.returncode}: {done.stderr.strip()}"
        )
    return compared(block_of(item), done.stdout.split("\n"), item), minutes


def main(arguments: list[str] | None = None) -> int:
    """Run what is asked for, print a line each, and return the status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("names", nargs="*", help="items; all unless given")
    parser.add_argument("--quick", action="store_true", help="the subset that CI runs")
    parser.add_argument("--list", action="store_true", help="what there is, and what it costs")
    asked = parser.parse_args(arguments)
    items = tomllib.loads(PUBLISHED.read_text(encoding="utf-8"))
    unknown = [name for name in asked.names if name not in items]
    if unknown:
        parser.error(f"{unknown[0]} is unknown; choose from {', '.join(items)}")
    chosen = {
        name: item
        for name, item in items.items()
        if (name in asked.names if asked.names else item.get("quick", False) or not asked.quick)
    }
    print(f"{'item':20}{'min':>7}  {'same':>5}{'inside':>7}{'moved':>6}{'left':>5}  document")
    status = 0
    for name, item in chosen.items():
        if asked.list:
            quick = "quick" if item.get("quick", False) else ""
            print(f"{name:20}{item['minutes']:7.1f}  {quick:23}  {item['document']}")
            continue
        found, minutes = run(name, item)
        counts = f"{found.same:5}{found.inside:7}{len(found.moved):6}{len(found.left):5}"
        print(f"{name:20}{minutes:7.1f}  {counts}  {item['document']}", flush=True)
        for what, lines in (
            ("left", found.left),
            ("moved", found.moved),
            ("missing", found.missing),
        ):
            for line in lines:
                print(f"    {what}: {line}")
        status |= not found.holds
    return int(status)


if __name__ == "__main__":
    sys.exit(main())
