"""A run as its folder keeps it: question, answer, configuration, tables, figures, files.

>>> run = read(Path("runs/compare"))
>>> run.question, [frame.name for frame in run.frames]
('Do the same controllers behave the same ...', ['results.csv'])
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from flexsim.errors import RunError
from flexsim.files.reading import MIB
from studies.core.folder import CONFIG, CONFIG_MOST, TABLES
from studies.core.folders.marker import is_unfinished
from studies.report.entries import is_there, named, size_of, text_of
from studies.report.frames import CSV_MOST, PARQUET_MOST, Frame, first_rows, read_csv

RESULTS, RESULTS_CSV, STUDY, BATCHES = "results.parquet", "results.csv", "study.toml", "batches"
RESULT, GENERATIONS = "result.json", "generations.csv"
RESULT_MOST, TABLES_MOST = 1 * MIB, 16 * MIB
ROWS_SHOWN = 200  # of a table of single runs
TUNE = "tune"
NO_JSON = (ValueError, TypeError, KeyError, AttributeError, RecursionError)


class Shown(NamedTuple):
    """A table for reading, as the command printed it.

    Attributes:
        headings, units, numbers: of its columns; the last, whether they hold numbers.
        lines: cells.
    """

    title: str
    note: str
    headings: list[str]
    units: list[str]
    numbers: list[bool]
    lines: list[list[str]]


@dataclass(frozen=True, eq=False)
class Kept:
    """A run.

    Attributes:
        folder: as it was named. config: config.json. question, answer: empty if it keeps none.
        unfinished: in words, empty of a run that has ended. study_file: study.toml, if any.
        shown: tables for reading. frames: tables of its files. result: of a tuning.
        left_out: what was not read, and why.
    """

    folder: Path
    config: Mapping[str, Any]
    question: str
    answer: str
    unfinished: str
    shown: Sequence[Shown]
    frames: Sequence[Frame]
    result: Mapping[str, Any]
    study_file: Mapping[str, Any]
    left_out: Sequence[str]

    @property
    def command(self) -> list[str]:
        """The words of the command that made it."""
        return [str(word) for word in self.config["command"]]

    @property
    def study(self) -> str:
        """The name of that command."""
        return self.command[1] if len(self.command) > 1 else "unknown"

    def frame(self, name: str) -> Frame | None:
        """Return a file's table, None if there is none."""
        return next((each for each in self.frames if each.name == name), None)


def read(folder: Path) -> Kept:
    """Return a run.

    Raises:
        RunError: there is no such folder, it is none of a run, or a file in it is damaged.
    """
    if not folder.exists():
        raise RunError(f"there is no {folder}; give the folder of a run")
    if not folder.is_dir() or not is_there(folder / CONFIG):
        raise RunError(f"{folder} is no run (no {CONFIG} in it); give a folder that flexsim wrote")
    config = _config(folder / CONFIG)
    result = _result(folder)
    frames, left_out = _frames(folder)
    answer = str(config.get("answer") or result.get("answer") or "")
    question = str(config.get("question") or "")
    unfinished = _unfinished(folder, config, frames)
    shown = _shown(folder / TABLES) if is_there(folder / TABLES) else []
    best = _best(folder, result)
    if best:
        frames.append(_found(result))
    return Kept(
        *(folder, config, question, answer, unfinished, [*best, *shown], frames, result),
        _study(folder / STUDY),
        left_out,
    )


def _json(path: Path, most: int, what: str) -> dict[str, Any]:
    """Return a JSON object.

    Raises:
        RunError: it is none; the message has the line.
    """
    try:
        content = json.loads(text_of(path, most, what))
    except json.JSONDecodeError as error:
        raise RunError(f"{path}, line {error.lineno}: no JSON: {error.msg}") from None
    except (ValueError, RecursionError):
        raise RunError(f"{path}: no JSON: numbers too long, or nested too deeply") from None
    if not isinstance(content, dict):
        raise RunError(f"{path}: an object is wanted, not {type(content).__name__}")
    return content


def _config(path: Path) -> dict[str, Any]:
    """Return config.json, with what every run has in it."""
    content = _json(path, CONFIG_MOST, "configuration")
    for key, kind in (("command", list), ("configuration", dict), ("versions", dict)):
        if not isinstance(content.get(key), kind):
            raise RunError(f"{path}: no {key!r} in it; it is damaged, or of another program")
    return content


def _study(path: Path) -> dict[str, Any]:
    """Return a study file, nothing if there is none.

    Raises:
        RunError: it is no TOML; the message has the line.
    """
    if not is_there(path):
        return {}
    try:
        return tomllib.loads(text_of(path, TABLES_MOST, "study"))
    except tomllib.TOMLDecodeError as error:
        raise RunError(f"{path}: no TOML: {error}") from None
    except RecursionError:
        raise RunError(f"{path}: no TOML: nested too deeply") from None


def _result(folder: Path) -> dict[str, Any]:
    path = folder / RESULT
    return _json(path, RESULT_MOST, "result") if is_there(path) else {}


def _frames(folder: Path) -> tuple[list[Frame], list[str]]:
    """Return the tables of a run's files, and what of them is left out."""
    frames, left_out = [], []
    names = [path.name for path in named(folder, ".csv", within=False)]
    if is_there(folder / RESULTS):
        if size_of(folder / RESULTS) > PARQUET_MOST:
            left_out.append(f"{RESULTS}: more than {PARQUET_MOST:,} bytes")
        else:
            frames.append(first_rows(folder / RESULTS, ROWS_SHOWN))
        names = [name for name in names if name != RESULTS_CSV]  # the same rows once more
    for name in names:
        if size_of(folder / name) > CSV_MOST:
            left_out.append(f"{name}: more than {CSV_MOST:,} bytes")
        else:
            frames.append(read_csv(folder / name))
    return frames, left_out


def _unfinished(folder: Path, config: Mapping[str, Any], frames: Sequence[Frame]) -> str:
    """Return in words how far an unfinished run is, nothing of one that has ended."""
    command = [str(word) for word in config["command"]][1:2]
    if command == [TUNE] and not is_there(folder / RESULT):
        done = next((f for f in frames if f.name == GENERATIONS), None)
        kept = {row[0] for row in done.rows} if done is not None else set()
        return (
            f"This tuning is unfinished: {len(kept)} generations are kept, the last perhaps in "
            "part. What is below is of those; flexsim tune --resume goes on with it."
        )
    if is_unfinished(folder):
        batches = len(named(folder / BATCHES, ".arrow"))
        return (
            f"This run is unfinished: {batches} batches of runs are kept, and its results are not "
            "summed up yet. flexsim run --resume goes on with it."
        )
    return ""


def _shown(path: Path) -> list[Shown]:
    """Return the tables for reading.

    Raises:
        RunError: the file is damaged.
    """
    content = _json(path, TABLES_MOST, "tables")
    try:
        found = []
        for table in content["tables"]:
            columns, lines = table["columns"], table["lines"]
            if any(len(line) != len(columns) for line in lines):
                raise ValueError
            found.append(
                Shown(
                    str(table["title"]),
                    str(table["note"]),
                    [" ".join(str(each["heading"]).split()) for each in columns],
                    [" ".join(str(each["unit"]).split()) for each in columns],
                    [bool(each["number"]) for each in columns],
                    [[str(cell) for cell in line] for line in lines],
                )
            )
        return found
    except NO_JSON:
        raise RunError(f"{path}: not the tables that a run keeps; it is damaged") from None


def _found(result: Mapping[str, Any]) -> Frame:
    """Return the numbers of a tuning's result as a table, by their names."""
    numbers = [(k, v) for k, v in result.items() if isinstance(v, int | float)]
    rows = [[str(k), v] for k, v in [*numbers, *result["best_parameters_si"].items()]]
    return Frame(RESULT, ["name", "value"], rows, len(rows))


def _best(folder: Path, result: Mapping[str, Any]) -> list[Shown]:
    """Return the best parameters of a tuning as a table, none if there are none.

    Raises:
        RunError: the file is damaged.
    """
    drawn, si = result.get("best_parameters"), result.get("best_parameters_si")
    if not drawn or not si:
        return []
    try:
        lines = [[str(k), f"{float(drawn[k]):.6g}", f"{float(si[k]):.6g}"] for k in drawn]
    except NO_JSON:
        raise RunError(f"{folder / RESULT}: not what flexsim tune writes; it is damaged") from None
    heads = ["parameter", "time in ms", "SI"]
    units = ["", "N m ms^nu/rad", "N m s^nu/rad"]
    return [Shown("Best parameters", "", heads, units, [False, True, True], lines)]
