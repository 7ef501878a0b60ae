"""Many named tuples of one kind as one, whose n-th compiled code takes out again.

>>> class Beam(NamedTuple):
...     mass: Array
...     step: float
>>> beams = stacked([Beam(np.ones(3), 1e-3), Beam(np.zeros(5), 5e-4)])
>>> nth(beams.items, beams.first, 1)
Beam(mass=array([0., 0., 0., 0., 0.]), step=0.0005)

Arrays lie end to end along their first axis, which may be of another length in each.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
from numba.extending import overload
from numpy.typing import NDArray

from flexsim.errors import ParameterError

Item = TypeVar("Item", bound=tuple[Any, ...])

_ARRAYS: dict[type, tuple[bool, ...]] = {}  # which fields of a kind are arrays


class Stacked(NamedTuple, Generic[Item]):
    """R items of one kind.

    Attributes:
        items: of that kind, with arrays end to end, and (R,) for each number.
        first: (fields, R+1) where in the array of a field each item begins.
    """

    items: Item
    first: NDArray[np.int64]


def stacked(items: Sequence[Item]) -> Stacked[Item]:
    """Return named tuples of one kind as one.

    Raises:
        ParameterError: they are not of one kind, or their arrays differ beyond the first axis.
    """
    kind = type(items[0])
    arrays = tuple(isinstance(field, np.ndarray) for field in items[0])
    if any(type(each) is not kind for each in items) or _ARRAYS.setdefault(kind, arrays) != arrays:
        raise ParameterError(f"{kind.__name__}: only items of one kind can be stacked")
    first = np.zeros((len(arrays), len(items) + 1), dtype=np.int64)
    columns: list[Any] = []
    for i, column in enumerate(zip(*items, strict=True)):
        if not arrays[i]:
            columns.append(np.array(column))
            continue
        if len({each.shape[1:] for each in column}) > 1:
            raise ParameterError(f"{kind.__name__}: arrays of different sizes cannot be stacked")
        first[i, 1:] = np.cumsum([len(each) for each in column])
        one = np.ascontiguousarray(column[0])
        columns.append(one if len(column) == 1 else np.concatenate(column))
    return Stacked(kind(*columns), first)


def nth(items: Any, first: NDArray[np.int64], i: int) -> Any:
    """Return the i-th of stacked items, its arrays views."""
    fields = zip(items, _ARRAYS[type(items)], strict=True)
    return type(items)(
        *(
            field[first[j, i] : first[j, i + 1]] if is_array else field[i]
            for j, (field, is_array) in enumerate(fields)
        )
    )


@overload(nth, jit_options={"forceinline": True})
def _nth(items, first, i):  # type: ignore[no-untyped-def]
    kind = items.instance_class
    fields = (
        f"items.{name}[first[{j}, i] : first[{j}, i + 1]]" if is_array else f"items.{name}[i]"
        for j, (name, is_array) in enumerate(zip(kind._fields, _ARRAYS[kind], strict=True))
    )
    names: dict[str, Any] = {"kind": kind}  # numba has no loop over fields of different types
    exec(f"def taken(items, first, i):\n    return kind({', '.join(fields)})", names)
    return names["taken"]


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
