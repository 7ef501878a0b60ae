"""An animation of closed loops: both arms over the reference, their difference magnified.

    flexsim animate --trajectory circle --out circle.gif
    flexsim animate --trajectory circle --out circle.png --at 2.0

The loops are those of `flexsim follow`, simulated anew.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, features

from flexsim.errors import ParameterError
from flexsim.files.atomic import replacing, require_replaceable
from flexsim.loop.trajectories import path_named
from flexsim.numerics.elementary import cos, sin
from flexsim.recording.traces import ASSUMED_MODES, CHAIN, spoken
from studies.animate.scene import Arm, Scene
from studies.core.figures import save, styles
from studies.core.folder import to_json
from studies.core.options import HardwareOptions, RobotOptions, show_differences
from studies.core.study_options import Controllers, SeedOptions, check_each_once
from studies.core.text import spelled
from studies.tools.follow import FollowConfig, Followed
from studies.tools.follow import run as followed
from studies.tuning.found import label_of

WHAT = "the animation"
MOVING, STILL = (".gif", ".webp"), ".png"
COLOURS = 64  # of a GIF, the same in all frames
FPS_MOST, FRAMES_MOST = 50, 2000


@dataclass(frozen=True, kw_only=True)
class AnimateConfig(HardwareOptions, SeedOptions, RobotOptions):
    """Show one or two closed loops: arms over the reference, their difference, their errors."""

    out: Path
    """File to write: .gif or .webp moves, .png stands still."""
    trajectory: str = "circle"
    """line, two-loop or circle, or turn, of joint 2 by a right angle."""
    controllers: Controllers = ()
    """One, or two on one plant; names and folders as in flexsim follow; the trajectory's own, or
    that of --arm, unless given."""
    plants: tuple[str, ...] = (ASSUMED_MODES, CHAIN)
    """One or two, as in flexsim follow; two loops are shown at most."""
    setting: str = "simulink"
    """Friction, limits and motors: none, simulink, jump, opposing or reconstructed."""
    hardware: str = "bench"
    """ideal, the paper's, or bench (assumed: a sample of delay, 10 and 5 N m, 8192 counts a turn,
    0.1 mm of noise on v)."""
    fps: int = 20
    """Frames per second, at the pace of the motion."""
    at: float | None = None
    """Time of a still [s]; where v is largest unless given."""
    force: bool = False
    """Overwrite the file named by --out."""
    json: bool = False
    """Print one JSON object about it instead of a line."""


def check(config: AnimateConfig) -> None:
    """Refuse options that no animation can be made with.

    Raises:
        ParameterError, RunError: as said.
    """
    suffix = config.out.suffix.lower()
    if suffix not in (*MOVING, STILL):
        known = ", ".join((*MOVING, STILL))
        raise ParameterError(f"{config.out} has none of the endings {known}; give it one")
    if suffix == ".webp" and not features.check("webp"):
        raise ParameterError("Pillow is built without WebP here; write a .gif")
    path_named(config.trajectory)
    check_each_once("plants", config.plants)
    if config.controllers:
        check_each_once("controllers", config.controllers)
    loops = len(config.plants) * max(len(config.controllers), 1)
    if loops > 2:
        raise ParameterError(
            f"{loops} loops are asked for; give two plants, or two controllers and one plant"
        )
    if not 1 <= config.fps <= FPS_MOST:
        raise ParameterError(f"fps is {config.fps}; give 1 to {FPS_MOST}")
    if config.at is not None and suffix != STILL:
        raise ParameterError(f"--at is of a still; write a {STILL}, or leave it out")
    require_replaceable(config.out, WHAT, config.force)


def loops(config: AnimateConfig) -> list[Followed]:
    """Return the loops that are shown, simulated.

    Raises:
        ParameterError, ModelError, RunError: as `flexsim follow`.
    """
    same = {item.name for item in fields(FollowConfig)} & {item.name for item in fields(config)}
    given = {name: getattr(config, name) for name in same}
    own = config.trajectory if config.arm == "paper" else config.arm
    return [
        followed(FollowConfig(**given, controller=controller, plant=plant))
        for controller in config.controllers or (own,)
        for plant in config.plants
    ]


def scene_of(config: AnimateConfig, found: list[Followed]) -> Scene:
    """Return the loops as they are drawn, at their start.

    Raises:
        ParameterError: a loop has no sample.
    """
    L_R = config.robot_of().parameters.L_R
    plants = [each.motion.plant for each in found]
    names = [spoken(plant) for plant in plants]
    looks = [styles(plants)[plant] for plant in plants]
    if len(set(plants)) < len(plants):  # one plant: controllers are what differs
        names = [label_of(each.controller) for each in found]
        looks = list(styles((ASSUMED_MODES, CHAIN)).values())
    arms = []
    for name, look, each in zip(names, looks, found, strict=True):
        if not len(each.motion.time):
            raise ParameterError(f"the loop of {name} diverges at once; there is nothing to show")
        first, bent = each.motion.joint[:, 0], each.motion.link1
        elbow = L_R * np.stack([cos(first), sin(first)], axis=-1) if bent is None else bent[:, -1]
        arms.append(Arm(name, each.motion, elbow, look))
    reference = found[0].reference
    words = f"{found[0].path.name} by {label_of(found[0].controller)}, {config.setting}"
    return Scene(arms, reference.tip, float(reference.time[-1]), words)


def times(config: AnimateConfig, end: float) -> Any:
    """Return the times of the frames [s], the last one the end.

    Raises:
        ParameterError: they are too many.
    """
    count = round(end * config.fps) + 1
    if count > FRAMES_MOST:
        raise ParameterError(f"{count} frames are more than {FRAMES_MOST}; give a smaller --fps")
    return np.minimum(np.arange(count) / config.fps, end)


def frames(scene: Scene, when: Any) -> Iterator[Image.Image]:
    """Give the pictures at some times [s]."""
    for time in when:
        scene.show(float(time))
        yield Image.fromarray(scene.pixels())


def write(config: AnimateConfig, scene: Scene, end: float, found: list[Followed]) -> float:
    """Write the file, and return the time that it shows [s] or how long it lasts.

    Raises:
        ParameterError: a time that is not in the motion. RunError: it cannot be written.
    """
    if config.out.suffix.lower() == STILL:
        motion = found[0].motion
        usual = float(motion.time[int(np.abs(motion.v).argmax())])
        time = usual if config.at is None else config.at
        if not 0 <= time <= end:
            raise ParameterError(f"--at is {time:g} s; give 0 to {end:g}")
        scene.show(time)
        scene.still()
        save(scene.figure, config.out)
        return time
    when = times(config, end)
    pictures = list(frames(scene, when))
    duration = round(1000 / config.fps)
    how: dict[str, Any] = {"save_all": True, "duration": duration, "loop": 0}
    if config.out.suffix.lower() == ".gif":
        palette = pictures[-1].quantize(COLOURS, dither=Image.Dither.NONE)
        pictures = [each.quantize(palette=palette, dither=Image.Dither.NONE) for each in pictures]
        how |= {"optimize": True, "disposal": 1}
    else:
        how |= {"lossless": True, "method": 4, "minimize_size": True}
    kind = config.out.suffix[1:].upper()
    with replacing(config.out, WHAT, config.force) as temporary:
        pictures[0].save(temporary, kind, append_images=pictures[1:], **how)
    return float(when[-1])


def command(config: AnimateConfig) -> None:
    """Simulate the loops and write the animation."""
    check(config)
    if not config.json:
        show_differences(config.robot_of())
    found = loops(config)
    scene = scene_of(config, found)
    end = float(found[0].reference.time[-1])
    shown = write(config, scene, end, found)
    size = config.out.stat().st_size
    names = [arm.name for arm in scene.arms]
    if config.json:
        about = {"out": str(config.out), "loops": names, "time": shown, "bytes": size}
        print(to_json(about | {"magnified": scene.factor or None}))
        return
    factor = f", their difference {scene.factor:g} times larger" if scene.factor else ""
    still = config.out.suffix.lower() == STILL
    time = f"at {shown:.3g} s" if still else f"{shown:.3g} s"
    print(f"{spelled(config.out)}: {' and '.join(names)}{factor}; {time}, {size / 1e6:.2g} MB")
