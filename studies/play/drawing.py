"""What is drawn beside MuJoCo's arm: the assumed modes as a ghost, the path, both tips' trails.

>>> model = shown_model(stage.mujoco)      # its sliders are the knobs
>>> draw(scene, live, trails)
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from itertools import pairwise

import mujoco
import numpy as np

from flexsim.mjcf.arm_file import ArmFile
from flexsim.numerics.types import Array
from flexsim.plants.chain_plant import ChainPlant
from flexsim.plants.rod_plant import RodPlant
from studies.play.knobs import KNOBS
from studies.play.live import Live

GHOST = (0.90, 0.62, 0.0, 0.55)  # Okabe and Ito's orange
GHOST_TRAIL = (0.90, 0.62, 0.0, 0.9)
TRAIL = (0.0, 0.45, 0.70, 0.9)  # their blue, as MuJoCo's beam
PATH = (0.0, 0.62, 0.45, 0.9)  # their green
CARRIED = (0.80, 0.47, 0.65, 1.0)  # their purple
PATH_PARTS, TRAIL_PARTS, BEAM_PARTS = 120, 100, 20
TRAIL_STRIDE = 10  # periods
LINK_RADIUS, BEAM_RADIUS, HUB_RADIUS = 0.013, 0.006, 0.03  # [m]
LINE = 3.0  # [pixels]
DENSITY = 7850.0  # [kg/m3] of a payload, of steel


def shown_model(plant: ChainPlant | RodPlant) -> mujoco.MjModel:
    """Return a plant's model to be shown, never stepped: its controls are sliders, the knobs."""
    arm: ArmFile = plant.chain if isinstance(plant, ChainPlant) else plant.rod
    spec = mujoco.MjSpec.from_string(arm.text)
    for kind in ("sensors", "keys", "actuators"):
        for element in list(getattr(spec, kind)):
            spec.delete(element)
    joint = spec.joints[0].name
    for name, knob in KNOBS.items():
        slider = spec.add_actuator(name=name, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        slider.ctrllimited = mujoco.mjtLimited.mjLIMITED_TRUE
        slider.ctrlrange = np.array([knob.low, knob.high])
        slider.gainprm[0] = 0.0  # moves nothing
    return spec.compile()


class Trails:
    """Where both tips were lately, and the reference's path, thinned."""

    def __init__(self, path: Array) -> None:
        """Take the path (K, 2) [m]."""
        stride = max(1, len(path) // PATH_PARTS)
        self.path = np.vstack([path[::stride], path[-1:]])
        self.drawn = 0  # geoms of it that a scene has
        self.clear()

    def clear(self) -> None:
        """Forget where the tips were."""
        self.tips: tuple[deque[Array], deque[Array]] = (
            deque(maxlen=TRAIL_PARTS),
            deque(maxlen=TRAIL_PARTS),
        )

    def add(self, first: int, tips: Sequence[Array]) -> None:
        """Take where both tips were (K, 2) [m] from a period on."""
        for trail, places in zip(self.tips, tips, strict=True):
            trail.extend(places[-first % TRAIL_STRIDE :: TRAIL_STRIDE])


def draw(scene: mujoco.MjvScene, live: Live, trails: Trails, height: float) -> None:
    """Draw the ghost, trails and payloads into a scene, in place of what was in it but the path.

    Args:
        height: of the arm's plane [m].
    """
    if not trails.drawn:
        scene.ngeom = 0
        _strip(scene, trails.path, height, PATH)
        trails.drawn = int(scene.ngeom)
    scene.ngeom = trails.drawn
    modes, chain = (arm.body.plant.observe(arm.state[None], energy=False) for arm in live.arms)
    elbow = live.stage.modes.parameters.L_R * np.array(
        [np.cos(modes.joint[0, 0]), np.sin(modes.joint[0, 0])]
    )
    beam = modes.beam[0]
    beam = beam[:: max(1, len(beam) // BEAM_PARTS)]
    beam = np.vstack([elbow, beam, modes.tip])
    _strip(scene, np.vstack([np.zeros(2), elbow]), height, GHOST, LINK_RADIUS)
    _ball(scene, elbow, height, GHOST, HUB_RADIUS)
    _strip(scene, beam, height, GHOST, BEAM_RADIUS)
    for trail, colour in zip(trails.tips, (GHOST_TRAIL, TRAIL), strict=True):
        _strip(scene, np.array(trail).reshape(-1, 2), height, colour)
    if live.knobs.payload:
        radius = float(np.cbrt(3 * live.knobs.payload / (4 * np.pi * DENSITY)))
        for tip in (modes.tip[0], chain.tip[0]):
            _ball(scene, tip, height, CARRIED, radius)


def _new(scene: mujoco.MjvScene, kind: int, size: Array, at: Array, rgba: Sequence[float]) -> int:
    """Add a geom to a scene; return its number, or -1 where there is no room."""
    i = int(scene.ngeom)
    if i >= scene.maxgeom:
        return -1
    colour = np.array(rgba, dtype=np.float32)
    mujoco.mjv_initGeom(scene.geoms[i], kind, size, at, np.eye(3).ravel(), colour)
    scene.ngeom = i + 1
    return i


def _ball(
    scene: mujoco.MjvScene, at: Array, height: float, rgba: Sequence[float], radius: float
) -> None:
    place = np.array([at[0], at[1], height])
    _new(scene, mujoco.mjtGeom.mjGEOM_SPHERE, np.full(3, radius), place, rgba)


def _strip(
    scene: mujoco.MjvScene,
    points: Array,
    height: float,
    rgba: Sequence[float],
    radius: float | None = None,
) -> None:
    """Draw a polyline (K, 2) [m]: of capsules, or of lines without a radius [m]."""
    capsule, line = mujoco.mjtGeom.mjGEOM_CAPSULE, mujoco.mjtGeom.mjGEOM_LINE
    kind, width = (line, LINE) if radius is None else (capsule, radius)
    placed = np.column_stack([points, np.full(len(points), height)])
    placed = placed[np.isfinite(placed).all(axis=1)]
    for start, end in pairwise(placed):
        i = _new(scene, kind, np.zeros(3), np.zeros(3), rgba)
        if i >= 0:
            mujoco.mjv_connector(scene.geoms[i], kind, width, start, end)
