"""The page: one file of HTML with its styles, scripts, figures and tables in it.

>>> html = page([read(Path("runs/compare"))])
>>> html.startswith(MARK)
True

What comes from runs is text in it, escaped by the template; scripts are ours alone, named by their
digests to the browser, which runs no others and fetches nothing.
"""

from __future__ import annotations

import base64
import hashlib
import importlib.resources
import json
import math
import shlex
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from jinja2 import Environment, FunctionLoader, StrictUndefined
from markupsafe import Markup
from plotly.offline import get_plotlyjs

from studies.core.figures import raised
from studies.report.charts import Chart, interval_chart
from studies.report.courses import courses
from studies.report.differences import differences, named, numbers
from studies.report.images import Picture, Text, pictures_of, texts_of
from studies.report.kept import STUDY, Kept
from studies.report.names import in_words
from studies.report.points import points_of
from studies.report.sheets import Cell, Head, Sheet, of_frame, of_shown, short

MARK = "<!DOCTYPE html>\n<!-- flexsim report -->\n"
TEMPLATE, STYLE, SCRIPTS = "page.html", "page.css", ("tables.js", "figures.js")
POLICY = (
    "default-src 'none'; script-src {}; style-src 'unsafe-inline'; img-src data: blob:; "
    "base-uri 'none'; form-action 'none'"
)
CONTROLS = {i: None for i in (*range(32), *range(127, 160)) if i not in (9, 10)}


class Part(NamedTuple):
    """What the page says of a run.

    Attributes:
        key, name: of its section. run: as named. answer: in lines. tables: for reading;
        whole: all columns. charts, pictures, texts: as named. facts: how to do it again.
        hardware: in words. command: as it was given; again: another that repeats a study file's
        run; dirty: whether its sources had changes that no commit has. left_out: in words.
    """

    key: str
    name: str
    run: Kept
    answer: str
    tables: Sequence[Sheet]
    whole: Sequence[Sheet]
    charts: Sequence[Chart]
    pictures: Sequence[Picture]
    texts: Sequence[Text]
    facts: Sheet
    hardware: str
    command: str
    again: str
    dirty: bool
    left_out: Sequence[str]


def part_of(run: Kept, number: int) -> Part:
    """Return what the page says of a run.

    Raises:
        RunError: a file of it is damaged.
    """
    key = f"run-{number}"
    pictures, no_pictures = pictures_of(run.folder)
    texts, no_texts = texts_of(run.folder)
    left_out = [
        *run.left_out,
        *no_pictures,
        *(f"{each}, not to be saved here" for each in no_texts),
    ]
    return Part(
        key,
        str(run.folder),
        run,
        run.answer.strip(),
        [of_shown(each) for each in run.shown],
        [of_frame(each) for each in run.frames],
        _charts(run, key),
        pictures,
        texts,
        _facts(run),
        hardware if isinstance(hardware := run.config.get("hardware"), str) else "",
        shlex.join(run.command),
        shlex.join(["flexsim", "run", str(run.folder / STUDY)]) if run.study_file else "",
        "-dirty" in str(run.config.get("machine")),
        left_out,
    )


def _charts(run: Kept, key: str) -> list[Chart]:
    """Return the figures of a run: medians with intervals of every table, courses."""
    found = []
    for i, frame in enumerate(run.frames, 1):
        points = [each for each in points_of(frame) if each.value is not None]
        if points:
            found.append(interval_chart(f"{key}-intervals-{i}", f"Intervals: {frame.name}", points))
    return [*found, *courses(run, key)]


def _facts(run: Kept) -> Sheet:
    """Return what it takes to carry a run out again."""
    config = run.config
    machine = config.get("machine")
    machine = machine if isinstance(machine, Mapping) else {}
    own = {
        "version": machine.get("version", "unknown"),
        "sources": machine.get("sources", config["versions"].get("sources", "unknown")),
        "seed": config["configuration"].get("seed", run.study_file.get("seed", "none")),
        **config["versions"],
        **{name: value for name, value in machine.items() if name not in ("version", "sources")},
    }
    rows = [[Cell(in_words(str(name))), Cell(short(value))] for name, value in own.items()]
    return Sheet("", "", [Head("what", "", "", False), Head("value", "", "", False)], rows)


def clean(value: object) -> object:
    """Return a text without control characters and lone halves of characters."""
    if isinstance(value, Markup) or not isinstance(value, str):
        return value
    return value.translate(CONTROLS).encode("utf-8", "replace").decode()


def sorted_by(cell: Cell) -> str:
    """Return what a cell is sorted by, as the page's script reads it; empty for text."""
    if cell.key is None:
        return ""
    return repr(cell.key) if math.isfinite(cell.key) else f"{'-' * (cell.key < 0)}Infinity"


def page(runs: Sequence[Kept]) -> str:
    """Return the page about one or several runs.

    Raises:
        RunError: a file of a run is damaged.
    """
    parts = [part_of(run, i) for i, run in enumerate(runs, 1)]
    several = len(runs) > 1
    between = differences(runs) if several else []
    pairs = list(numbers(runs)) if several else []
    charts = [chart for _, chart in pairs if chart] + [c for part in parts for c in part.charts]
    scripts = [_own(name) for name in SCRIPTS]
    if charts:
        scripts.insert(0, get_plotlyjs())
    content = {
        "title": parts[0].run.question or f"Run {parts[0].name}",
        "names": named(runs),
        "parts": parts,
        "several": several,
        "differences": between,
        "pairs": pairs,
        "figures": _data({chart.key: chart.figure for chart in charts}),
        "scripts": [Markup(each) for each in scripts],  # ours and plotly's, no run's
        "style": Markup(_own(STYLE)),
        "policy": POLICY.format(" ".join(map(_digest, scripts))),
    }
    return MARK + _environment().get_template(TEMPLATE).render(content) + "\n"


def _environment() -> Environment:
    made = Environment(
        loader=FunctionLoader(_own),
        autoescape=True,
        undefined=StrictUndefined,
        finalize=clean,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters["sorted_by"] = sorted_by
    made.filters["raised"] = raised
    return made


def _own(name: str) -> str:
    """Return the text of a file beside this one."""
    return (importlib.resources.files(__package__) / name).read_text(encoding="utf-8")


def _digest(script: str) -> str:
    """Return the name by which the browser knows a script."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"


def _data(content: Mapping[str, Any]) -> Markup:
    """Return JSON that ends no element and begins none, wherever it stands in the page."""
    text = json.dumps(content, allow_nan=False, separators=(",", ":"))
    for character in "<>&\u2028\u2029":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return Markup(text)
