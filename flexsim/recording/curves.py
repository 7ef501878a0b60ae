"""The curves of a case as columns of 32-bit numbers, and the plots that show them.

>>> curves, band = columns(case)
>>> curves.components["chain"]["v_mm"]                   # (K,)

All curves of a case on the same samples are one entity: a component for each plant, another for
their difference, a field for each quantity, whose name ends with its unit: `v_mm`, `torque_1_Nm`.
Every sample is kept, whatever is shown: at 1 kHz a dither of 250 Hz is one, every 5th sample of it
another.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pyarrow as pa
import rerun as rr

from flexsim.loop.motion import Motion
from flexsim.numerics.types import Array
from flexsim.recording.band import Band
from flexsim.recording.case import Case
from flexsim.recording.colours import DIFFERENCE, Colour, colour, dimmed, word
from flexsim.recording.panels import DENSEST, ROOMY, Panel, Series, rounded
from flexsim.recording.traces import MM, difference, longest, spoken

CURVES, BAND, APART = "curves", "band", "difference"  # two entities; a component
BROAD, THIN, FINE = 3.4, 1.2, 0.7  # widths of curves [points]: the first plant's lies below
DIM = 0.62  # brightness of what belongs to a curve: ends of its band, what hardware made of it
SHADE = 0.55  # of another thin curve of the same colour
UNCHANGED = 1e-9  # what a chain's v differs by when it is computed in another way, and less
MODES_SHOWN = 3
BAND_STEP = 0.005  # [s] over which the ends of all runs are taken together
DISTANCES = ("x_mm", "y_mm", "distance_mm")
DISTANCE_WIDTHS = (0.8, 1.6, 3.0)

Fields = Mapping[str, Array]


@dataclass(frozen=True)
class Columns:
    """Curves on the same samples.

    Attributes:
        entity: below the case. time: (K,) [s].
        components: fields (k,) of each, k <= K, from the first sample on.
    """

    entity: str
    time: Array
    components: Mapping[str, Fields]


@dataclass(frozen=True)
class Quantity:
    """What one plot shows of every plant: its field, title and tab; `also` as thin lines."""

    field: str
    title: str
    tab: str = ""
    also: tuple[tuple[str, str], ...] = ()


TRACKING, JOINTS, ERRORS, BEAM = "tracking", "joints", "errors", "beam"
BAND_ENDS = ("least", "largest")
QUANTITIES = (
    Quantity("tip_error_mm", "tip error [mm]", TRACKING),
    Quantity("v_mm", "tip deflection v [mm]", TRACKING),
    *(
        Quantity(
            f"torque_{j}_Nm",
            f"torque of joint {j} [N m]",
            JOINTS,
            ((f"torque_{j}_applied_Nm", "applied"),),
        )
        for j in (1, 2)
    ),
    *(
        Quantity(f"error_{j}_mrad", f"error {j}, as the controller sees it [mrad]", ERRORS)
        for j in (1, 2)
    ),
    *(
        Quantity(f"eta_{i}_mm", f"modal coordinate {i} [mm]", BEAM)
        for i in range(1, MODES_SHOWN + 1)
    ),
    Quantity("energy_J", "kinetic and elastic energy [J]", BEAM),
)
BANDED = ("tip_error_mm", "v_mm")
DIFFERENCES = {  # of which quantity: what differs, which fields show it
    "tip_error_mm": ("tips", DISTANCES),
    "v_mm": ("v", ("v_mm",)),
}


def component(plant: str) -> str:
    """Return the name of a plant's component: 'assumed_modes', 'chain_10'."""
    return spoken(plant).replace(" ", "_")


def of_motion(motion: Motion) -> dict[str, Array]:
    """Return the curves of one plant by field, (K,) each; without a reference no tip error."""
    error = np.linalg.norm(motion.tip - motion.reference_tip, axis=1)
    found = {"tip_error_mm": MM * error, "v_mm": MM * motion.v}
    for j in (1, 2):
        torque, applied = motion.torque[:, j - 1], motion.applied[:, j - 1]
        found[f"torque_{j}_Nm"] = torque
        if not np.allclose(applied, torque, rtol=0, atol=UNCHANGED):
            found[f"torque_{j}_applied_Nm"] = applied
        found[f"error_{j}_mrad"] = MM * motion.error[:, j - 1]
        found[f"theta_{j}_rad"] = motion.joint[:, j - 1]
    found |= {f"eta_{i + 1}_mm": MM * eta for i, eta in enumerate(motion.modal.T[:MODES_SHOWN])}
    found |= {"energy_J": motion.energy, "tip_x_m": motion.tip[:, 0], "tip_y_m": motion.tip[:, 1]}
    return {name: values for name, values in found.items() if not np.isnan(values).all()}


def of_band(band: Band) -> tuple[Array, dict[str, Array]]:
    """Return times (B,) [s] and the least and largest of a plant's repeats by field, (B,) each.

    Over every BAND_STEP, or every sample where they are rarer.
    """
    step = 1
    if band.time.size > 1:
        step = max(1, round(BAND_STEP / float(band.time[1] - band.time[0])))
    starts = np.arange(0, band.time.size, step)
    found = {}
    for name, values in (("tip_error_mm", band.error), ("v_mm", band.v)):
        found[f"{name}_least"] = MM * np.minimum.reduceat(values[0], starts)
        found[f"{name}_largest"] = MM * np.maximum.reduceat(values[1], starts)
    return band.time[starts], found


def of_difference(motions: Mapping[str, Motion]) -> dict[str, Array]:
    """Return how the second plant differs from the first, by field; nothing unless there are two.

    Raises:
        ParameterError: the two were not sampled at the same times.
    """
    if len(motions) != 2:
        return {}
    _, tip = difference(motions, lambda motion: motion.tip)
    _, v = difference(motions, lambda motion: motion.v)
    columns = (*tip.T, np.linalg.norm(tip, axis=1), v)
    return {name: MM * each for name, each in zip((*DISTANCES, "v_mm"), columns, strict=True)}


def columns(case: Case) -> list[Columns]:
    """Return every curve of a case; a motion without a sample has none.

    Raises:
        ParameterError: the two plants were not sampled at the same times.
    """
    time = longest(case.motions).time
    own = {component(p): of_motion(each) for p, each in case.motions.items() if each.time.size}
    apart = of_difference(case.motions)
    if apart and apart["v_mm"].size:
        own[APART] = apart
    found = [Columns(CURVES, time, own)] if own else []
    bands = {component(plant): of_band(band) for plant, band in case.bands.items()}
    if bands:
        longer = max((times for times, _ in bands.values()), key=len)
        found.append(Columns(BAND, longer, {name: fields for name, (_, fields) in bands.items()}))
    return found


def sent(table: Columns) -> list[rr.ComponentColumn]:
    """Return curves as 32-bit numbers, a structure for each component, as rerun takes them."""
    found: list[rr.ComponentColumn] = []
    for name, fields in table.components.items():
        values = [np.ascontiguousarray(each, np.float32) for each in fields.values()]
        rows = np.zeros(len(table.time), int)
        rows[: len(values[0])] = 1
        structure = {name: pa.StructArray.from_arrays(values, names=list(fields))}
        found += rr.AnyValues.columns(drop_untyped_nones=True, **structure).partition(rows)
    return found


def panels(case: Case, tables: Iterable[Columns]) -> tuple[Panel, ...]:
    """Return the plots of a case's curves, in the order of their tabs."""
    by_entity = {table.entity: table for table in tables}
    found = [
        panel
        for quantity in QUANTITIES
        for make in (panel_of, difference_panel)
        for panel in (make(case, by_entity, quantity),)
        if panel
    ]
    return tuple(found)


def panel_of(case: Case, tables: Mapping[str, Columns], quantity: Quantity) -> Panel | None:
    """Return the plot of one quantity of all plants; None where none has it."""
    name = quantity.field
    series: list[Series] = []
    words: list[str] = []
    thin: list[Colour] = []
    for plant in case.motions:
        if name not in _fields(tables, CURVES, component(plant)):
            continue
        broad, rgb, shade = not words, colour(plant), word(plant)
        while rgb in thin and not broad:  # of one kind, as chain:10 and chain: told by shades
            rgb, shade = dimmed(rgb, SHADE), f"dark {shade}"
        thin += [] if broad else [rgb]
        words.append(f"{'broad' if broad else 'thin'} {shade}: {spoken(plant)}")
        series += _of_plant(tables, plant, quantity, BROAD if broad else THIN, rgb)
    if not series:
        return None
    if any(each.entity == BAND for each in series):
        words.append("finest: all runs")
    elif any(each.entity == CURVES and each.field != name for each in series):
        words.append("finest: applied")
    title = " · ".join([quantity.title, *words])
    densest = ROOMY if quantity.tab in (JOINTS, ERRORS) else DENSEST
    return Panel(quantity.tab, title, *rounded(_ends(tables, series), densest), tuple(series))


def _fields(tables: Mapping[str, Columns], entity: str, name: str) -> Fields:
    """Return the fields of a component, none where it is not there."""
    return tables[entity].components.get(name, {}) if entity in tables else {}


def _of_plant(
    tables: Mapping[str, Columns], plant: str, quantity: Quantity, width: float, rgb: Colour
) -> list[Series]:
    """Return one plant's curves of a quantity, what lies on top last."""
    name, said = component(plant), spoken(plant)
    dim: Colour = dimmed(rgb, DIM)
    found = [
        Series(BAND, name, f"{quantity.field}_{end}", f"{said}, {end} of all runs", dim, FINE)
        for end in BAND_ENDS
        if f"{quantity.field}_{end}" in _fields(tables, BAND, name)
    ]
    found += [
        Series(CURVES, name, other, f"{said}, {how}", dim, FINE)
        for other, how in quantity.also
        if other in _fields(tables, CURVES, name)
    ]
    return [*found, Series(CURVES, name, quantity.field, said, rgb, width)]


def difference_panel(case: Case, tables: Mapping[str, Columns], quantity: Quantity) -> Panel | None:
    """Return the plot of a difference that stands below that of the quantity itself."""
    if quantity.field not in DIFFERENCES or not _fields(tables, CURVES, APART):
        return None
    what, chosen = DIFFERENCES[quantity.field]
    one, other = (spoken(plant) for plant in case.motions)
    names = [name.removesuffix("_mm") for name in chosen]
    title = f"{what}, {other} minus {one} [mm]"
    if len(names) > 1:
        title += " · thin pink: x · green: y · broad yellow: distance"
    widths: Sequence[float] = DISTANCE_WIDTHS if len(names) > 1 else (THIN,)
    series = tuple(
        Series(CURVES, APART, name, label, rgb, width)
        for name, label, rgb, width in zip(chosen, names, DIFFERENCE, widths, strict=False)
    )
    return Panel(quantity.tab, title, *rounded(_ends(tables, series)), series)


def _ends(tables: Mapping[str, Columns], series: Iterable[Series]) -> list[float]:
    """Return the least and largest value of curves."""
    found: list[float] = []
    for each in series:
        values = tables[each.entity].components[each.component][each.field]
        if values.size and not np.isnan(values).all():
            found += [float(np.nanmin(values)), float(np.nanmax(values))]
    return found
