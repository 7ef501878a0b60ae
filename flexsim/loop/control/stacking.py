"""Controllers of any linear kind, read by their type and made ready for the compiled loop.

A controller is one of these:

- the controllers of both joints as a pair, each on its own error, in any of the ways that
  `flexsim.loop.control.linear_kinds` lists: `(b, a)`, sections, zeros and poles, `dlti`, ...;
- one state space for both joints, (A, B, C, D), `dlti` or python-control's, from the errors
  (e1, e2), or from (e1, e2, v), to the torques of both joints. The second error has v in it
  already, with the loop's `v_gain`; with `v_gain=0` the state space alone decides on v;
- an object with `filters(period)`, such as those of the package `controllers`.

>>> import numpy as np
>>> from scipy import signal
>>> from flexsim.loop.control.stacking import stack
>>> lead = (np.array([300.0, -290.0]), np.array([1.0, -0.6]))      # (b, a), powers of 1/z
>>> notch = signal.butter(4, [60, 80], "bandstop", fs=1000, output="sos")         # (4, 6)
>>> smooth = signal.dlti([0.1], [1.0, -0.9], dt=1e-3)
>>> stack([(lead, notch), (smooth, lead)], period=1e-3).b.shape
(2, 2, 1, 4, 3)

Two errors and v to two torques, where v has a path of its own:

>>> D = np.array([[300.0, 0.0, 0.0], [0.0, 3.0, -2.0]])            # [N m/rad], [N m/m]
>>> stack([(np.zeros((0, 0)), np.zeros((0, 3)), np.zeros((2, 0)), D)], period=1e-3).D.shape
(1, 2, 3)
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexsim.errors import ParameterError
from flexsim.loop.control.compiled import MEASURED, Controllers
from flexsim.loop.control.linear_kinds import (
    Branches,
    Filter,
    Space,
    kind_of,
    one_input,
    whole_space,
)
from flexsim.numerics.types import Array

JOINTS = 2
PASS: Filter = (np.ones(1), np.ones(1))
NOTHING: Filter = (np.zeros(1), np.ones(1))


@dataclass(frozen=True, eq=False)
class _Read:
    """One controller as read: branches per joint, and a state space from (e1, e2, v)."""

    branches: tuple[Branches, Branches]
    space: Space | None = None


def stack(controllers: Sequence[Any], period: float) -> Controllers:
    """Return controllers of any linear kind, mixed as one likes, ready for the compiled loop.

    Args:
        controllers: P of them, see the module's docstring.
        period: the loop's [s]; what knows its own sampling period must have this one.

    Raises:
        ParameterError: there is none; a kind, shape or sampling period cannot be used; or a
            number is complex, not finite, or an a[0] of zero.
    """
    given = list(controllers) if isinstance(controllers, Iterable) else []
    if not given:
        raise ParameterError("give one controller or more, each as ((b1, a1), (b2, a2))")
    read = [_read(each, i, period) for i, each in enumerate(given)]
    branches = max(len(joint) for each in read for joint in each.branches)
    sections = max(len(cascade) for each in read for joint in each.branches for cascade in joint)
    width = max(
        len(part)
        for each in read
        for joint in each.branches
        for cascade in joint
        for pair in cascade
        for part in pair
    )
    b, a = np.zeros((2, len(read), JOINTS, branches, sections, width))
    a[..., 0] = 1.0
    b[..., 1:, 0] = 1.0  # all sections but the first of a missing branch pass its zero
    for i, each in enumerate(read):
        for j, joint in enumerate(each.branches):
            for k, cascade in enumerate(joint):
                for s, (numerator, denominator) in enumerate(cascade):
                    b[i, j, k, s, 0] = 0.0
                    b[i, j, k, s, : len(numerator)] = numerator
                    a[i, j, k, s, : len(denominator)] = denominator
    return Controllers(b, a, *_spaces([each.space for each in read]))


def _spaces(spaces: Sequence[Space | None]) -> tuple[Array, Array, Array, Array]:
    """Return state spaces as A, B, C, D with as many states each, 0 where there is none."""
    P = len(spaces)
    n = max((max(len(each.A), 1) for each in spaces if each is not None), default=0)
    A, B = np.zeros((P, n, n)), np.zeros((P, n, MEASURED))
    C, D = np.zeros((P, JOINTS, n)), np.zeros((P, JOINTS, MEASURED))
    for i, each in enumerate(spaces):
        if each is not None:
            own = len(each.A)
            A[i, :own, :own], B[i, :own], C[i, :, :own], D[i] = each.A, each.B, each.C, each.D
    return A, B, C, D


def _read(given: Any, i: int, period: float) -> _Read:
    """Return controller i as read."""
    if callable(getattr(given, "filters", None)):
        return _read(given.filters(period), i, period)
    if isinstance(given, tuple | list) and len(given) == JOINTS:
        return _pair(given, i, period)
    try:
        space = whole_space(given, period)
    except ParameterError as error:
        raise ParameterError(f"controller {i} cannot be used: {error}") from None
    return _Read(([[NOTHING]], [[NOTHING]]), space)


def _pair(given: Sequence[Any], i: int, period: float) -> _Read:
    """Return controller i, given as those of the joints."""
    branches: list[Branches] = []
    spaces: list[tuple[int, Space]] = []
    for j, each in enumerate(given):
        try:
            found = kind_of(each, period)
            if isinstance(found, Space):
                spaces.append((j, one_input(found)))
                found = [[NOTHING]]
        except ParameterError as error:
            where = f"filter {j + 1} of controller {i}"
            raise ParameterError(f"{where} cannot be used: {error}") from None
        branches.append(found)
    return _Read((branches[0], branches[1]), _side_by_side(spaces) if spaces else None)


def _side_by_side(spaces: Sequence[tuple[int, Space]]) -> Space:
    """Return state spaces of single joints, from a joint's error to its torque, as one."""
    n = sum(len(each.A) for _, each in spaces)
    A, B = np.zeros((n, n)), np.zeros((n, MEASURED))
    C, D = np.zeros((JOINTS, n)), np.zeros((JOINTS, MEASURED))
    start = 0
    for joint, each in spaces:
        own = slice(start, start + len(each.A))
        A[own, own], B[own, joint], C[joint, own] = each.A, each.B[:, 0], each.C[0]
        D[joint, joint] = each.D[0, 0]
        start += len(each.A)
    return Space(A, B, C, D)
