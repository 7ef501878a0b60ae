"""From a study file's text to a checked `Study`: what is wrong is one line with its path.

>>> given = read_study(Path("study.toml"), ["robot.zeta=0.002"])
>>> given.study.repeats, given.document["robots"]
(20, [{'zeta': 0.002}])
"""

from __future__ import annotations

import difflib
import textwrap
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from flexsim.errors import ParameterError
from flexsim.files.reading import MIB, read_text
from studies.core.text import one_line
from studies.spec.parts import JOINTS, LISTS, PARTS, NumbersPart, Study, SweepPart
from studies.spec.places import put, spelled

FILE_MOST = 16 * MIB
LIKE = 0.8  # how close a word is to one that was meant
SHOWN, LONGEST = 60, 300  # characters of a value in a message, and of what others say
USUAL = {"robots": {}, "settings": {"use": "simulink"}, "hardware": {"use": "ideal"}}
OF_SWEEP = ("sampler", "samples")
OF_NUMBER = tuple(
    item.alias or name for name, item in NumbersPart.model_fields.items()
)  # uniform, log-uniform, ...
WANTED = {
    "finite_number": "a finite number",  # and what else would do, by pydantic's name of the mistake
    "float_type": "a number",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "bool_type": "true or false",
    "string_type": "text in quotes",
    "list_type": "a list",
    "tuple_type": "a list",
    "dict_type": "a table",
    "model_type": "a table",
    "model_attributes_type": "a table",
    "union_tag_invalid": "a table",
}


@dataclass(frozen=True, eq=False)
class Given:
    """A study as its file gives it.

    Attributes:
        source: the file, for messages. folder: what its paths are relative to.
        document: the file's tables, names alone made tables. study: the same, typed.
    """

    source: str
    folder: Path
    document: dict[str, Any]
    study: Study


def read_study(path: Path, changes: Sequence[str] = (), quick: bool = False) -> Given:
    """Return a study file, read, changed and checked.

    Args:
        path: of the file. changes: 'path=value' each, the value as TOML has it, or bare text.
        quick: whether to cut it down to a first impression.

    Raises:
        RunError: it cannot be read.
        ParameterError: it is no TOML, or something in it will not do; one line, with its path.
    """
    text = read_text(path, FILE_MOST, "study file")
    try:
        document = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # also of numbers of thousands of digits
        raise ParameterError(f"{path}: not TOML: {_short(one_line(error))}") from None
    return given(document, str(path), path.parent, changes, quick)


def given(
    document: dict[str, Any],
    source: str,
    folder: Path,
    changes: Sequence[str] = (),
    quick: bool = False,
) -> Given:
    """Return a study of a file's tables; arguments and errors as `read_study`."""
    try:
        _normalise(document)
        for change in changes:
            _change(document, change)
        _normalise(document)
        _flatten(document)
        study = decoded(document)
        if quick:
            cut(document, study)
            study = decoded(document)
    except ParameterError as error:
        said, robots = str(error), document.get("robots")
        if isinstance(robots, list) and len(robots) == 1:
            said = said.replace("robots[0]", "robot")
        raise ParameterError(f"{source}: {said}") from None
    return Given(source, folder, document, study)


def decoded(document: Mapping[str, Any]) -> Study:
    """Return the typed study of a file's tables.

    Raises:
        ParameterError: something in it will not do; the first of all that is.
    """
    try:
        return Study.model_validate(document)
    except ValidationError as error:
        first, *others = error.errors(include_url=False)
        more = f" (and {len(others)} more)" if others else ""
        raise ParameterError(_said(first) + more) from None


def decoded_part(name: str, number: int, item: Mapping[str, Any]) -> Any:
    """Return the typed item of one of the file's lists.

    Raises:
        ParameterError: something in it will not do; its path begins in the item.
    """
    try:
        return PARTS[name].model_validate(item)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        said = _said({**first, "loc": (name, number, *first["loc"])})
        raise ParameterError(said.removeprefix(f"{name}[{number}].")) from None


def _normalise(document: dict[str, Any]) -> None:
    """Make `robot` the only one of `robots`, and tables of names that stand alone."""
    if "robot" in document:
        if "robots" in document:
            raise ParameterError("robot and robots are both given; leave one out")
        document["robots"] = [document.pop("robot")]
    for name, usual in USUAL.items():
        document.setdefault(name, [dict(usual)])
    for name, key in LISTS.items():
        items = document.get(name)
        if isinstance(items, list):
            document[name] = [{key: each} if isinstance(each, str) else each for each in items]


def _change(document: dict[str, Any], change: str) -> None:
    """Put what 'path=value' says into a file's tables."""
    path, equals, text = (each.strip() for each in change.partition("="))
    if not equals:
        raise ParameterError(f"--set {change}: give path=value, such as robot.zeta=0.002")
    try:
        value = tomllib.loads(f"x = {text}")["x"]
    except (ValueError, RecursionError):
        value = text  # a name without its quotes
    if path.startswith("sweep.") and path.removeprefix("sweep.") not in OF_SWEEP:
        _vary(document, path.removeprefix("sweep.").strip("'\""), value)
        return
    try:
        put(document, path, value)
    except ParameterError as error:
        raise ParameterError(f"--set {error}") from None


def _vary(document: dict[str, Any], path: str, value: Any) -> None:
    """Put what a number is varied over into a file's tables, under its path."""
    sweep = document.setdefault("sweep", {})
    _flatten(document)
    numbers = document["sweep"].pop("numbers") if isinstance(sweep, dict) else {}
    number, _, kind = path.rpartition(".")
    if kind in OF_NUMBER:
        path, value = number, {**numbers.get(number, {}), kind: value}
    document["sweep"] = {**document["sweep"], **numbers, path: value}


def _short(text: str) -> str:
    return text if len(text) <= LONGEST else f"{text[:LONGEST]} ..."


def _flatten(document: dict[str, Any]) -> None:
    """Gather a sweep's numbers, whose paths may be nested tables, by their paths."""
    sweep = document.get("sweep")
    if not isinstance(sweep, dict):
        return
    numbers: dict[str, Any] = {}

    def gather(node: Any, path: str) -> None:
        if isinstance(node, dict) and node and not set(node) & set(OF_NUMBER):
            for key, each in node.items():
                gather(each, f"{path}.{key}" if path else key)
            return
        last = path.rpartition(".")[2]
        if isinstance(node, list) and difflib.get_close_matches(last, OF_NUMBER, 1, LIKE):
            raise ParameterError(f"sweep.{path} is unknown; {choice(last, OF_NUMBER)}")
        if path in numbers:
            raise ParameterError(f"sweep.{path} is given twice; leave one out")
        numbers[path] = {"values": node} if isinstance(node, list) else node

    own = {key: each for key, each in sweep.items() if key in OF_SWEEP}
    for key, each in sweep.items():
        if key not in OF_SWEEP:
            gather(each, key)
    document["sweep"] = own | {"numbers": numbers}


def cut(document: dict[str, Any], study: Study) -> None:
    """Cut a study down: two repeats, both ends of a grid, eight samples, two checks."""
    for name, most in (("repeats", 2), ("check", 2)):
        document[name] = min(getattr(study, name), most)
    if study.sweep.numbers:
        sweep = document["sweep"]
        sweep["samples"] = min(study.sweep.samples, 8)
        for path, part in study.sweep.numbers.items():
            number = sweep["numbers"][path]
            for key, given in (("values", part.values), ("linear", part.linear), ("log", part.log)):
                if key == "values" and given is not None:
                    number[key] = list(dict.fromkeys([given[0], given[-1]])) if given else []
                elif given is not None:
                    number[key] = [*given[:2], min(given[2], 2)]


def _said(error: Mapping[str, Any]) -> str:
    """Return a mistake in words: its path, what was given, what would do."""
    where, model = _place(error["loc"])
    value, kind, context = error["input"], error["type"], error.get("ctx") or {}
    shown = textwrap.shorten(repr(value), SHOWN, placeholder=" ...")
    where = _short(where)
    if kind == "extra_forbidden":
        return f"{where} is unknown; {choice(str(error['loc'][-1]), _names(model))}"
    if kind == "missing":
        return f"{where} is missing; give it"
    if kind == "literal_error":
        known = [each.strip("' ") for each in context["expected"].replace(" or ", ",").split(",")]
        return f"{where} is {shown}; {choice(str(value), known)}"
    if kind in WANTED:
        return f"{where} is {shown}; give {WANTED[kind]}"
    if kind in ("too_long", "too_short"):
        wanted = context.get("max_length", context.get("min_length"))
        return f"{where} is {shown}; give {wanted} items"
    bounds = {"ge": "{} or more", "gt": "more than {}", "le": "{} at most", "lt": "less than {}"}
    for key, words in bounds.items():
        if key in context:
            bound = context[key]
            number = f"{bound:,}" if isinstance(bound, int) else f"{bound:g}"
            return f"{where} is {shown}; give {words.format(number)}"
    return f"{where} is {shown}; {error['msg'][:1].lower()}{error['msg'][1:]}"


def _place(loc: Sequence[str | int]) -> tuple[str, Any]:
    """Return where a mistake is, and the table that it is in."""
    model: Any = Study
    shown: list[str | int] = []
    for number, step in enumerate(loc):
        last = number == len(loc) - 1
        if step in JOINTS and shown and shown[-1] in ("joint1", "joint2"):
            model = JOINTS[str(step)]
        elif step == "numbers" and model is SweepPart:
            model = None
        elif step == "function-after" or (isinstance(step, str) and step.startswith("tuple[")):
            continue
        else:
            shown.append(step)
            if model is None and not last:
                model = NumbersPart
            elif step in PARTS:
                model = PARTS[str(step)]
            elif step == "sweep":
                model = SweepPart
    return spelled(tuple(shown)), model


def _names(model: Any) -> list[str]:
    """Return the keys that a table may have."""
    if model is None:
        return []
    if model is Study:
        return [*Study.model_fields, "robot"]
    return [item.alias or name for name, item in model.model_fields.items()]


def choice(given: str, known: Sequence[str]) -> str:
    """Return what may be chosen, and what is nearest to what was given."""
    close = difflib.get_close_matches(given, known, n=1)
    hint = f". Did you mean {close[0]}?" if close else ""
    return f"choose of {', '.join(known)}{hint}"
