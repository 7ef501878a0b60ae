"""The scene of a case, logged: arms where they are, paths, torques, glasses; as map and in space.

Everything lies in the plane of motion, in layers of 0.1 mm, so that what is drawn later covers what
was drawn before. A camera looks down on it from far above, one metre of the plane to one unit of
its picture: seen through it the scene is a map, without it three-dimensional.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from flexsim.arm.parameters import Parameters
from flexsim.errors import ModelError
from flexsim.loop.motion import Motion
from flexsim.numerics.types import Array
from flexsim.recording.band import Band
from flexsim.recording.case import Case
from flexsim.recording.colours import FAINT, Colour, colour, dimmed
from flexsim.recording.curves import BAND_STEP
from flexsim.recording.drawn.arms import (
    FRAME,
    beam_segments,
    frames,
    in_space,
    links,
    strain,
    strain_colours,
    thinned_beam,
    torque_arrows,
)
from flexsim.recording.drawn.magnifier import Glass, trails
from flexsim.recording.drawn.map import Sheet, dashes, grid, labels
from flexsim.recording.drawn.solids import log_solids
from flexsim.recording.panels import one_two_five
from flexsim.recording.traces import CHAIN, MM, TIMELINE, longest, spoken

Stream = rr.RecordingStream
Path = tuple[Array, Array]  # times (K,) [s] and points (K, 2) [m]

ABOUT_REFERENCE, ABOUT_FIRST = "about_reference", "about_first"  # glasses, below the scene
CAMERA = "top"  # below the scene
WORDS = "words"  # below the scene: all texts of the map, which cover what is small
SOLIDS = "solids"  # beside the scene: seen in space only
HEIGHT = 10.0  # of the camera [m]: a part 10 mm above the plane is off by 0.1 % of its way outward
LAYER = 1e-4  # [m]
HOLLOW = (0.0, 0.018, 0.028, 0.038)  # widths of the plants' arms [m], the first a line
BROAD, THIN, FINE = 1.6, 0.9, 0.6  # radii of lines [points]
PATH_STEP = 0.005  # of the tips' paths [s]
PATHS_SHOWN = 10  # of other runs
TIP = (3.0, 4.5, 6.0)  # radii of the tips [points], the first plant's on top
DARK = 0.45  # brightness of the repeats' paths


def nanoseconds(time: Array) -> NDArray[np.timedelta64]:
    """Return times [s], (K,), rounded to whole nanoseconds; rerun itself would cut them off."""
    return np.rint(time * 1e9).astype("timedelta64[ns]")


def time_column(time: Array) -> rr.TimeColumn:
    """Return times [s], (K,), as the recording's one timeline."""
    return rr.TimeColumn(TIMELINE, duration=nanoseconds(time))


def largest_torques(case: Case) -> tuple[float, float]:
    """Return the torques of both joints that an arrow's whole sweep stands for [N m]."""
    most = np.zeros(2)
    for motion in case.motions.values():
        if motion.time.size:
            most = np.maximum(most, np.nanmax(np.abs(motion.applied), axis=0))
    first, second = (one_two_five(each) * 2 if each > 0 else 1.0 for each in most)
    return first, second


def largest_strain(case: Case) -> float:
    """Return the strain that the strongest colours stand for."""
    most = 0.0
    for motion in case.motions.values():
        if motion.time.size:
            most = max(most, float(np.abs(strain(thinned_beam(frames(motion).beam))).max()))
    return one_two_five(most) if most > 0 else 1e-6


def remarks(case: Case, sheet: Sheet) -> list[str]:
    """Return in words how a case is drawn."""
    names = [spoken(plant) for plant in case.motions]
    first, second = largest_torques(case)
    found = ["Both arms are drawn where they are, one on the other, in metres. "]
    if len(names) > 1:
        found[0] += f"The arm of the {names[0]} is a line, the {names[1]} is hollow around it."
    found.append(
        f"The beam's colour is the strain of its left side: green stretched, pink compressed, "
        f"fully at {largest_strain(case):.1e} and beyond (a strip 1 mm thick)."
    )
    found.append(
        f"Arrows around the joints are the motors' torques, three quarters of a turn for "
        f"{first:g} and {second:g} N m."
    )
    for glass, what in (
        (sheet.about_reference, "about the reference"),
        (sheet.about_first, f"about that of the {names[0]}"),
    ):
        if glass is not None:
            found.append(
                f"Circle: the tip {what}, at its place at the same time, magnified "
                f"{glass.factor:g} times; the rim is {MM * glass.shows:.3g} mm off."
            )
    found.append(
        "The tip error is the distance to the reference at the same time; an arm that diverged "
        "stays where it was last."
    )
    if case.friction is not None and case.friction.law != "none":
        found.append(
            "A joint is driven where the torque is beyond the dead zone; inside it, it sticks "
            "while at rest. It switches where that changes within 20 ms."
        )
    if case.bands:
        runs = max(band.runs for band in case.bands.values())
        found.append(
            f"Thin curves are the least and the largest of up to {runs} runs, over every "
            f"{MM * BAND_STEP:g} ms; dark paths are some of these runs."
        )
    return found


def _lines(stream: Stream, path: str, time: Array, lines: Any, colours: Any, radius: float) -> None:
    """Record lines (K, S, P, 3) [m] that move; colours one, or (K, S) as 0xRRGGBBAA."""
    rows, each = lines.shape[:2]
    style: dict[str, Any] = {"radii": rr.Radius.ui_points([radius])}
    changing: dict[str, Any] = {}
    if isinstance(colours, np.ndarray):
        changing["colors"] = colours.ravel()
    else:
        style["colors"] = [colours]
    stream.log(path, rr.LineStrips3D.from_fields(**style), static=True)
    strips = lines.reshape(rows * each, *lines.shape[2:]).astype(np.float32)
    columns = rr.LineStrips3D.columns(strips=strips, **changing)
    stream.send_columns(path, [time_column(time)], columns.partition(np.full(rows, each)))


def _fixed(
    stream: Stream, path: str, lines: Sequence[Array], rgb: Any, radius: float, layer: float
) -> None:
    """Record lines, each (P, 2) [m], that stay."""
    strips = [in_space(line, layer * LAYER) for line in lines if len(line) > 1]
    if strips:
        style: dict[str, Any] = {"colors": rgb, "radii": rr.Radius.ui_points(radius)}
        stream.log(path, rr.LineStrips3D(strips, **style), static=True)


def _log_arm(
    stream: Stream, path: str, motion: Motion, parameters: Parameters, place: int, case: Case
) -> None:
    """Record one arm: link and hub in its colour, the beam by its strain, torques, the tip."""
    arm, hollow = frames(motion), HOLLOW[min(place, len(HOLLOW) - 1)]
    rgb, height = colour(motion.plant), (10 - place) * LAYER
    thin = THIN if hollow else BROAD
    drawn = in_space(links(arm, parameters, hollow), height)
    _lines(stream, f"{path}/links", arm.time, drawn, rgb, thin)
    pieces, strained = beam_segments(arm.beam, hollow)
    shades = strain_colours(strained, largest_strain(case))
    _lines(stream, f"{path}/beam", arm.time, in_space(pieces, height), shades, thin)
    arrows = torque_arrows(arm, parameters, largest_torques(case), place)
    _lines(stream, f"{path}/torques", arm.time, in_space(arrows, height), rgb, THIN)
    radius = rr.Radius.ui_points([TIP[min(place, 2)]])
    dot = rr.Points3D.from_fields(colors=[rgb], radii=radius)
    stream.log(f"{path}/tip", dot, static=True)
    points = rr.Points3D.columns(positions=in_space(arm.tip, height))
    stream.send_columns(f"{path}/tip", [time_column(arm.time)], points)


def _log_paths(
    stream: Stream, scene: str, plant: str, motion: Motion, band: Band | None, place: int
) -> None:
    """Record a tip's whole path, where it diverged if it did, and the paths of other runs."""
    path, rgb = f"{scene}/{plant}", colour(motion.plant)
    if band is not None:
        some = [_thinned(band.time, tip, FRAME) for tip in band.paths[:PATHS_SHOWN]]
        _fixed(stream, f"{path}/repeats", some, dimmed(rgb, DARK), FINE, -2)
    own = _thinned(motion.time, motion.tip)
    _fixed(stream, f"{path}/path", [own], rgb, FINE if place else THIN, place)
    if motion.diverged is not None:
        label = f"{spoken(motion.plant)}: diverged at {motion.diverged:.3f} s"
        where = in_space(motion.tip[-1:], 11 * LAYER)
        mark = rr.Points3D(where, colors=[rgb], radii=rr.Radius.ui_points([6.0]))
        stream.log(f"{path}/diverged", mark, static=True)
        _texts(stream, f"{scene}/{WORDS}/{plant}", motion.tip[-1:], [label], rgb)


def _thinned(time: Array, path: Array, pitch: float = PATH_STEP) -> Array:
    """Return a path (K, 2) at a step of `pitch` [s], its end kept."""
    step = max(1, round(pitch / float(time[1] - time[0]))) if time.size > 1 else 1
    return np.concatenate([path[:-1:step], path[-1:]])


def _log_glass(
    stream: Stream, scene: str, name: str, glass: Glass, case: Case, about: Path, what: str
) -> None:
    """Record what a glass shows: parts of paths, and the tips, about a moving point."""
    path = f"{scene}/{name}"
    moved = [each for each in case.motions.values() if each.time.size]
    time, reference = case.reference_tip
    paths = [(time, reference), *((each.time, each.tip) for each in moved)]
    at = frames(longest(case.motions)).time
    at = at[at <= about[0][-1] + 1e-9]
    seen = trails(glass, paths, about, at, [True] + [False] * len(moved))
    rgbs: list[Colour] = [colour("reference"), *(colour(each.plant) for each in moved)]
    radii = [THIN, *(FINE if i else BROAD for i in range(len(moved)))]
    strips: list[Any] = []
    ends: list[Any] = []
    shades: list[Colour] = []
    dots: list[Colour] = []
    widths: list[float] = []
    marks: list[float] = []
    counts: list[int] = []
    for row in seen:
        kept = [i for i, line in enumerate(row) if len(line) > 1]
        strips += [in_space(row[i], (3 + i) * LAYER) for i in kept]
        shades += [rgbs[i] for i in kept]
        widths += [radii[i] for i in kept]
        counts.append(len(kept))
        tips = [i for i, line in enumerate(row) if i and len(line)]
        ends += [in_space(row[i][-1], (12 - i) * LAYER) for i in tips]
        dots += [rgbs[i] for i in tips]
        marks += [TIP[min(i - 1, 2)] for i in tips]
    _fixed(stream, f"{path}/rim", [glass.circle()], [colour("reference")], FINE, 0)
    said = f"{what} x {glass.factor:g}\nrim: {MM * glass.shows:.3g} mm"
    _texts(stream, f"{scene}/{WORDS}/{name}", glass.centre[None] - [0.0, glass.radius], [said])
    column = [time_column(at)]
    if strips:
        lines = rr.LineStrips3D.columns(
            strips=strips, colors=shades, radii=rr.Radius.ui_points(widths)
        )
        stream.send_columns(f"{path}/paths", column, lines.partition(counts))
    if ends:
        points = rr.Points3D.columns(
            positions=np.array(ends), colors=dots, radii=rr.Radius.ui_points(marks)
        )
        stream.send_columns(f"{path}/tips", column, points.partition([_tips(row) for row in seen]))


def _tips(row: Sequence[Array]) -> int:
    """Return how many tips a glass shows."""
    return sum(1 for i, line in enumerate(row) if i and len(line))


def _log_camera(stream: Stream, scene: str) -> None:
    """Record the camera that makes a map of the scene."""
    down = rr.Transform3D(translation=[0, 0, HEIGHT], mat3x3=[[1, 0, 0], [0, -1, 0], [0, 0, -1]])
    lens = rr.Pinhole(
        image_from_camera=np.diag([HEIGHT, HEIGHT, 1.0]),
        resolution=[1e-6, 1e-6],
        camera_xyz=rr.ViewCoordinates.RDF,
        image_plane_distance=1e-6,
    )
    stream.log(f"{scene}/{CAMERA}", down, lens, static=True)


def _log_map(stream: Stream, scene: str, sheet: Sheet) -> None:
    """Record the map's grid and the texts of its ticks."""
    _fixed(stream, f"{scene}/grid", grid(sheet), [dimmed(FAINT, 0.6)], 0.4, -6)
    _texts(stream, f"{scene}/{WORDS}/ticks", *labels(sheet))


def _texts(
    stream: Stream, path: str, places: Array, said: Sequence[str], rgb: Colour | None = None
) -> None:
    """Record texts, each under its place (n, 2) [m]; grey unless a colour is given."""
    style: dict[str, Any] = {
        "colors": [rgb or colour("reference")],
        "radii": rr.Radius.ui_points(0.0),
    }
    texts = rr.Points3D(in_space(places), labels=said, show_labels=True, **style)
    stream.log(path, texts, static=True)


def log_scene(stream: Stream, case: Case, parameters: Parameters, sheet: Sheet) -> None:
    """Record everything of the map and the 3D view of a case, below `/<case>/scene`.

    Raises:
        ModelError: the chain's motion and its MJCF do not belong together.
    """
    scene = f"{case.name}/scene"
    stream.log(scene, rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    _log_camera(stream, scene)
    _log_map(stream, scene, sheet)
    _fixed(
        stream,
        f"{scene}/reference",
        dashes(case.reference_tip[1]),
        [colour("reference")],
        BROAD,
        -4,
    )
    moved = {plant: each for plant, each in case.motions.items() if each.time.size}
    for i, (plant, motion) in enumerate(moved.items()):
        place = list(case.motions).index(plant)
        _log_paths(stream, scene, plant, motion, case.bands.get(plant), place)
        _log_arm(stream, f"{scene}/{plant}", motion, parameters, place, case)
        if plant == CHAIN and case.chain_model is not None:
            _log_chain(stream, f"{case.name}/{SOLIDS}", motion, case)
        if not i and sheet.about_first is not None and len(moved) > 1:
            other = spoken(list(case.motions)[1])
            what = f"{other} about {spoken(plant)}"
            about = (motion.time, motion.tip)
            _log_glass(stream, scene, ABOUT_FIRST, sheet.about_first, case, about, what)
    if sheet.about_reference is not None:
        about = case.reference_tip
        what = "tips about the reference"
        _log_glass(stream, scene, ABOUT_REFERENCE, sheet.about_reference, case, about, what)


def _log_chain(stream: Stream, path: str, motion: Motion, case: Case) -> None:
    """Record the chain's own geometry.

    Raises:
        ModelError: the motion's state is not of this model.
    """
    model = case.chain_model
    if model is None:
        return
    if motion.state.shape[1] != model.nq + model.nv:
        raise ModelError(
            f"the chain's motion has {motion.state.shape[1]} states, its MJCF {model.nq} positions "
            f"and {model.nv} velocities; record a motion with the model that made it"
        )
    arm = frames(motion)
    log_solids(stream, path, model, time_column(arm.time), arm.state, colour(motion.plant))
