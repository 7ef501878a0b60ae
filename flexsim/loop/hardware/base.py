"""What stands between arm and controllers in a laboratory: sensors, computer, motors.

    >>> from flexsim.loop.hardware import HARDWARE
    >>> setting("simulink", HARDWARE["bench"])

`ideal` is the paper's: measured, computed and applied in one instant. `bench` is *assumed*: numbers
that a bench of this size would have. The order of things at a sample:

1. theta1 and theta2 are read from encoders, rounded to a count; v carries noise, or is made of
   what strain bridges read (`.sensing`);
2. the controllers compute a command, which waits for `delay` samples;
3. it is limited, to the lesser of the hardware's and the friction setting's limit;
4. amplifier and motor follow, each with a first-order lag, and each physics step gets the mean of
   what the motor gives over that step, exactly;
5. friction and what else is at the joints (`.effects`, `.joints`), then the plant.

Noise is a number per seed, run and sample (`flexsim.numerics.noise`): the same on every plant and
any number of threads, another in each run of a population.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from numbers import Real
from typing import Any

import numpy as np

from flexsim.errors import ParameterError
from flexsim.loop.hardware.effects import JointEffects
from flexsim.loop.hardware.numbers import HardwareNumbers, cascade
from flexsim.loop.hardware.parts import changed_words, given_parts
from flexsim.loop.hardware.sensing import Sensing
from flexsim.numerics.noise import SEED_MOST

COUNTS_MOST = 2**53  # per turn: a double's own digits, beyond any encoder
DELAY_MOST = 100  # samples, a tenth of a second at 1 kHz; the linear loop has two states for each
SENSED = ("bridges", "estimator")
BRIDGE_NUMBERS = ("places", "shift", "distance", "gain", "offset", "drift", "noise", "filter")
ONLY_WITH: dict[str, tuple[str, ...]] = {  # numbers of what is off unless one of these is given
    **{f"bridge_{name}": SENSED for name in BRIDGE_NUMBERS},
    **dict.fromkeys(("kalman_pose", "kalman_torque"), ("estimator",)),
    **dict.fromkeys(("tachometer_gain", "tachometer_noise"), ("tachometers",)),
    "ripple_periods": ("ripple",),
    "cogging_periods": ("cogging",),
    "warming": ("cold", "warm"),
    **dict.fromkeys(("pose_periods", "pose_phase"), ("pose",)),
    **dict.fromkeys(("shaft_damping", "motor_inertia", "encoder"), ("shaft",)),
}


def _whole(number: object) -> bool:
    return isinstance(number, int | np.integer) and not isinstance(number, bool)


def _real(number: object) -> bool:
    return isinstance(number, Real) and not isinstance(number, bool)


@dataclass(frozen=True)
class Hardware:
    """Sensors, computer and motors; the defaults are the paper's ideal ones.

    Attributes:
        delay: from measurement to torque, whole samples.
        torque_limit: largest torque of either motor [N m]; inf for none.
        counts: of both joints' encoders, per turn; 0 for exact angles.
        noise_v: root mean square of the noise on v [m].
        lag: time constant of the motors' first-order lag [s].
        seed: of the noise.
        sensing: what else there is to sensors. effects: to motors and joints.

    Raises:
        ParameterError: a number out of range.
    """

    delay: int = 0
    torque_limit: tuple[float, float] = (math.inf, math.inf)
    counts: int = 0
    noise_v: float = 0.0
    lag: float = 0.0
    seed: int = 0
    sensing: Sensing = field(default_factory=Sensing)
    effects: JointEffects = field(default_factory=JointEffects)

    def __post_init__(self) -> None:
        if not _whole(self.delay) or not 0 <= self.delay <= DELAY_MOST:
            raise ParameterError(
                f"hardware delay is {self.delay}; give a whole number of samples, 0 to {DELAY_MOST}"
            )
        if np.shape(self.torque_limit) != (2,) or not all(
            _real(each) and each > 0 for each in self.torque_limit
        ):
            raise ParameterError(
                f"hardware torque limit is {self.torque_limit}; give two numbers above 0 [N m], "
                "inf for none"
            )
        if not _whole(self.counts) or not 0 <= self.counts <= COUNTS_MOST:
            raise ParameterError(
                f"hardware counts are {self.counts}; give a whole number per turn, 0 for exact, up "
                f"to {COUNTS_MOST:.1e}"
            )
        if not _real(self.noise_v) or not 0 <= self.noise_v < math.inf:
            raise ParameterError(
                f"hardware noise is {self.noise_v} m; give a finite number, 0 or more"
            )
        if not _real(self.lag) or not 0 <= self.lag < math.inf:
            raise ParameterError(f"hardware lag is {self.lag} s; give a finite number, 0 or more")
        if not _whole(self.seed) or not 0 <= self.seed <= SEED_MOST:
            raise ParameterError(f"seed of the noise is {self.seed}; give 0 to {SEED_MOST}")

    @property
    def ideal(self) -> bool:
        """Whether nothing is in the way, whatever the seed."""
        exact = self.counts == 0 and self.noise_v == 0.0 and self.sensing == Sensing()
        still = self.delay == 0 and self.lag == 0.0 and self.effects == JointEffects()
        return exact and still and min(self.torque_limit) == math.inf

    def words(self) -> str:
        """Return it in words, for notes and tables."""
        if self.ideal:
            return "ideal"
        one, other = self.torque_limit
        parts = (
            (self.delay, f"delay of {self.delay} sample{'s' * (self.delay != 1)}"),
            (min(one, other) < math.inf, f"torques up to {one:g} and {other:g} N m"),
            (self.counts, f"{self.counts} counts a turn"),
            (self.noise_v, f"{1e3 * self.noise_v:g} mm rms of noise on v (seed {self.seed})"),
            (self.lag, f"motor lag of {1e3 * self.lag:g} ms"),
        )
        own = [text for there, text in parts if there]
        return ", ".join([*own, *changed_words(self.sensing), *changed_words(self.effects)])

    @property
    def quanta(self) -> tuple[float, float]:
        """Angles of a count at the joints [rad], 0 for exact."""
        one, other = (
            2 * math.pi / (self.counts * gear) if self.counts else 0.0 for gear in self.sensing.gear
        )
        return one, other

    @property
    def linear(self) -> Hardware:
        """What a linear loop knows of it.

        Delay, lags, shafts without their gaps, and bridges without noise, offset and drift.
        """
        own, sensing = self.effects, replace(self.sensing.quiet, gear=(1.0, 1.0))
        effects = JointEffects(
            amplifier=own.amplifier,
            shaft=own.shaft,
            shaft_damping=own.shaft_damping,
            motor_inertia=own.motor_inertia,
            encoder=own.encoder,
        )
        return Hardware(delay=self.delay, lag=self.lag, sensing=sensing, effects=effects)

    def numbers(self, period: float, substeps: int) -> HardwareNumbers:
        """Return the numbers as the compiled loop reads them.

        Args:
            period: control period [s], of `substeps` physics steps.
        """
        amplifier = self.effects.amplifier
        over_step = cascade(self.lag, amplifier, period / substeps)
        over_period = cascade(self.lag, amplifier, period)
        quantum_1, quantum_2 = self.quanta
        return HardwareNumbers(
            self.ideal,
            int(self.delay),
            float(self.torque_limit[0]),
            float(self.torque_limit[1]),
            quantum_1,
            quantum_2,
            float(self.noise_v),
            self.lag > 0 or amplifier > 0,
            over_step.motor,
            over_step.mean,
            over_period.mean,
            int(self.seed),
            self.lag > 0 and amplifier > 0,
            over_step.amplifier,
            over_step.own,
            over_step.mean_amplifier,
            over_period.mean_amplifier,
        )


IDEAL = Hardware()
BENCH = Hardware(delay=1, torque_limit=(10.0, 5.0), counts=8192, noise_v=1e-4)  # *assumed*
WORN = JointEffects(  # *assumed*; sources of the models in `.effects`
    amplifier=1e-4,  # a current loop of 1.6 kHz
    ripple=(0.02, 0.02),
    cogging=(0.05, 0.01),  # 0.5 and 0.2 % of the torque limits
    cold=(0.2, 0.2),
    warm=(-0.1, -0.1),
    pose=(0.1, 0.1),
    backlash=(5e-4, 5e-4),  # 1.7 minutes of arc, of a good planetary gear
    shaft=(2000.0, 200.0),
    shaft_damping=(2.0, 0.05),
    motor_inertia=(0.01, 5e-4),
)
HARDWARE = {
    "ideal": IDEAL,
    "delayed": Hardware(delay=1),  # ideal but for one sample of computing delay
    "bench": BENCH,
    "bridges": replace(  # *assumed*: the bench, v from two bridges of 1 % and half a microstrain
        BENCH,
        noise_v=0.0,
        sensing=Sensing(
            estimator="two-bridges",
            bridge_gain=(0.01, -0.01),
            bridge_offset=(1e-6, -1e-6),
            bridge_noise=(5e-7, 5e-7),
            bridge_filter=2e-4,
            tachometers="on",
            tachometer_noise=(5e-3, 5e-3),
        ),
    ),
    "worn": replace(BENCH, effects=WORN),
}


def named(name: str) -> Hardware:
    """Return the named hardware.

    Raises:
        ParameterError: there is none of that name.
    """
    if name not in HARDWARE:
        raise ParameterError(f"hardware {name!r} is unknown; choose one of {', '.join(HARDWARE)}")
    return HARDWARE[name]


def overridden(
    hardware: str,
    hardware_delay: int | None = None,
    hardware_torque_limit: tuple[float, float] | None = None,
    hardware_counts: int | None = None,
    hardware_noise: float | None = None,
    hardware_lag: float | None = None,
    hardware_with: Sequence[str] = (),
    seed: int = 0,
) -> Hardware:
    """Return the named hardware, with those of its numbers that are given.

    Args:
        hardware_with: numbers of `Sensing` and `JointEffects` as texts, such as 'gear=50,50'.

    Raises:
        ParameterError: there is none of that name, or a number is out of range.
    """
    given = {
        "delay": hardware_delay,
        "torque_limit": hardware_torque_limit,
        "counts": hardware_counts,
        "noise_v": hardware_noise,
        "lag": hardware_lag,
    }
    changes: dict[str, Any] = {name: x for name, x in given.items() if x is not None}
    base = named(hardware)
    parts = given_parts(hardware_with, (base.sensing, base.effects))
    for text in hardware_with:
        _require_effect(text, parts)
    return replace(base, seed=seed, sensing=parts[0], effects=parts[1], **changes)


def _require_effect(text: str, parts: tuple[Any, ...]) -> None:
    """Refuse a number, given as NAME=VALUE, of something that is off."""
    name = text.partition("=")[0].strip()
    needed = ONLY_WITH.get(name, ())
    off = {item.name: item.default for part in parts for item in fields(part)}
    is_now = {item.name: getattr(part, item.name) for part in parts for item in fields(part)}
    if is_now[name] == off[name] or not needed:
        return
    if all(is_now[each] == off[each] for each in needed):
        raise ParameterError(
            f"--hardware-with {text} has no effect without {' or '.join(needed)}; give that, too, "
            f"or leave {name} out"
        )
