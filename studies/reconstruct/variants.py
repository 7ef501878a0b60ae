"""What the reconstruction of Table 2 assumes, varied one assumption at a time.

>>> [variant.name for variant in variants() if variant.group == "limits"]
['no torque limits', 'limit on joint 1 only', 'limit on joint 2 only']
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

from flexsim.loop.friction import Friction
from flexsim.loop.settings import V_GAIN, Setting, setting
from flexsim.loop.trajectories import Trajectory, trajectory
from flexsim.numerics.clocks import PERIOD
from flexsim.plants.base import Plant
from flexsim.robot import Robot

LIMITS = setting("reconstructed").friction.torque_limit  # [N m]
CENTRES = (  # where all figures are moved to [m]
    (0.40, 0.40), (0.45, 0.30), (0.50, 0.20), (0.55, 0.35), (0.60, 0.10), (0.65, 0.25), (0.70, 0.0),
)  # fmt: skip
CHANGES = (0.8, 1.2)  # of each fitted number
SPEEDS = (0.01, 0.05, 0.1)  # [rad/s] beside the 0.02 assumed
NO_DEAD_ZONE = ((0.0, 0.0), (0.0, 0.0))
QUICK = ("as reconstructed", "no torque limits", "friction none", "+v in the loop")


@dataclass(frozen=True)
class Variant:
    """One reading of what Table 2's controllers were run in.

    Attributes:
        group, name: for tables. setting: friction, limits, motors.
        v_gain: sign of v in the loop, -1 in the paper; 0 leaves it out.
        centre: where the figures are moved to [m]; None leaves each where the fit has it.
        size, slowness: factors of the figures' lengths and durations. steps: of 1 ms cut in so
            many physics steps.
    """

    group: str
    name: str
    setting: Setting = field(default_factory=lambda: setting("reconstructed"))
    v_gain: float = V_GAIN
    centre: tuple[float, float] | None = None
    size: float = 1.0
    slowness: float = 1.0
    steps: int = 1

    def trajectory(self, shape: str) -> Trajectory:
        """Return the reconstructed trajectory as this variant has it."""
        drawn = trajectory(shape, reconstructed=True)
        drawn = replace(drawn, duration=drawn.duration * self.slowness)
        if drawn.shape == "line":
            (x0, y0), (x1, y1) = drawn.start, drawn.end
            cx, cy = self.centre or ((x0 + x1) / 2, (y0 + y1) / 2)
            dx, dy = self.size * (x1 - x0) / 2, self.size * (y1 - y0) / 2
            return replace(drawn, start=(cx - dx, cy - dy), end=(cx + dx, cy + dy))
        return replace(
            drawn,
            centre=self.centre or drawn.centre,
            half_width=self.size * drawn.half_width,
            half_height=self.size * drawn.half_height,
        )

    def plants(self, robot: Robot, modes: int, segments: int | None) -> list[Plant]:
        """Return both plants with this variant's motors and physics step."""
        step = PERIOD / self.steps
        finer = step if self.steps > 1 and robot.file is None else None  # a file has its own
        return list(robot.both(self.setting, modes, segments, step, finer))


def _friction(**changes: object) -> Setting:
    """Return the reconstructed setting with changed friction or limits."""
    base = setting("reconstructed")
    return replace(base, friction=replace(base.friction, **changes))  # type: ignore[arg-type]


def _limits(first: float, second: float) -> Setting:
    return _friction(torque_limit=(first, second))


def _changed() -> Iterator[Variant]:
    """Give every fitted number changed by -20 and +20 %."""
    base = setting("reconstructed")
    inertia = base.I_m2 or 0.0
    for factor in CHANGES:
        percent = f"{100 * (factor - 1):+.0f} %"
        limit_1, limit_2 = factor * LIMITS[0], factor * LIMITS[1]
        yield Variant("fit", f"limit 1 {percent}", _limits(limit_1, LIMITS[1]))
        yield Variant("fit", f"limit 2 {percent}", _limits(LIMITS[0], limit_2))
        yield Variant("fit", f"I_m2 {percent}", replace(base, I_m2=factor * inertia))
        yield Variant("fit", f"duration {percent}", slowness=factor)
        yield Variant("fit", f"sizes {percent}", size=factor)


def variants() -> list[Variant]:
    """Return the reconstruction and everything it is varied by."""
    base, free = setting("reconstructed"), math.inf
    none = Friction("none")
    return [
        Variant("base", "as reconstructed"),
        Variant("limits", "no torque limits", _limits(free, free)),
        Variant("limits", "limit on joint 1 only", _limits(LIMITS[0], free)),
        Variant("limits", "limit on joint 2 only", _limits(free, LIMITS[1])),
        Variant("friction", "friction none", _friction(law="none")),
        Variant("friction", "friction none, no limits", replace(base, friction=none)),
        Variant("friction", "friction jump", _friction(law="jump")),
        Variant("friction", "friction jump, no limits", replace(base, friction=Friction("jump"))),
        Variant("friction", "dead zone off", _friction(dead_zone=NO_DEAD_ZONE)),
        Variant("v", "+v in the loop", v_gain=1.0),
        Variant("v", "v left out", v_gain=0.0),
        Variant("fit", "I_m2 = 0", replace(base, I_m2=0.0)),
        *_changed(),
        *(Variant("place", f"centre ({x:.2f}, {y:.2f})", centre=(x, y)) for x, y in CENTRES),
        *(
            Variant("numerics", f"friction speed {speed:g} rad/s", _friction(speed=speed))
            for speed in SPEEDS
        ),
        Variant("numerics", "physics step 0.5 ms", steps=2),
        Variant("numerics", "physics step 0.25 ms", steps=4),
    ]
