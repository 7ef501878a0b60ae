"""Many named tuples of one kind as one, whose n-th compiled code takes out again.

>>> class Beam(NamedTuple):
...     mass: Array
...     step: float
>>> beams = stacked([Beam(np.ones(3), 1e-3), Beam(np.zeros(5), 5e-4)])
>>> nth(beams.items, beams.first, 1)
Beam(mass=array([0., 0., 0., 0., 0.]), step=0.0005)

Arrays lie end to end along their first axis, which may be of another length in each. Numbers lie in
two tables, of floats and of whole numbers: each array of its own would cost compiled code of many
threads most of its compilation.
"""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Sequence
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
from numba.extending import overload
from numpy.typing import NDArray

from flexsim.errors import ParameterError

Item = TypeVar("Item", bound=tuple[Any, ...])

FLOATS, WHOLES, FLAGS, ARRAY = "float", "int", "bool", "array"  # as fields are annotated
TABLES = ("floats", "wholes")  # the first fields of a stack
PREFIX, JOINT = "Stack__", "__"  # of a stack's name, which has its kind's place in it

_STACKS: dict[type, type] = {}  # by kind
_KINDS: dict[type, type] = {}  # by stack


class Stacked(NamedTuple, Generic[Item]):
    """R items of one kind.

    Attributes:
        items: a stack of that kind: tables of numbers (R, F) and (R, W), then arrays end to end.
        first: (A, R+1) where in each of A arrays each item begins.
    """

    items: Any
    first: NDArray[np.int64]


def parts_of(kind: type) -> tuple[str, ...]:
    """Return what each field of a kind is: float, int, bool, or else an array."""
    hints = inspect.get_annotations(kind)
    words = (_word(hints[name]) for name in kind._fields)  # type: ignore[attr-defined]
    return tuple(word if word in (FLOATS, WHOLES, FLAGS) else ARRAY for word in words)


def _word(hint: Any) -> str:
    """Return a field's annotation as it is written, a type or the name of one."""
    for name in ("__forward_arg__", "__name__"):
        if hasattr(hint, name):
            return str(getattr(hint, name))
    return str(hint)


def stack_of(kind: type) -> type:
    """Return the class of stacks of a kind, found again by its name in another process."""
    if kind not in _STACKS:
        names = [
            name
            for name, part in zip(kind._fields, parts_of(kind), strict=True)  # type: ignore[attr-defined]
            if part == ARRAY
        ]
        place = JOINT.join([*kind.__module__.split("."), kind.__name__])
        fields = [(name, Any) for name in (*TABLES, *names)]
        made: Any = NamedTuple(PREFIX + place, fields)  # type: ignore[misc]
        made.__module__ = __name__
        made.kind = kind  # type: ignore[attr-defined]
        _STACKS[kind], _KINDS[made] = made, kind
        globals()[made.__name__] = made
    return _STACKS[kind]


def __getattr__(name: str) -> Any:
    """Return the class of stacks of this name, for code that was cached by another process."""
    if not name.startswith(PREFIX):
        raise AttributeError(f"module {__name__} has no attribute {name}")
    *module, kind = name.removeprefix(PREFIX).split(JOINT)
    return stack_of(getattr(importlib.import_module(".".join(module)), kind))


def stacked(items: Sequence[Item]) -> Stacked[Item]:
    """Return named tuples of one kind as one.

    Raises:
        ParameterError: they are not of one kind, or their arrays differ beyond the first axis.
    """
    kind = type(items[0])
    if any(type(each) is not kind for each in items):
        raise ParameterError(f"{kind.__name__}: only items of one kind can be stacked")
    parts = parts_of(kind)
    floats: list[Any] = []
    wholes: list[Any] = []
    arrays: list[Any] = []
    for part, column in zip(parts, zip(*items, strict=True), strict=True):
        if any(isinstance(each, np.ndarray) for each in column) != (part == ARRAY):
            raise ParameterError(f"{kind.__name__}: only items of one kind can be stacked")
        if part == ARRAY:
            if len({each.shape[1:] for each in column}) > 1:
                raise ParameterError(
                    f"{kind.__name__}: arrays of different sizes cannot be stacked"
                )
            arrays.append(column)
        else:
            (floats if part == FLOATS else wholes).append(column)
    first = np.zeros((len(arrays), len(items) + 1), dtype=np.int64)
    for row, column in zip(first, arrays, strict=True):
        row[1:] = np.cumsum([len(each) for each in column])
    whole = [
        np.ascontiguousarray(column[0]) if len(column) == 1 else np.concatenate(column)
        for column in arrays
    ]
    return Stacked(stack_of(kind)(*_tables(len(items), floats, wholes), *whole), first)


def _tables(
    count: int, floats: list[Any], wholes: list[Any]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return columns of numbers as tables (R, F), (R, W)."""
    return (
        np.array(floats, dtype=float).reshape(len(floats), count).T.copy(),
        np.array(wholes, dtype=np.int64).reshape(len(wholes), count).T.copy(),
    )


def _readings(kind: type) -> list[str]:
    """Return for each field of a kind how it is taken out of `items` and `first` at i."""
    found, counts = [], {FLOATS: 0, WHOLES: 0, ARRAY: 0}
    for name, part in zip(kind._fields, parts_of(kind), strict=True):  # type: ignore[attr-defined]
        table = WHOLES if part == FLAGS else part
        j = counts[table]
        counts[table] += 1
        if part == ARRAY:
            found.append(f"items.{name}[first[{j}, i] : first[{j}, i + 1]]")
        elif part == FLAGS:
            found.append(f"items.wholes[i, {j}] != 0")
        else:
            found.append(f"items.{part}s[i, {j}]".replace("ints", "wholes"))
    return found


def _taker(kind: type) -> Any:
    """Return the function (items, first, i) that gives the i-th item of a kind."""
    names: dict[str, Any] = {"kind": kind}  # numba has no loop over fields of different types
    exec(f"def taken(items, first, i):\n    return kind({', '.join(_readings(kind))})", names)
    return names["taken"]


def nth(items: Any, first: NDArray[np.int64], i: int) -> Any:
    """Return the i-th of stacked items, its arrays views."""
    return _taker(_KINDS[type(items)])(items, first, i)


@overload(nth, jit_options={"forceinline": True})
def _nth(items, first, i):  # type: ignore[no-untyped-def]
    return _taker(_KINDS[items.instance_class])


def indexed(values: Sequence[Any]) -> tuple[list[Any], NDArray[np.int64]]:
    """Return the different ones of some objects, and which of them each is (R,)."""
    places: dict[int, int] = {}
    kept: list[Any] = []
    index = np.empty(len(values), dtype=np.int64)
    for i, value in enumerate(values):
        place = places.setdefault(id(value), len(kept))
        if place == len(kept):
            kept.append(value)
        index[i] = place
    return kept, index
