"""Make every number again that the documents quote, and say which left its interval.

    python docs/reproduce.py --list              # what there is, and what it costs
    python docs/reproduce.py --quick             # the subset that CI runs
    python docs/reproduce.py compare ladder      # some; all without names
    python docs/reproduce.py --resume            # what these sources have not yet printed

`published.toml` says which block of which document a command prints. The command is run into a
folder of its own in `runs/reproduce/` (`--out`), beside what it printed, and the block looked for
in that, line by line. A number is `same`, digit for digit; `inside`, within the interval that
stands behind the published one; `moved`, another one that has no interval; or `left`. Lines that
are not printed any more are named. Ends with a table, and with status 1 if any number left its
interval, a line is missing or a command failed.
"""

from __future__ import annotations

import argparse
import difflib
import os
import re
import shlex
import subprocess
import sys
import time
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from studies.core.version import sources

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
    failed: list[str] = field(default_factory=list)

    @property
    def holds(self) -> bool:
        """Whether it was printed, nothing left its interval, and every line is there."""
        return not self.left and not self.missing and not self.failed


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


def printed_by(item: Mapping[str, Any], folder: Path, resume: bool) -> tuple[list[str], float]:
    """Return what an item's command prints, and the minutes that it took.

    Both are kept in `folder/printed.txt`, beside the run; with `resume` what the same sources
    printed there is returned, and a run that goes on where it stopped does.

    Raises:
        RuntimeError: the command failed.
    """
    kept = folder / "printed.txt"
    head = f"$ {item['command']}  # by sources {sources()}, "
    if resume and kept.is_file():
        first, *lines = kept.read_text(encoding="utf-8").split("\n")
        if first.startswith(head):
            return lines, float(first.removeprefix(head).removesuffix(" min"))
    folder.mkdir(parents=True, exist_ok=True)
    words = shlex.split(item["command"])
    own = Path(sys.executable).with_name(words[0])
    if out := item.get("out", "run"):
        words += ["--out", str(folder / out), *([] if resume else ["--force"])]
    began = time.perf_counter()
    done = subprocess.run(
        [str(own) if own.exists() else words[0], *words[1:]],
        capture_output=True,
        text=True,
        env=os.environ | {"COLUMNS": "80", "NO_COLOR": "1", "TERM": "dumb"},
        cwd=folder,
    )
    minutes = (time.perf_counter() - began) / 60
    if done.returncode:
        said = done.stderr.strip().split("\n")[-1]
        raise RuntimeError(f"{item['command']} ended with {done.returncode}: {said}")
    kept.write_text(f"{head}{minutes:.1f} min\n{done.stdout}", encoding="utf-8")
    return done.stdout.split("\n"), minutes


def reproduced(
    items: Mapping[str, Mapping[str, Any]], out: Path, resume: bool
) -> tuple[list[str], bool]:
    """Run items one after the other; return the table's rows, and whether all of them hold.

    What moved, left, is missing or failed is printed as it is found.
    """
    rows, holds = [], True
    for name, item in items.items():
        print(f"{name}: {item['command']} (some {item['minutes']:g} min)", file=sys.stderr)
        found, minutes = Found(), 0.0
        try:
            printed, minutes = printed_by(item, out / name, resume)
            found = compared(block_of(item), printed, item)
        except RuntimeError as error:
            found.failed.append(str(error))
        for what in ("moved", "left", "missing", "failed"):
            for line in getattr(found, what):
                print(f"{name} {what}: {line}", flush=True)
        counts = f"{found.same:5}{found.inside:7}{len(found.moved):6}{len(found.left):5}"
        said = "failed" if found.failed else f"{len(found.missing):7}"
        rows.append(f"{name:20}{minutes:7.1f}  {counts}{said:>8}  {item['document']}")
        holds &= found.holds
    return rows, holds


def main(arguments: list[str] | None = None) -> int:
    """Run what is asked for, print a table, and return the status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("names", nargs="*", help="items; all unless given")
    parser.add_argument("--quick", action="store_true", help="the subset that CI runs")
    parser.add_argument("--list", action="store_true", help="what there is, and what it costs")
    parser.add_argument("--out", type=Path, default=Path("runs/reproduce"), help="where runs go")
    parser.add_argument("--resume", action="store_true", help="keep what these sources printed")
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
    if asked.list:
        print(f"{'item':20}{'min':>7}         document")
        for name, item in chosen.items():
            quick = "quick" if item.get("quick", False) else ""
            print(f"{name:20}{item['minutes']:7.1f}  {quick:5}  {item['document']}")
        return 0
    rows, holds = reproduced(chosen, asked.out.absolute(), asked.resume)
    counts = f"{'same':>5}{'inside':>7}{'moved':>6}{'left':>5}{'missing':>8}"
    print(f"\n{'item':20}{'min':>7}  {counts}  document")
    print("\n".join(rows))
    return int(not holds)


if __name__ == "__main__":
    sys.exit(main())
