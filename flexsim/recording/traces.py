"""The curves of one case over time, ready to be plotted: both plants, and their difference.

    >>> [trace.path for trace in traces(case)]            # doctest: +SKIP
    ['tip_error/assumed-modes', 'tip_error/chain', 'v/assumed-modes', ...]

Only arrays in and out; how they are drawn is the recording's affair. Lengths are in millimetres
here, as the titles of `PANELS` say, because errors and deflections are millimetres.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from flexsim.errors import ParameterError
from flexsim.loop.motion import Motion
from flexsim.numerics.types import Array
from flexsim.recording.band import Band

TIMELINE = "simulation_time"  # [s]
MM = 1000.0  # [mm/m]
UNCHANGED = 1e-9  # what a chain's v differs by when it is computed in another way, and less
ASSUMED_MODES, CHAIN = "assumed-modes", "chain"
USUAL_PAIR = "chain minus assumed modes"
PANELS = {
    "tip_error": "tip error [mm]",
    "v": "tip deflection v [mm]",
    "difference/tip": f"tip, {USUAL_PAIR} [mm]",
    "difference/v": f"v, {USUAL_PAIR} [mm]",
    "torque": "torque [N m] · joint 1 bright, joint 2 dark",
    "joint": "joint angles [rad] · 1 bright, 2 dark, reference grey",
    "modal": "modal coordinates [mm] · 1 bright to 3 dark",
    "energy": "kinetic + elastic energy [J]",
}


def panels(motions: Mapping[str, Motion]) -> dict[str, str]:
    """Return the titles of `PANELS`, those of differences with the names of the two plants."""
    names = [spoken(plant) for plant in motions]
    pair = f"{names[1]} minus {names[0]}" if len(names) == 2 else USUAL_PAIR
    return {path: title.replace(USUAL_PAIR, pair) for path, title in PANELS.items()}


@dataclass(frozen=True, eq=False)
class Trace:
    """One or more curves over the same time.

    Attributes:
        path: a key of `PANELS`, then the plant, or 'reference' (nothing for a difference).
        names: one per curve, for the legend.
        time: (K,) [s]. values: (K, len(names)), in the panel's unit.
    """

    path: str
    names: tuple[str, ...]
    time: Array
    values: Array


def kind(plant: str) -> str:
    """Return a plant's name without its size: 'chain' for 'chain:10'."""
    return plant.partition(":")[0]


def spoken(plant: str) -> str:
    """Return the plant's name as text shows it: 'assumed modes', 'chain', 'chain 10'."""
    return plant.replace("-", " ").replace(":", " ")


def _columns(motion: Motion) -> dict[str, tuple[tuple[str, ...], Array]]:
    """Return the curves of one plant by panel: their symbols and values (K, m)."""
    modes = tuple(f"eta {i + 1}" for i in range(motion.modal.shape[1]))
    error = np.linalg.norm(motion.tip - motion.reference_tip, axis=1)
    return {
        "tip_error": (("",), MM * error[:, None]),
        "v": (("",), MM * motion.v[:, None]),
        "torque": (("tau 1", "tau 2"), motion.torque),
        "joint": (("theta 1", "theta 2"), motion.joint),
        "modal": (modes, MM * motion.modal),
        "energy": (("",), motion.energy[:, None]),
    }


def longest(motions: Mapping[str, Motion]) -> Motion:
    """Return the motion with the most samples, whose reference covers all the others."""
    return max(motions.values(), key=lambda motion: motion.time.size)


def difference(motions: Mapping[str, Motion], of: Callable[[Motion], Array]) -> tuple[Array, Array]:
    """Return the times that both plants reached (K,) [s] and the second minus the first there.

    Raises:
        ParameterError: the two were not sampled at the same times.
    """
    (one, first), (other, second) = motions.items()
    k = min(first.time.size, second.time.size)
    if not np.allclose(first.time[:k], second.time[:k], rtol=0, atol=1e-9):
        raise ParameterError(
            f"the motions of {one} and {other} are sampled at different times; "
            "thin both by the same stride"
        )
    return first.time[:k], of(second)[:k] - of(first)[:k]


def _differences(motions: Mapping[str, Motion]) -> list[Trace]:
    """Return the difference between the plants, where there are two of them."""
    if len(motions) != 2:
        return []
    time, tip = difference(motions, lambda motion: motion.tip)
    _, v = difference(motions, lambda motion: motion.v)
    tip = np.column_stack([tip, np.linalg.norm(tip, axis=1)])
    return [
        Trace("difference/tip", ("x", "y", "distance"), time, MM * tip),
        Trace("difference/v", ("v",), time, MM * v[:, None]),
    ]


def _through_hardware(plant: str, motion: Motion) -> list[Trace]:
    """Return what hardware made of commands and measurements, where it made something of them."""
    name, angles, v = spoken(plant), motion.measured[:, :2], motion.measured[:, 2]
    seen = tuple(f"theta {j} {name}, measured" for j in (1, 2))
    given = tuple(f"tau {j} {name}, applied" for j in (1, 2))
    found = [
        (f"torque/applied/{plant}", given, motion.applied, motion.torque),
        (f"joint/measured/{plant}", seen, angles, motion.joint),
        (f"v/measured/{plant}", (f"{name}, measured",), MM * v[:, None], MM * motion.v[:, None]),
    ]
    return [
        Trace(path, names, motion.time, values)
        for path, names, values, plain in found
        if not np.allclose(values, plain, rtol=0, atol=UNCHANGED)
    ]


def _of_band(plant: str, band: Band) -> list[Trace]:
    """Return the least and largest of a plant's repeats."""
    names = tuple(f"{spoken(plant)}, {end} of {band.runs} runs" for end in ("least", "largest"))
    return [
        Trace(f"tip_error/band/{plant}", names, band.time, MM * band.error.T),
        Trace(f"v/band/{plant}", names, band.time, MM * band.v.T),
    ]


def traces(motions: Mapping[str, Motion], bands: Mapping[str, Band] | None = None) -> list[Trace]:
    """Return every curve of a case, all of it finite or left out.

    Bands, by the plant's name, come beside the errors and deflections. A motion without a
    reference has no tip error; one without a sample has no curves at all.

    Raises:
        ParameterError: the two plants were not sampled at the same times.
    """
    found = []
    for plant, motion in motions.items():
        for panel, (symbols, values) in _columns(motion).items():
            names = tuple(f"{symbol} {spoken(plant)}".strip() for symbol in symbols)
            found.append(Trace(f"{panel}/{plant}", names, motion.time, values))
        found += _through_hardware(plant, motion)
    if motions:
        whole = longest(motions)
        names = ("theta 1 reference", "theta 2 reference")
        found.append(Trace("joint/reference", names, whole.time, whole.reference_joint))
    for plant, band in (bands or {}).items():
        found += _of_band(plant, band)
    found += _differences(motions)
    return [trace for trace in found if trace.time.size and not np.isnan(trace.values).all()]
