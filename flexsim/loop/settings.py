"""Named settings for what the paper leaves open: friction's reading, limits, motors, hardware.

>>> from flexsim.loop.settings import setting
>>> setting("simulink").friction.law
'simulink'
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.loop.friction import Friction
from flexsim.loop.hardware import IDEAL, Hardware

V_GAIN = -1.0  # factor of atan(v/(r+L)) in the measured angle of joint 2, in the paper


@dataclass(frozen=True)
class Setting:
    """One reading of the paper.

    Attributes:
        name: as the command line names it.
        friction: friction law and torque limits.
        meaning: one line for tables and help.
        I_m1, I_m2: inertias of the motors at the joints [kg m2]; None leaves the robot's own.
        hardware: sensors, computer and motors in the loop.
    """

    name: str
    friction: Friction
    meaning: str
    I_m1: float | None = None
    I_m2: float | None = None
    hardware: Hardware = IDEAL

    @property
    def steepest(self) -> tuple[float, float]:
        """Slopes of torque over the joints' rates, held over a step [N m s/rad].

        See `held_slopes`.
        """
        return held_slopes(self.friction, self.hardware)

    def applied(self, parameters: Parameters) -> Parameters:
        """Return the robot's parameters with this setting's motors."""
        motors = {"I_m1": self.I_m1, "I_m2": self.I_m2}
        return replace(parameters, **{k: v for k, v in motors.items() if v is not None})


def held_slopes(friction: Friction, hardware: Hardware) -> tuple[float, float]:
    """Return what friction and shafts, held over a step, take of it: slopes [N m s/rad].

    Friction's at its largest over temperature and configuration.
    """
    effects = hardware.effects
    rows = zip(friction.steepest, effects.friction_most, effects.steepest, strict=True)
    one, other = (own * factor + shaft for own, factor, shaft in rows)
    return one, other


SETTINGS = {
    item.name: item
    for item in (
        Setting("none", Friction("none"), "no friction but F, no torque limit"),
        Setting("simulink", Friction("simulink"), "(47) on the torque minus the dead zone's edge"),
        Setting("jump", Friction("jump"), "(47) on the whole torque beyond the dead zone"),
        Setting("opposing", Friction("opposing"), "Table 4's friction opposing the motion"),
        Setting(
            "stribeck",
            Friction("stribeck"),
            "'opposing' with 1.5 times Table 4's tau_0 at rest (stiction, assumed)",
        ),
        Setting(
            "lugre",
            Friction("lugre", dead_zone=((0.0, 0.0), (0.0, 0.0))),
            "LuGre's bristles with Table 4's tau_0 and mu in place of the dead zone (assumed)",
        ),
        Setting(
            "reconstructed",
            Friction("opposing", torque_limit=(9.83, 4.29)),
            "a fit under which Table 2 is bounded: 'opposing', torque limits, motor 2 (assumed)",
            I_m2=0.0557,
        ),
    )
}


DEFAULT_SETTING = "simulink"  # the blocks that the paper's words point to
FORMERLY = {"print": "jump", "joint": "opposing"}


def setting(name: str, hardware: Hardware = IDEAL) -> Setting:
    """Return the named setting, with this hardware.

    Raises:
        ParameterError: there is none of that name, or the hardware is none.
    """
    if not isinstance(hardware, Hardware):
        raise ParameterError(f"hardware is {hardware!r}; give a Hardware, as HARDWARE['bench']")
    if name in FORMERLY:
        raise ParameterError(f"setting {name!r} is called {FORMERLY[name]!r} now")
    if name not in SETTINGS:
        raise ParameterError(f"setting {name!r} is unknown; choose one of {', '.join(SETTINGS)}")
    return replace(SETTINGS[name], hardware=hardware)
