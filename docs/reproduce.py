"""Make every number again that the documents quote, and say which left its interval.

    python docs/reproduce.py --list              # what there is, and what it costs
    python docs/reproduce.py --quick             # the subset that CI runs
    python docs/reproduce.py compare ladder      # some; all without names
    python docs/reproduce.py --resume            # what these sources have not yet printed

`published.toml` says which block, table or sentences of which document a command prints. The
command is run into a folder of its own in `runs/reproduce/` (`--out`), beside what it printed, and
the block looked for in that, line by line (`comparing.py`); of sentences, those that are printed in
the document. Ends with a table, and with status 1 if any number left its interval, a line is
missing or a command failed.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import re
import shlex
import subprocess
import sys
import time
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from comparing import NUMBER, Found, compared, in_words

from studies.core.version import sources

ROOT = Path(__file__).parents[1]
PUBLISHED = Path(__file__).with_name("published.toml")
GIVEN = "not-remade"  # what the documents have that no command prints, and why
DECIDE = ("docs/made/*", "models/*.xml", "studies/files/*", "controllers/*.toml")  # and sources
READ = re.compile(r"\{root\}/([\w./-]+)")  # of our files, by what is run before
INTERRUPTED = 130  # the status after Ctrl-C
MARKS = re.compile(r"\*\*|`|\[([^\]]*)\]\([^)]*\)")  # of markdown, in text


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


def paragraphs(document: str) -> list[str]:
    """Return what a document says between its blocks, by paragraphs and points of lists."""
    lines = (ROOT / document).read_text(encoding="utf-8").split("\n")
    found, fenced = [""], False
    for line in lines:
        fenced ^= line.startswith("```")
        beside = fenced or line.lstrip().startswith(("```", "|")) or not line[:4].strip()
        if beside or line.startswith(("- ", "#")):
            found.append("")
        if not beside:
            found[-1] += line.removeprefix("- ").removeprefix("> ") + "\n"
    return [each for each in found if each]


def plain(text: str) -> str:
    """Return a text on one line, without markdown's marks."""
    return " ".join(MARKS.sub(r"\1", text).split())


def text_of(document: str) -> str:
    """Return what a document says between its blocks, on one line, without markdown's marks."""
    return plain("\n".join(paragraphs(document)))


def sentences_of(item: Mapping[str, Any], printed: list[str]) -> tuple[list[str], list[str]]:
    """Return the printed sentences as the document has them, and those that it has not."""
    text = text_of(item["document"])
    said, missing = [], []
    lines = [each for each in printed if not each.startswith("|")]
    for line in map(plain, lines):
        pattern = NUMBER.pattern.join(re.escape(part) for part in NUMBER.split(line))
        found = re.search(pattern, text) if line else None
        if found:
            said.append(found.group())
        elif line:
            missing.append(line)
    return said, missing


def printed_by(
    item: Mapping[str, Any], folder: Path, resume: bool, kept_as: str = "printed.txt"
) -> tuple[list[str], float]:
    """Return what an item's commands print, and the minutes that they took.

    Both are kept in the folder, beside the run; with `resume` what the same sources printed there
    is returned, and a run that goes on where it stopped does.

    Raises:
        RuntimeError: a command failed. OSError: a folder cannot be written to.
    """
    kept = folder / kept_as
    head = f"$ {item['command']}  # by sources {_made_of(item)}, "
    if resume and kept.is_file():
        first, *lines = kept.read_text(encoding="utf-8").split("\n")
        if first.startswith(head):
            return lines, float(first.removeprefix(head).removesuffix(" min"))
    folder.mkdir(parents=True, exist_ok=True)
    began, root = time.perf_counter(), shlex.quote(str(ROOT))
    for command in item.get("before", []):
        _ran(command.format(root=root), folder)
    command = item["command"].replace("{root}", root)
    if command.startswith("python docs/"):
        command = command.replace("docs/", f"{root}/docs/", 1)
    elif out := item.get("out", "run"):
        command += f" --out {shlex.quote(str(folder / out))}" + ("" if resume else " --force")
    said = _ran(command, folder)
    minutes = (time.perf_counter() - began) / 60
    kept.write_text(f"{head}{minutes:.1f} min\n{said}", encoding="utf-8")
    return said.split("\n"), minutes


def _made_of(item: Mapping[str, Any]) -> str:
    """Return a digest of all that decides what an item prints."""
    digest = hashlib.sha256(f"{sources()} {item.get('before')}".encode())
    own = [path for pattern in DECIDE for path in ROOT.glob(pattern) if path.is_file()]
    read = [ROOT / path for each in item.get("before", []) for path in READ.findall(each)]
    for path in sorted({*own, *read}):
        digest.update(str(path.relative_to(ROOT)).encode() + path.read_bytes())
    return digest.hexdigest()[:16]


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
    """Return what became of the numbers of an item: a block's, or some sentences'.

    Raises:
        ValueError: the document has no such block or words.
    """
    if "said" in item:
        for words in words_of(item):
            if words not in text_of(item["document"]):
                raise ValueError(f"{item['document']} does not say {words!r}")
        return in_words(words_of(item), printed)
    if "prose" not in item:
        return compared(block_of(item), printed, item)
    sentences, missing = sentences_of(item, printed)
    found = compared(sentences, printed, item)
    there = {number for line in sentences for number in NUMBER.findall(line)}
    found.missing += missing + [f"a sentence with {n}" for n in item["prose"] if n not in there]
    return found


def words_of(item: Mapping[str, Any]) -> list[str]:
    """Return the words of a document whose numbers are made again, none of other items."""
    said = item.get("said", [])
    return [said] if isinstance(said, str) else list(said)


def asked_by(item: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the commands of an item: several may have blocks of what the same ones print."""
    return (*item.get("before", []), item["command"])


def reproduced(
    chosen: Mapping[str, Mapping[str, Any]], out: Path, resume: bool
) -> Iterator[tuple[str, bool]]:
    """Run items one after the other; give each one's row of the table, and whether it holds.

    What moved, left, is missing or failed is printed as it is found.
    """
    every = items()
    ran: dict[tuple[str, ...], list[str]] = {}

    def run_once(item: Mapping[str, Any], name: str) -> tuple[list[str], float]:
        asked, spent, place = asked_by(item), 0.0, name
        if "of" in item:  # whose files it reads
            place = item["of"]
            spent = run_once(every[place], place)[1]
        if asked in ran:  # another block that the same command prints
            return ran[asked], spent
        own = f"-{name}" if "of" in item else ""
        ran[asked], minutes = printed_by(item, out / place, resume, f"printed{own}.txt")
        return ran[asked], spent + minutes

    for name, item in chosen.items():
        cost = f"some {item['minutes']:g} min" if "minutes" in item else "once for all"
        print(f"{name}: {item['command']} ({cost})", file=sys.stderr)
        found, minutes = Found(), 0.0
        try:
            printed, minutes = run_once(item, name)
            found = found_of(item, printed)
            if not found.same + found.inside + len(found.moved + found.left + found.missing):
                found.missing.append("no number was compared")
        except (RuntimeError, ValueError, OSError) as error:
            found.failed.append(str(error))
        for what in ("moved", "left", "missing", "failed"):
            for line in getattr(found, what):
                print(f"{name} {what}: {line}", flush=True)
        counts = f"{found.same:5}{found.inside:7}{len(found.moved):6}{len(found.left):5}"
        said = "failed" if found.failed else f"{len(found.missing):7}"
        yield f"{name:26}{minutes:7.1f}  {counts}{said:>8}  {item['document']}", found.holds


def listed(chosen: Mapping[str, Mapping[str, Any]]) -> Iterator[str]:
    """Give the lines of the list: what there is, and what it costs."""
    first: dict[tuple[str, ...], str] = {}
    for name, item in items().items():
        first.setdefault(asked_by(item), name)
    yield f"{'item':26}{'min':>7}         document"
    for name, item in chosen.items():
        quick = "quick" if item.get("quick", False) else ""
        cost = f"{item['minutes']:.1f}" if "minutes" in item else ""
        beside = item.get("of") or first[asked_by(item)]
        more = "" if beside == name else f", with {beside}"
        yield f"{name:26}{cost:>7}  {quick:5}  {item['document']}{more}"


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
    if asked.names and asked.quick:
        parser.error("names and --quick contradict each other; give one of them")
    unknown = [name for name in asked.names if name not in every]
    if unknown:
        parser.error(f"{unknown[0]} is unknown; choose from {', '.join(every)}")
    chosen = {
        name: item
        for name, item in every.items()
        if (name in asked.names if asked.names else item.get("quick", False) or not asked.quick)
    }
    if asked.list:
        print("\n".join(listed(chosen)))
        return 0
    rows, status = [], 0
    try:
        for row, holds in reproduced(chosen, asked.out.absolute(), asked.resume):
            rows.append(row)
            status |= not holds
    except KeyboardInterrupt:
        status = INTERRUPTED
    counts = f"{'same':>5}{'inside':>7}{'moved':>6}{'left':>5}{'missing':>8}"
    print(f"\n{'item':26}{'min':>7}  {counts}  document")
    print("\n".join(rows))
    return int(status)


if __name__ == "__main__":
    sys.exit(main())
