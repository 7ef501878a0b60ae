"""What may stand in a study file: every table and number, typed.

>>> read_study(Path("study.toml")).study.plants[0].model
'chain'

`reading` makes a `Study` of a file's text, `resolving` puts numbers in the place of names and
files. A file's lists may hold names alone: "bench" stands for { use = "bench" }.
"""

from __future__ import annotations

from dataclasses import fields
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Strict, Tag, create_model

from flexsim.arm.parameters import Parameters
from flexsim.loop.hardware import JointEffects, Sensing
from flexsim.loop.metrics import WEIGHTS
from flexsim.loop.settings import V_GAIN
from flexsim.numerics.clocks import PERIOD
from flexsim.shaping.aids import PLAIN
from studies.core.evidence.repeats import PERTURBATION
from studies.tuning.individuals import TERMS_MOST

Finite = Annotated[float, Field(allow_inf_nan=False)]
Pair = Annotated[tuple[float, float], Strict(False)]
Three = Annotated[tuple[Finite, Finite, Finite], Strict(False)]
Zone = Annotated[tuple[Pair, Pair], Strict(False)]
Root = float | Pair  # real, or real and imaginary part
Matrix = list[list[float]]

BATCH_LEAST, BATCH_MOST = 50, 1 << 16  # runs
SEED_MOST = 2**32 - 1
DRAWS_MOST = 10_000_000  # of a sweep, which are kept


class Part(BaseModel):
    """A table of the file: nothing unknown in it, nothing converted, nothing changed later."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class FirstLinkPart(Part):
    """The beam that link 1 is, where it bends; of its length and inertia, L_R and I_R0."""

    EI: float | None = None
    rho: float | None = None
    r: float | None = None
    zeta: float | None = None


class _Robot(Part):
    name: str | None = None
    arm: Literal["paper", "one-link", "two-flexible"] | None = None  # whose numbers are usual
    link1: FirstLinkPart | None = None
    mjcf: str | None = None  # a file, relative to the study's
    beam: Literal["file", "analytic"] = "file"
    joint1: str | None = None  # the file's own names of its parts
    joint2: str | None = None
    hub: str | None = None
    tip: str | None = None
    motor1: str | None = None
    motor2: str | None = None
    modal_damping: list[float] = []
    stiffness: float = 1.0  # factors of the beam's own
    density: float = 1.0


_NUMBERS: dict[str, Any] = {item.name: (float, item.default) for item in fields(Parameters)}
RobotPart: Any = create_model("RobotPart", __base__=_Robot, **_NUMBERS)
NUMBERS = tuple(_NUMBERS)
OF_FILE = ("name", "mjcf", "beam", "joint1", "joint2", "hub", "tip", "motor1", "motor2")
WITH_FILE = (*OF_FILE, "stiffness", "density", "payload")  # what may stand beside `mjcf`


class PlantPart(Part):
    """A model of the robot, by its name, the physics step [s], a chain's integrator."""

    model: str
    name: str | None = None
    step: float | None = None
    integrator: Literal["RK4", "Euler", "implicitfast", "discrete"] | None = None


class GainsPart(Part):
    """k1 D^nu1 + k2 D^nu2 + k3, (3), (4) [N m s^nu/rad]."""

    k1: float = 0.0
    nu1: float | None = None
    k2: float = 0.0
    nu2: float | None = None
    k3: float = 0.0


class PidPart(Part):
    """kp + ki/s + kd s/(1 + filter_time s) [N m/rad, N m/(rad s), N m s/rad, s]."""

    kp: float = 0.0
    ki: float = 0.0
    kd: float = 0.0
    filter_time: float = 0.0


class FilterPart(Part):
    """(b, a) in powers of 1/z, as scipy.signal.lfilter takes them."""

    b: list[float]
    a: list[float] = [1.0]


class SectionsPart(Part):
    """Second-order sections (k, 6), as scipy.signal.sosfilt takes them."""

    sos: Matrix


class ZerosPart(Part):
    """Zeros, poles and gain in z; a complex one as [real, imaginary]."""

    zeros: list[Root]
    poles: list[Root]
    gain: float


def kind_of_joint(given: Any) -> str:
    """Return which of a joint's kinds a table is, by what stands in it."""
    keys = set(given) if isinstance(given, dict) else set(getattr(given, "model_fields_set", ()))
    for tag, own in (
        ("sos", {"sos"}),
        ("zpk", {"zeros", "poles", "gain"}),
        ("ba", {"b", "a"}),
        ("pid", {"kp", "ki", "kd", "filter_time"}),
    ):
        if keys & own:
            return tag
    return "gains"


JOINTS = {  # the kinds of a joint's controller by the tags of `kind_of_joint`
    "gains": GainsPart,
    "pid": PidPart,
    "ba": FilterPart,
    "sos": SectionsPart,
    "zpk": ZerosPart,
}
JointPart = Annotated[
    Annotated[GainsPart, Tag("gains")]
    | Annotated[PidPart, Tag("pid")]
    | Annotated[FilterPart, Tag("ba")]
    | Annotated[SectionsPart, Tag("sos")]
    | Annotated[ZerosPart, Tag("zpk")],
    Discriminator(kind_of_joint),
]


class ControllerPart(Part):
    """Controllers of both joints, in one of the ways that `WAYS` names."""

    name: str | None = None
    use: str | None = None  # one that comes with flexsim
    run: str | None = None  # the folder of a run of flexsim tune
    function: str | None = None  # file.py:function or module:function
    options: dict[str, Any] = {}
    joint1: JointPart | None = None
    joint2: JointPart | None = None
    A: Matrix | None = None
    B: Matrix | None = None
    C: Matrix | None = None
    D: Matrix | None = None
    realisation: str | None = None
    terms: int = Field(default=10, ge=1, le=TERMS_MOST)
    v_gain: Finite = V_GAIN
    trajectories: list[str] | None = None  # the names of those that it is run on; all unless given


WAYS = {  # ways to give a controller: the keys that each takes
    "use": ("use",),
    "run": ("run",),
    "function": ("function", "options"),
    "joint1, joint2": ("joint1", "joint2", "realisation", "terms"),
    "A, B, C, D": ("A", "B", "C", "D"),
}


class TrajectoryPart(Part):
    """A shape with its numbers, or waypoints [m, s]."""

    name: str | None = None
    use: str | None = None
    shape: Literal["line", "two-loop", "circle", "turn"] | None = None
    start: Pair | None = None  # of a line [m], of a turn of both joints [rad]
    end: Pair | None = None
    centre: Pair | None = None
    half_width: float | None = None
    half_height: float | None = None
    points: list[Pair] | None = None
    file: str | None = None  # CSV of x,y or t,x,y
    times: list[float] | None = None
    time_law: Literal["quintic", "constant-speed", "spline", "minimum-jerk"] | None = None
    duration: float | None = None
    lead: float | None = None
    hold: float | None = None
    aid: str = PLAIN  # of `flexsim.shaping.aids`, as the first robot needs it
    pulse: Pair = (0.0, 0.0)  # [N m] at the motors
    pulse_span: Pair = (1.0, 1.05)  # [s] when it begins and ends
    push: Finite = 0.0  # [N s] at the tip, at the start


SHAPE_KEYS = ("shape", "start", "end", "centre", "half_width", "half_height")
WAY_KEYS = ("points", "file", "times")
HELPED = ("aid", "pulse", "pulse_span", "push")  # of any trajectory


class SettingPart(Part):
    """Friction, limits and motors: a named setting, and what is other than there."""

    name: str | None = None
    use: str | None = None
    law: Literal["none", "simulink", "jump", "opposing", "stribeck", "lugre"] | None = None
    dead_zone: Zone | None = None
    tau_0: Pair | None = None
    mu: Pair | None = None
    speed: float | None = None
    torque_limit: Pair | None = None
    stiction: Pair | None = None
    stribeck: float | None = None
    sigma_0: Pair | None = None
    sigma_1: Pair | None = None
    I_m1: Finite | None = None
    I_m2: Finite | None = None


class _Hardware(Part):
    """Sensors, computer and motors: named ones, and what is other than there."""

    name: str | None = None
    use: str | None = None
    delay: int | None = None
    torque_limit: Pair | None = None
    counts: int | None = None
    noise_v: float | None = None
    lag: float | None = None


def _kinds(kind: type) -> dict[str, Any]:
    """Return the numbers of a part of the laboratory, each of which may be left out."""
    forms: dict[type, Any] = {tuple: Pair, str: str, float: float}
    return {item.name: (forms[type(item.default)] | None, None) for item in fields(kind)}


LABORATORY = (Sensing, JointEffects)
HardwarePart: Any = create_model(
    "HardwarePart",
    __base__=_Hardware,
    **{name: each for kind in LABORATORY for name, each in _kinds(kind).items()},
)


class NumbersPart(Part):
    """What a number of the file is varied over: exactly one of these."""

    values: list[float] | None = None
    linear: Three | None = None  # from, to, how many
    log: Three | None = None
    uniform: Pair | None = None
    log_uniform: Pair | None = Field(None, alias="log-uniform")
    normal: Pair | None = None  # mean, standard deviation


class SweepPart(Part):
    """What is varied: numbers by their paths, and how distributions are sampled."""

    sampler: Literal["sobol", "latin-hypercube", "saltelli"] = "sobol"
    samples: int = Field(default=64, ge=1, le=DRAWS_MOST)
    numbers: dict[str, NumbersPart] = {}


class Study(Part):
    """A study: what is crossed, how often it is repeated, what is varied."""

    title: str = ""
    seed: int = Field(1, ge=0, le=SEED_MOST)
    repeats: int = Field(20, ge=1)
    perturbation: float = Field(PERTURBATION, ge=0, lt=0.1)
    period: float = Field(PERIOD, gt=0)
    weights: Three = WEIGHTS
    batch: int = Field(256, ge=BATCH_LEAST, le=BATCH_MOST)
    traces: Literal["none", "nominal", "all"] = "none"
    check: int = Field(0, ge=0)
    robots: list[RobotPart]
    plants: list[PlantPart]
    controllers: list[ControllerPart]
    trajectories: list[TrajectoryPart]
    settings: list[SettingPart]
    hardware: list[HardwarePart]
    sweep: SweepPart = Field(default_factory=SweepPart)


LISTS = {  # the lists that are crossed, with what a name alone stands for
    "robots": "mjcf",
    "plants": "model",
    "controllers": "use",
    "trajectories": "use",
    "settings": "use",
    "hardware": "use",
}
PARTS: dict[str, Any] = {
    "robots": RobotPart,
    "plants": PlantPart,
    "controllers": ControllerPart,
    "trajectories": TrajectoryPart,
    "settings": SettingPart,
    "hardware": HardwarePart,
}
