"""Numbers of a laboratory's parts: each with unit, source, meaning; checked alike; given as text.

>>> given_parts(["gear=50,50"], (Sensing(), JointEffects()))[0].gear
(50.0, 50.0)

Study files name the same numbers in a table of `hardware`.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Sequence
from dataclasses import field, fields, replace
from numbers import Real
from typing import Any

from flexsim.errors import ParameterError


def part(
    default: Any,
    unit: str,
    meaning: str,
    source: str = "assumed",
    low: float = 0.0,
    high: float = math.inf,
    above: bool = False,
) -> Any:
    """Return a dataclass field of a part: a number or a tuple of numbers.

    Args:
        default: with which the part is not there, or of no effect. unit: SI, '-' for none.
        meaning: one line. source: of numbers that one may give, or 'assumed'.
        low, high: what it may be; above: whether `low` itself may not.
    """
    metadata: dict[str, Any] = {"unit": unit, "meaning": meaning, "source": source}
    metadata |= {"low": low, "high": high, "above": above}
    return field(default=default, metadata=metadata)


def word(default: str, choices: Sequence[str], meaning: str) -> Any:
    """Return a dataclass field of a part that is a word; one with a colon has a number behind it.

    Args:
        choices: what it may be, 'kalman:' with any text behind. meaning: one line.
    """
    about = {"unit": "-", "meaning": meaning, "source": "assumed", "choices": tuple(choices)}
    return field(default=default, metadata=about)


def _check_word(name: str, value: Any, about: Any) -> None:
    """Refuse a word that is none of a field's.

    Raises:
        ParameterError: names those that there are.
    """
    good = isinstance(value, str) and any(
        value == each or (each.endswith(":") and value.startswith(each))
        for each in about["choices"]
    )
    if not good:
        known = ", ".join(each + "n" * each.endswith(":") for each in about["choices"])
        raise ParameterError(
            f"hardware {name} ({about['meaning']}) is {value}; choose one of {known}"
        )


def part_rows(*kinds: type) -> list[tuple[str, str, str, str, str]]:
    """Return name, unit, default, meaning and source of every number of parts, for tables."""
    return [
        (
            item.name,
            item.metadata.get("unit", "-"),
            _words(item.default),
            item.metadata["meaning"],
            item.metadata.get("source", "assumed"),
        )
        for kind in kinds
        for item in fields(kind)
    ]


def part_table(*kinds: type) -> str:
    """Return the numbers of parts as a table in Markdown."""
    head = ("number", "unit", "off", "meaning", "source")
    rows = [head, ("---",) * len(head), *part_rows(*kinds)]
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)


def check_parts(given: Any) -> None:
    """Refuse a part's number that is none, not finite or out of its range.

    Raises:
        ParameterError: names the number, what was given and what would do.
    """
    for item in fields(given):
        value, about = getattr(given, item.name), item.metadata
        usual: Any = item.default
        if "choices" in about:
            _check_word(item.name, value, about)
        if "low" not in about:
            continue
        many = isinstance(usual, tuple)
        numbers = value if many and isinstance(value, tuple) else (value,)
        low, high, above = about["low"], about["high"], about["above"]
        good = isinstance(value, tuple) == many and len(numbers) == len(usual if many else (0,))
        for each in numbers:
            real = isinstance(each, Real) and not isinstance(each, bool)
            good = good and real and math.isfinite(each) and low <= each <= high
            good = good and not (above and each == low)
        if not good:
            raise ParameterError(
                f"hardware {item.name} ({about['meaning']}) is {value}; give "
                f"{len(usual) if many else 'a'} finite number{'s' * many} "
                f"{range_words(about)} [{about['unit']}]"
            )


def range_words(about: Any) -> str:
    """Return in words what a part's number may be."""
    low, high = about["low"], about["high"]
    if low == -math.inf:
        return "of any size" if high == math.inf else f"up to {high:g}"
    least = f"above {low:g}" if about["above"] else f"from {low:g}"
    return least if high == math.inf else f"{least} to {high:g}"


def changed_words(given: Any) -> list[str]:
    """Return in words what of a part is not as usual."""
    return [
        f"{item.name.replace('_', ' ')} {_words(getattr(given, item.name))}"
        + (f" {unit}" if (unit := item.metadata.get("unit", "-")) != "-" else "")
        for item in fields(given)
        if getattr(given, item.name) != item.default
    ]


def _words(value: Any) -> str:
    if isinstance(value, tuple):
        return " and ".join(map(_words, value))
    return value if isinstance(value, str) else f"{value:g}"


def given_parts(texts: Sequence[str], usual: Sequence[Any]) -> tuple[Any, ...]:
    """Return parts with the numbers that texts such as 'gear=50,50' give.

    Args:
        texts: NAME=VALUE, of a pair VALUE,VALUE; a single VALUE stands for both of a pair.
        usual: the parts as they are without.

    Raises:
        ParameterError: no NAME=VALUE, a name that there is not or twice, or no number.
    """
    owners = {item.name: (i, item) for i, each in enumerate(usual) for item in fields(each)}
    changes: list[dict[str, Any]] = [{} for _ in usual]
    for text in texts:
        name, equals, value = text.partition("=")
        name = name.strip()
        if not equals:
            raise ParameterError(f"--hardware-with {text}: give NAME=VALUE, as ripple=0.02,0.02")
        if name not in owners:
            near = difflib.get_close_matches(name, owners, n=1)
            hint = f"; did you mean {near[0]}?" if near else ""
            raise ParameterError(
                f"--hardware-with {text}: {name!r} is unknown; choose one of "
                f"{', '.join(owners)}{hint}"
            )
        at, item = owners[name]
        if name in changes[at]:
            raise ParameterError(f"--hardware-with gives {name} twice; give it once")
        changes[at][name] = _value(text, value, item.default)
    return tuple(replace(each, **own) for each, own in zip(usual, changes, strict=True))


def _value(text: str, value: str, usual: Any) -> Any:
    """Return a value as text in the form that its default has."""
    if isinstance(usual, str):
        return value.strip()
    try:
        numbers = tuple(map(float, value.split(",")))
    except ValueError:
        raise ParameterError(f"--hardware-with {text}: {value!r} is no number") from None
    if not isinstance(usual, tuple):
        return numbers[0] if len(numbers) == 1 else numbers
    return numbers * len(usual) if len(numbers) == 1 else numbers
