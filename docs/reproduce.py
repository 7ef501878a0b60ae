"""Make every number again that the documents quote, and say which left its interval.

    python docs/reproduce.py --list              # what there is, and what it costs
    python docs/reproduce.py --quick             # the subset that CI runs
    python docs/reproduce.py compare ladder      # some; all without names
    python docs/reproduce.py --resume            # what these sources have not yet printed

`published.toml` says which block, table or sentences of which document a command prints. The
command is run into a folder of its own in `runs/reproduce/` (`--out`), beside what it printed, and
the block looked for in that, line by line; of sentences, those that are printed in the document. A
number is `same`, digit for digit; `inside`, within the interval that stands behind the published
one; `moved`, another one that has no interval; or `left`. Lines that are not printed any more are
named. Ends with a table, and with status 1 if any number left its interval, a line is missing or a
command failed.
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
from itertools import chain
from pathlib import Path
from typing import Any

from studies.core.version import sources

ROOT = Path(__file__).parents[1]
PUBLISHED = Path(__file__).with_name("published.toml")
NUMBER = re.compile(r"(?<![\w.:])[-+]?(?:\d{1,3}(?:,\d{3})+|\d+)(?:\.\d+)?(?:e[-+]?\d+)?(?!\w)")
INTERVAL = re.compile(r"\s*\[\s*([-+\d.,e]+),\s*([-+\d.,e]+)\s*\]")
WIDTH = 80  # of a terminal; longer lines are wrapped in documents
ALIKE = 0.6  # of two lines' words: less is another line
GIVEN = "not-remade"  # what the documents have that no command prints, and why
MARKS = re.compile(r"\*\*|`|\[([^\]]*)\]\([^)]*\)")  # of markdown, in text


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


def items() -> dict[str, dict[str, Any]]:
    """Return what there is, by name."""
    found = tomllib.loads(PUBLISHED.read_text(encoding="utf-8"))
    return {name: item for name, item in found.items() if name != GIVEN}


def blocks(document: str) -> list[list[str]]:
    """Return the blocks of a document: fenced ones, and tables."""
    lines = (ROOT / document).read_text(encoding="utf-8").split("\n")
    found: list[list[str]] = []
    fenced = False
    for before, line in zip(["", *lines], lines, strict=False):
        if line.startswith("```"):
            fenced = not fenced
            if fenced:
                found.append([])
        elif fenced:
            found[-1].append(line)
        elif line.lstrip().startswith("|"):
            if not before.lstrip().startswith("|"):
                found.append([])
            found[-1].append(line.lstrip())
    return found


def block_of(item: Mapping[str, Any]) -> list[str]:
    """Return the lines of an item's block.

    Raises:
        ValueError: the document has no such block.
    """
    begun = [b for b in blocks(item["document"]) if any(item["begins"] in line for line in b)]
    which = item.get("occurrence", 1) - 1
    if which >= len(begun):
        raise ValueError(f"{item['document']} has no block that begins with {item['begins']!r}")
    block = begun[which]
    first = next(k for k, line in enumerate(block) if item["begins"] in line)
    behind = block[first + 1 :]
    ends = (k for k, line in enumerate(behind) if item.get("ends", "\n") in line)
    return [line for line in [block[first], *behind[: next(ends, len(behind))]] if line.strip()]


def text_of(document: str) -> str:
    """Return what a document says between its blocks, on one line, without markdown's marks."""
    lines = (ROOT / document).read_text(encoding="utf-8").split("\n")
    kept, fenced = [], False
    for line in lines:
        fenced ^= line.startswith("```")
        if not fenced and not line.lstrip().startswith(("```", "|")) and line[:4].strip():
            kept.append(line.removeprefix("- "))
    return " ".join(MARKS.sub(r"\1", " ".join(kept)).split())


def sentences_of(item: Mapping[str, Any], printed: list[str]) -> tuple[list[str], list[str]]:
    """Return the printed sentences as the document has them, and those that it has not."""
    text = text_of(item["document"])
    said, missing = [], []
    lines = [each for each in printed if not each.startswith("|")]
    for line in (" ".join(MARKS.sub(r"\1", each).split()) for each in lines):
        pattern = NUMBER.pattern.join(re.escape(part) for part in NUMBER.split(line))
        found = re.search(pattern, text) if line else None
        if found:
            said.append(found.group())
        elif line:
            missing.append(line)
    return said, missing


def compared(block: list[str], printed: list[str], item: Mapping[str, Any]) -> Found:
    """Return what became of a block's numbers in what was printed."""
    found = Found()
    of_machine = [re.compile(pattern) for pattern in item.get("machine", [])]
    block, printed = ([_without(line, of_machine) for line in lines] for lines in (block, printed))
    shapes = [_shape(line) for line in printed]
    at = 0
    for line in _unwrapped(block, shapes):
        if any(part in line for part in item.get("skip", [])) or not line.strip(" ─|-:"):
            continue
        near = _nearest(line, printed, shapes, at)
        if near is None:
            found.missing.append(line.strip())
            continue
        at = near + 1
        _numbers(line, printed[near], found)
    return found


def _without(line: str, parts: list[re.Pattern[str]]) -> str:
    """Return a line without what is the machine's."""
    for pattern in parts:
        line = pattern.sub("", line)
    return line


def _shape(line: str) -> str:
    return " ".join(NUMBER.sub("#", line).split())


def _unwrapped(block: list[str], shapes: list[str]) -> list[str]:
    """Return a block's lines, those joined again that are printed as one and wrapped in it."""
    longs = [shape.split() for shape in shapes if len(shape) > WIDTH]
    own = [_shape(line).split() for line in block]
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


def _numbers(line: str, other: str, found: Found) -> None:
    """Compare the numbers of two lines, in their order."""
    ours, theirs = list(NUMBER.finditer(line)), NUMBER.findall(other)
    if len(ours) != len(theirs):
        matcher = difflib.SequenceMatcher(None, [m.group() for m in ours], theirs, autojunk=False)
        kept = sum(block.size for block in matcher.get_matching_blocks())
        found.same += kept
        if kept < len(ours):
            found.moved.append(f"{line.strip()} -> {other.strip()}")
        return
    for match, new in zip(ours, theirs, strict=True):
        old = match.group()
        if old == new:
            found.same += 1
            continue
        behind = INTERVAL.match(line, match.end())
        said = f"{old} -> {new} in: {line.strip()}"
        if behind:
            low, high = (_value(each) for each in behind.groups())
            if low <= _value(new) <= high:
                found.inside += 1
            else:
                found.left.append(said)
        else:
            found.moved.append(said)


def _value(text: str) -> float:
    return float(text.replace(",", ""))


def printed_by(
    item: Mapping[str, Any], folder: Path, resume: bool, kept_as: str = "printed.txt"
) -> tuple[list[str], float]:
    """Return what an item's commands print, and the minutes that they took.

    Both are kept in the folder, beside the run; with `resume` what the same sources printed there
    is returned, and a run that goes on where it stopped does.

    Raises:
        RuntimeError: a command failed.
    """
    kept = folder / kept_as
    head = f"$ {item['command']}  # by sources {sources()}, "
    if resume and kept.is_file():
        first, *lines = kept.read_text(encoding="utf-8").split("\n")
        if first.startswith(head):
            return lines, float(first.removeprefix(head).removesuffix(" min"))
    folder.mkdir(parents=True, exist_ok=True)
    began = time.perf_counter()
    for command in item.get("before", []):
        _ran(command.format(root=ROOT), folder)
    command = item["command"].replace("{root}", str(ROOT))
    if command.startswith("python docs/"):
        command = command.replace("docs/", f"{shlex.quote(str(ROOT))}/docs/", 1)
    elif out := item.get("out", "run"):
        command += f" --out {shlex.quote(str(folder / out))}" + ("" if resume else " --force")
    said = _ran(command, folder)
    minutes = (time.perf_counter() - began) / 60
    kept.write_text(f"{head}{minutes:.1f} min\n{said}", encoding="utf-8")
    return said.split("\n"), minutes


def _ran(command: str, folder: Path) -> str:
    """Return what a line of a shell prints, run in a folder with our own programs first."""
    own = {"PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    own |= {"COLUMNS": "80", "NO_COLOR": "1", "TERM": "dumb"}
    done = subprocess.run(
        command, shell=True, capture_output=True, text=True, env=os.environ | own, cwd=folder
    )
    if done.returncode:
        said = done.stderr.strip().split("\n")[-1]
        raise RuntimeError(f"{command} ended with {done.returncode}: {said}")
    return done.stdout


def found_of(item: Mapping[str, Any], printed: list[str]) -> Found:
    """Return what became of the numbers of an item: a block's, or some sentences'."""
    if "said" in item:
        return _in_words(item, printed)
    if "prose" not in item:
        return compared(block_of(item), printed, item)
    said, missing = sentences_of(item, printed)
    found = compared(said, printed, item)
    there = {number for line in said for number in NUMBER.findall(line)}
    found.missing += missing + [f"a sentence with {n}" for n in item["prose"] if n not in there]
    return found


def words_of(item: Mapping[str, Any]) -> list[str]:
    """Return the words of a document whose numbers are made again, none of other items."""
    said = item.get("said", [])
    return [said] if isinstance(said, str) else list(said)


def _in_words(item: Mapping[str, Any], printed: list[str]) -> Found:
    """Return which numbers of what a document says are anywhere in what was printed."""
    found = Found()
    there = {_value(each) for line in printed for each in NUMBER.findall(line)}
    for words in words_of(item):
        if words not in text_of(item["document"]):
            raise ValueError(f"{item['document']} does not say {words!r}")
        for number in NUMBER.findall(words):
            if _value(number) in there:
                found.same += 1
            else:
                found.moved.append(f"{number} is not printed, in: {words}")
    return found


def reproduced(
    chosen: Mapping[str, Mapping[str, Any]], out: Path, resume: bool
) -> tuple[list[str], bool]:
    """Run items one after the other; return the table's rows, and whether all of them hold.

    What moved, left, is missing or failed is printed as it is found.
    """
    rows, holds, every = [], True, items()
    ran: dict[tuple[str, ...], list[str]] = {}

    def run_once(item: Mapping[str, Any], name: str) -> tuple[list[str], float]:
        asked, spent, place = (*item.get("before", []), item["command"]), 0.0, name
        if "of" in item:  # whose files it reads
            place = item["of"]
            spent = run_once(every[place], place)[1]
        if asked in ran:  # another block that the same command prints
            return ran[asked], spent
        own = f"-{name}" if "of" in item else ""
        ran[asked], minutes = printed_by(item, out / place, resume, f"printed{own}.txt")
        return ran[asked], spent + minutes

    for name, item in chosen.items():
        print(f"{name}: {item['command']} (some {item['minutes']:g} min)", file=sys.stderr)
        found, minutes = Found(), 0.0
        try:
            printed, minutes = run_once(item, name)
            found = found_of(item, printed)
        except (RuntimeError, ValueError) as error:
            found.failed.append(str(error))
        for what in ("moved", "left", "missing", "failed"):
            for line in getattr(found, what):
                print(f"{name} {what}: {line}", flush=True)
        counts = f"{found.same:5}{found.inside:7}{len(found.moved):6}{len(found.left):5}"
        said = "failed" if found.failed else f"{len(found.missing):7}"
        rows.append(f"{name:26}{minutes:7.1f}  {counts}{said:>8}  {item['document']}")
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
    every = items()
    unknown = [name for name in asked.names if name not in every]
    if unknown:
        parser.error(f"{unknown[0]} is unknown; choose from {', '.join(every)}")
    chosen = {
        name: item
        for name, item in every.items()
        if (name in asked.names if asked.names else item.get("quick", False) or not asked.quick)
    }
    if asked.list:
        print(f"{'item':26}{'min':>7}         document")
        for name, item in chosen.items():
            quick = "quick" if item.get("quick", False) else ""
            print(f"{name:26}{item['minutes']:7.1f}  {quick:5}  {item['document']}")
        return 0
    rows, holds = reproduced(chosen, asked.out.absolute(), asked.resume)
    counts = f"{'same':>5}{'inside':>7}{'moved':>6}{'left':>5}{'missing':>8}"
    print(f"\n{'item':26}{'min':>7}  {counts}  document")
    print("\n".join(rows))
    return int(not holds)


if __name__ == "__main__":
    sys.exit(main())
