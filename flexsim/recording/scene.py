"""What the recording's 3D view shows: both arms, their tips' paths and the reference.

The chain is drawn broad, with its own MJCF geometry; any other arm as thin lines for rigid link,
hub and beam, lifted by `LIFT` so that they lie on top and show wherever the two arms part.
"""

from __future__ import annotations

import contextlib
import copy
import io
from typing import TYPE_CHECKING, Any

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from flexsim.arm.parameters import Parameters
from flexsim.errors import ModelError
from flexsim.loop.motion import Motion
from flexsim.numerics.types import Array
from flexsim.recording.traces import CHAIN, TIMELINE, kind, spoken

if TYPE_CHECKING:
    import mujoco

    from flexsim.recording.case import Case

Stream = rr.RecordingStream

COLOURS = {
    "assumed-modes": (240, 150, 30),
    "chain": (86, 180, 233),
    "rigid": (0, 158, 115),
    "printed": (213, 94, 0),
    "reference": (200, 200, 200),
}
OTHER_COLOUR = (204, 121, 167)
LIFT = 0.014  # of the assumed-modes arm above the chain [m]; display only
TRAIL_STEP = 0.002  # between the two tips' paths, so that neither flickers [m]; display only
SINK = -0.004  # of the reference path below the tips' paths [m]; display only
DASH, GAP = 0.014, 0.016  # of the reference path [m]
LINK_RADIUS, HUB_RADIUS, BEAM_RADIUS = 0.005, 0.009, 0.0022  # of an arm drawn with lines [m]
TIP_RADIUS = 0.008  # [m]
SHADE_MIN = 0.35  # brightness of what is black in the MJCF
FRAME = 0.005  # between two poses of an arm [s], where it was sampled more often; display only
CHAIN_BEAM_RADIUS = 0.005  # 1 mm of steel alone would hardly show from above [m]


def colour(name: str) -> tuple[int, int, int]:
    """Return the colour of a plant or of the reference, 0 to 255."""
    return COLOURS.get(kind(name), OTHER_COLOUR)


def nanoseconds(time: Array) -> NDArray[np.timedelta64]:
    """Return times [s], (K,), rounded to whole nanoseconds; rerun itself would cut them off."""
    return np.rint(time * 1e9).astype("timedelta64[ns]")


def time_column(time: Array) -> rr.TimeColumn:
    """Return times [s], (K,), as the recording's one timeline."""
    return rr.TimeColumn(TIMELINE, duration=nanoseconds(time))


def frames(motion: Motion) -> Motion:
    """Return a motion thinned to what a moving picture needs."""
    if motion.time.size < 2:
        return motion
    return motion.thinned(max(1, round(FRAME / float(motion.time[1] - motion.time[0]))))


def in_space(plane: Array, height: float = 0.0) -> Array:
    """Return points (..., 2) [m] of the plane of motion as (..., 3)."""
    return np.concatenate([plane, np.full((*plane.shape[:-1], 1), height)], axis=-1)


def elbow(motion: Motion, parameters: Parameters) -> Array:
    """Return the position of joint 2, (K, 2) [m]."""
    theta1 = motion.joint[:, 0]
    return parameters.L_R * np.column_stack([np.cos(theta1), np.sin(theta1)])


def corners(case: Case, parameters: Parameters) -> Array:
    """Return the lowest and highest corner (2, 3) [m] of what moves, within the arm's reach."""
    points = [np.zeros((1, 2)), case.reference_tip[1]]
    for motion in case.motions.values():
        points += [elbow(motion, parameters), motion.tip]
    every = np.concatenate(points)
    every = every[np.linalg.norm(every, axis=1) <= 1.1 * (parameters.L_R + parameters.reach)]
    return in_space(np.stack([every.min(axis=0), every.max(axis=0)]))


def dashes(path: Array) -> list[Array]:
    """Return a path (K, 2) [m] cut into dashes, each (m, 2); none where it has no length."""
    path = path[np.isfinite(path).all(axis=1)]
    step = np.linalg.norm(np.diff(path, axis=0), axis=1)
    length = np.concatenate([[0.0], np.cumsum(step)]) if path.size else np.zeros(1)
    found = []
    for start in np.arange(0.0, length[-1], DASH + GAP):
        s = np.linspace(start, min(start + DASH, length[-1]), 4)
        found.append(np.column_stack([np.interp(s, length, path[:, i]) for i in range(2)]))
    return found


def _strips(stream: Stream, path: str, time: Array, strips: Array, **style: Any) -> None:
    """Record one line strip (K, P, 3) [m] per sample."""
    stream.log(path, rr.LineStrips3D.from_fields(**style), static=True)
    stream.send_columns(
        path, [time_column(time)], rr.LineStrips3D.columns(strips=strips.astype(np.float32))
    )


def _drawn_arm(
    stream: Stream, root: str, motion: Motion, parameters: Parameters, height: float
) -> None:
    """Record an arm as rigid link, hub and deflected beam."""
    line = {"colors": [colour(motion.plant)]}
    joint2 = in_space(elbow(motion, parameters), height)
    origin = np.broadcast_to([0.0, 0.0, height], joint2.shape)
    beam = in_space(motion.beam, height)
    link = np.stack([origin, joint2], axis=1)
    hub = np.stack([joint2, beam[:, 0]], axis=1)
    _strips(stream, f"{root}/link1", motion.time, link, radii=[LINK_RADIUS], **line)
    _strips(stream, f"{root}/hub", motion.time, hub, radii=[HUB_RADIUS], **line)
    _strips(stream, f"{root}/beam", motion.time, beam, radii=[BEAM_RADIUS], **line)


def _recoloured(model: mujoco.MjModel, rgb: tuple[int, int, int]) -> mujoco.MjModel:
    """Return a copy of the model in shades of one colour, as bright as its own, untextured."""
    model = copy.copy(model)
    textured = model.geom_matid >= 0
    own = model.geom_rgba.copy()
    own[textured] = model.mat_rgba[model.geom_matid[textured]]
    brightness = SHADE_MIN + (1 - SHADE_MIN) * own[:, :3].max(axis=1, keepdims=True)
    model.geom_matid[:] = -1
    model.geom_rgba[:, :3] = brightness * np.array(rgb) / 255
    model.geom_rgba[:, 3] = 1.0
    return model


def _mjcf_arm(stream: Stream, root: str, motion: Motion, model: mujoco.MjModel) -> None:
    """Record an arm with the geometry of its MJCF.

    Raises:
        ModelError: the motion's state is not of this model, or a geom cannot be drawn.
    """
    import mujoco
    import rerun_loader_mjcf

    class GeometryLogger(rerun_loader_mjcf.MJCFLogger):  # type: ignore[misc]
        def log_data(self, *_: Any, **__: Any) -> None:
            """Leave the home pose out: the poses follow as columns."""

    if motion.state.shape[1] != model.nq + model.nv:
        raise ModelError(
            f"the chain's motion has {motion.state.shape[1]} states, its MJCF {model.nq} positions "
            f"and {model.nv} velocities; record a motion with the model that made it"
        )
    logger = GeometryLogger(_recoloured(model, colour(motion.plant)), root)
    try:
        with contextlib.redirect_stdout(io.StringIO()):  # it prints about planes it leaves out
            logger.log_model(stream)
    except NotImplementedError as error:
        raise ModelError(f"the recording cannot draw the chain: {error}") from error
    data = mujoco.MjData(model)
    with rerun_loader_mjcf.MJCFRecorder(logger, TIMELINE, stream) as recorder:
        for time, qpos in zip(nanoseconds(motion.time), motion.state[:, : model.nq], strict=True):
            data.qpos[:] = qpos
            mujoco.mj_kinematics(model, data)
            recorder.record(data, duration=time)
    style = {"colors": [colour(motion.plant)], "radii": [CHAIN_BEAM_RADIUS]}
    _strips(stream, f"{root}/beam", motion.time, in_space(motion.beam), **style)


def _tip(stream: Stream, root: str, motion: Motion, height: float) -> None:
    """Record the tip, its whole path, and where it diverged if it did."""
    rgb = colour(motion.plant)
    tip = in_space(motion.tip, height)
    trail = in_space(motion.tip, TRAIL_STEP if height else 0.0)
    path = rr.LineStrips3D([trail], colors=[rgb], radii=rr.Radius.ui_points(1.0 if height else 2.0))
    stream.log(f"{root}/tip_path", path, static=True)
    stream.log(
        f"{root}/tip", rr.Points3D.from_fields(colors=[rgb], radii=[TIP_RADIUS]), static=True
    )
    shown = frames(motion)
    places = rr.Points3D.columns(positions=in_space(shown.tip, height))
    stream.send_columns(f"{root}/tip", [time_column(shown.time)], places)
    if motion.diverged is not None:
        label = f"{spoken(motion.plant)}: diverged at {motion.diverged:.3f} s"
        stream.log(
            f"{root}/diverged",
            rr.Points3D(
                tip[-1:], colors=[rgb], radii=[2 * TIP_RADIUS], labels=[label], show_labels=True
            ),
            static=True,
        )


def log_scene(stream: Stream, case: Case, parameters: Parameters) -> None:
    """Record everything of the 3D view of a case, below `/<case>/scene`.

    Raises:
        ModelError: the chain's motion and its MJCF do not belong together.
    """
    scene = f"{case.name}/scene"
    stream.log(scene, rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    for i, (plant, motion) in enumerate(case.motions.items()):
        if not motion.time.size:
            continue
        height = 0.0 if plant == CHAIN else LIFT * (len(case.motions) - i)
        arm = frames(motion)
        if plant == CHAIN and case.chain_model is not None:
            _mjcf_arm(stream, f"{scene}/{plant}", arm, case.chain_model)
        else:
            _drawn_arm(stream, f"{scene}/{plant}", arm, parameters, height)
        _tip(stream, f"{scene}/{plant}", motion, height)
    reference = dashes(case.reference_tip[1])
    if reference:
        strips = [in_space(dash, SINK) for dash in reference]
        style = rr.LineStrips3D(
            strips, colors=[colour("reference")], radii=rr.Radius.ui_points(2.6)
        )
        stream.log(f"{scene}/reference", style, static=True)
