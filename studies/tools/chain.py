"""How well does a chain of N hinged segments stand for the beam? And write it as MJCF.

result = run(ChainConfig(out=Path("chain6.xml"), segments=6))
result.design.coupling_error, result.highest_frequency
"""

import math
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

import numpy as np

from flexsim.arm.arms import named_arm
from flexsim.arm.beam import MODES, modal_integrals
from flexsim.arm.chain_design import SEGMENTS, ChainDesign, design_chain, front, plain_chain
from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.mjcf.arms.one_link import one_link_mjcf
from flexsim.mjcf.chain_file import highest_frequency, longest_step
from flexsim.mjcf.chain_xml import chain_mjcf, write_chain
from flexsim.mjcf.designed import compiled
from flexsim.numerics.step_limits import LONGEST_STEP
from flexsim.numerics.types import Array
from flexsim.robot import Robot
from studies.core.console import console
from studies.core.folder import to_json
from studies.core.options import ArmName
from studies.core.table import Column, Table
from studies.core.text import spelled
from studies.parity.two_flexible import two_flexible_tables, vibrating

SHOWN_STEP = 0.99  # of the limit of stability: the longest step we recommend


@dataclass(frozen=True)
class ChainConfig:
    """The chain to design, and the file to write it to."""

    out: Path | None = None
    """MJCF file to write; its name ends in .xml. Needed but with --front."""
    segments: int = SEGMENTS
    """Number of hinged segments: 3 to 16, or 3 to 200 when plain."""
    timestep: float = LONGEST_STEP
    """Physics step of the file [s]; RK4 needs it below 2.8 over the highest frequency."""
    plain: bool = False
    """Leave the chain untuned: hinges at the centres of equal cells h, stiffness EI/h."""
    bridges: tuple[float, float] | None = None
    """Places of two strain bridges from the clamp [m], written as the sites strain1 and strain2; no
    sites unless given."""
    robot: Parameters = field(default_factory=Parameters)
    """The robot whose beam the chain stands for."""
    arm: ArmName = "paper"
    """Which robot instead: one flexible link on a stand, or two flexible links, each a chain."""
    front: bool = False
    """Show what couplings, loaded frequencies and the step cost each other, and write nothing."""
    force: bool = False
    """Overwrite the file if it exists."""
    json: bool = False
    """Print one JSON object instead of a table."""


@dataclass(frozen=True, eq=False)
class ChainResult:
    """The chain, its file's text, and how it compares."""

    config: ChainConfig
    design: ChainDesign
    text: str
    """The MJCF."""
    beam_frequency: Array
    """(3,) of the clamped beam without a payload [rad/s]."""
    highest_frequency: float
    """Of the compiled chain with both joints free, over poses of joint 2 [rad/s]."""
    longest_step: float
    """Longest step of RK4 on this chain, friction of its joints included [s]."""


def run(config: ChainConfig) -> ChainResult:
    """Return the chain and its MJCF; writes nothing.

    Raises:
        ParameterError: segments out of range, or a timestep that RK4 cannot take.
    """
    parameters, write = config.robot, chain_mjcf
    if config.arm != "paper":
        if parameters != Parameters():
            raise ParameterError(f"--arm {config.arm} and --robot contradict each other; give one")
        parameters, write = replace(named_arm(config.arm).parameters, I_m1=0.0), one_link_mjcf
    make = plain_chain if config.plain else design_chain
    design = make(parameters, config.segments)
    text = write(parameters, design, config.timestep, config.bridges)
    model = compiled(chain_mjcf(parameters, design, config.timestep))
    omega, longest = highest_frequency(model), longest_step(model) or math.inf
    if config.timestep >= longest:
        raise ParameterError(
            f"timestep is {config.timestep:g} s; RK4 on {config.segments} segments, with a highest "
            f"frequency of {omega:.0f} rad/s, needs {SHOWN_STEP * longest:.3g} s or less"
        )
    beam = modal_integrals(replace(parameters, payload=0.0, payload_inertia=0.0), MODES)
    return ChainResult(
        replace(config, robot=parameters), design, text, beam.frequency, omega, longest
    )


def command(config: ChainConfig) -> None:
    """Write the MJCF file and print how the chain compares, as a table or one JSON object.

    Raises:
        ParameterError: segments out of range, or a timestep that RK4 cannot take; no file to
            write, or one with --front.
        RunError: the file cannot be written.
    """
    if config.front:
        show_front(config)
        return
    if config.out is None:
        raise ParameterError("--out is missing; name the MJCF file to write, as --out chain6.xml")
    if config.arm == "two-flexible":
        write_two_flexible(config)
        return
    result = run(config)
    path = write_chain(config.out, result.text, config.force)
    if config.json:
        print(to_json(as_dict(result)))
        return
    kind = "plain" if config.plain else "tuned"
    out = console()
    title = f"{spelled(path)}: {kind} chain of {config.segments} segments"
    out.print(title, soft_wrap=True)  # a long path stays whole
    out.print(table(result).render())


def write_two_flexible(config: ChainConfig) -> None:
    """Write the MJCF of two chains in series, and say how they vibrate.

    Raises:
        ParameterError: an option that has no effect; segments or timestep out of range.
    """
    if config.plain or config.robot != Parameters():
        option = "--plain" if config.plain else "--robot"
        raise ParameterError(f"{option} has no effect with --arm two-flexible; leave it out")
    robot = Robot.named("two-flexible")
    plant = robot.plant("chain", segments=config.segments, chain_step=config.timestep)
    path = write_chain(Path(config.out or ""), str(plant.mjcf), config.force)
    found = vibrating(robot, plant)
    if config.json:
        print(to_json({"file": str(path), "segments": config.segments} | vars(found)))
        return
    out = console()
    out.print(f"{spelled(path)}: tuned chains of {config.segments} segments each", soft_wrap=True)
    out.print(two_flexible_tables(found)[0].render())


def as_dict(result: ChainResult) -> dict[str, object]:
    """Return what JSON has."""
    of_design = ("position", "stiffness", "frequency", "frequency_error", "Phi_error")
    more = ("moment_error", "tip_error", "compliance_error", "mac")
    shared = ("rotation_error", "payload_error", "loaded", "loaded_error")
    return {
        "file": str(result.config.out),
        "segments": result.design.segments,
        "tuned": result.design.fitted,
        "timestep": result.config.timestep,
        **{name: getattr(result.design, name) for name in (*of_design, *more, *shared)},
        "beam_frequency": result.beam_frequency,
        "highest_frequency": result.highest_frequency,
        "longest_step": result.longest_step,
    }


@dataclass(frozen=True)
class ModeRow:
    """One clamped mode: frequencies [Hz], relative errors of the chain's, MAC [-]."""

    mode: int
    beam: float
    chain: float
    frequency: float
    Phi: float
    moment: float
    tip: float
    MAC: float


COLUMNS = (
    Column("mode", form="d"),
    Column("beam", unit="Hz", form=".5f"),
    Column("chain", unit="Hz", form=".5f"),
    Column("frequency", "error", "%", lambda row: f"{round(100 * row.frequency, 4) + 0.0:+.4f}"),
    *(Column(name, unit="%", form="+.4f", scale=100) for name in ("Phi", "moment", "tip")),
    Column("MAC", form=".4f"),
)


@dataclass(frozen=True)
class FrontRow:
    """One fit: its errors [-], the highest clamped frequency [rad/s], the step it allows [s]."""

    coupling: float
    payload: float
    rotation: float
    top: float
    longest_step: float
    chosen: str


FRONT_COLUMNS = (
    Column("coupling", "couplings", "%", ".4f", scale=100),
    Column("payload", "under payloads", "%", ".4f", scale=100),
    Column("rotation", "rotation", "%", "+.4f", scale=100),
    Column("top", "highest", "rad/s", ".0f"),
    Column("longest_step", "RK4 up to", "ms", ".3g", scale=1e3),
    Column("chosen", ""),
)


def front_rows(config: ChainConfig) -> list[FrontRow]:
    """Return what other weights of the fit lead to, by rising highest frequency.

    Raises:
        ParameterError: segments out of range, or an option that has no effect with --front.
    """
    for name, is_given in (
        ("--out", config.out is not None),
        ("--plain", config.plain),
        ("--timestep", config.timestep != LONGEST_STEP),
        ("--force", config.force),
    ):
        if is_given:
            raise ParameterError(f"{name} has no effect with --front, which writes nothing")
    chosen = design_chain(config.robot, config.segments)
    return [
        FrontRow(
            coupling=each.coupling_error,
            payload=each.payload_error,
            rotation=each.rotation_error,
            top=float(each.frequency[-1]),
            longest_step=longest_step(compiled(chain_mjcf(config.robot, each))) or math.inf,
            chosen="chosen" if np.array_equal(each.stiffness, chosen.stiffness) else "",
        )
        for each in front(config.robot, config.segments)
    ]


def show_front(config: ChainConfig) -> None:
    """Print the front as a table or one JSON object."""
    rows = front_rows(config)
    if config.json:
        print(to_json({"segments": config.segments, "front": [asdict(row) for row in rows]}))
        return
    note = (
        "largest errors of the couplings, of frequencies 1 to 3 under payloads up to the beam's "
        "mass with a radius of gyration up to 0.2 L, and of the tip's rotation under a moment"
    )
    title = f"Tuned chains of {config.segments} segments"
    console().print(Table(rows, FRONT_COLUMNS, title, note).render())


def _loaded(result: ChainResult) -> str:
    """Return a line on the frequencies with the robot's payload, '' without one."""
    p, design = result.config.robot, result.design
    if p.payload == 0 and p.payload_inertia == 0:
        return ""
    hertz = ", ".join(f"{omega / (2 * math.pi):.5f}" for omega in design.loaded)
    errors = ", ".join(f"{100 * error:+.3f}" for error in design.loaded_error)
    return f"with the payload, clamped: {hertz} Hz, off by {errors} %\n"


def table(result: ChainResult) -> Table:
    """Return a row per clamped mode: frequencies, errors and MAC; below, what else there is."""
    design = result.design
    hertz = (omega[:MODES] / (2 * math.pi) for omega in (result.beam_frequency, design.frequency))
    errors = (design.frequency_error, design.Phi_error, design.moment_error, design.tip_error)
    columns = zip(*hertz, *errors, design.mac, strict=False)
    note = (
        f"largest error of a coupling (Phi, moment): {100 * design.coupling_error:.4f} %\n"
        f"static deflection under a force at the tip: {100 * design.compliance_error:+.4f} %\n"
        f"rotation under a moment there: {100 * design.rotation_error:+.4f} %\n"
        f"frequencies 1 to 3 under payloads up to the beam's mass: off by up to "
        f"{100 * design.payload_error:.4f} %\n"
        f"{_loaded(result)}"
        f"highest frequency with free joints: {result.highest_frequency:.0f} rad/s\n"
        f"RK4 is stable up to {1e3 * result.longest_step:.3g} ms; "
        f"the file has {1e3 * result.config.timestep:g} ms"
    )
    rows = [ModeRow(i, *map(float, each)) for i, each in enumerate(columns, 1)]
    return Table(rows, COLUMNS, note=note)
