"""How well does a chain of N hinged segments stand for the beam? And write it as MJCF.

result = run(ChainConfig(out=Path("chain6.xml"), segments=6))
result.design.coupling_error, result.highest_frequency
"""

import math
from dataclasses import dataclass, field
from pathlib import Path

from flexsim.arm.beam import MODES, modal_integrals
from flexsim.arm.chain_design import SEGMENTS, ChainDesign, design_chain, plain_chain
from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.mjcf.chain_file import highest_frequency, longest_step
from flexsim.mjcf.chain_xml import chain_mjcf, write_chain
from flexsim.mjcf.designed import compiled
from flexsim.numerics.step_limits import LONGEST_STEP
from flexsim.numerics.types import Array
from studies.core.console import console
from studies.core.folder import to_json
from studies.core.table import Column, Table
from studies.core.text import spelled

SHOWN_STEP = 0.99  # of the limit of stability: the longest step we recommend


@dataclass(frozen=True)
class ChainConfig:
    """The chain to design, and the file to write it to."""

    out: Path
    """MJCF file to write; its name ends in .xml."""
    segments: int = SEGMENTS
    """Number of hinged segments: 3 to 16, or 3 to 200 when plain."""
    timestep: float = LONGEST_STEP
    """Physics step of the file [s]; RK4 needs it below 2.8 over the highest frequency."""
    plain: bool = False
    """Leave the chain untuned: hinges at the centres of equal cells h, stiffness EI/h."""
    robot: Parameters = field(default_factory=Parameters)
    """The robot whose beam the chain stands for."""
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
    """(3,) of the clamped beam [rad/s]."""
    highest_frequency: float
    """Of the compiled chain with both joints free, over poses of joint 2 [rad/s]."""
    longest_step: float
    """Longest step of RK4 on this chain, friction of its joints included [s]."""


def run(config: ChainConfig) -> ChainResult:
    """Return the chain and its MJCF; writes nothing.

    Raises:
        ParameterError: segments out of range, or a timestep that RK4 cannot take.
    """
    parameters = config.robot
    make = plain_chain if config.plain else design_chain
    design = make(parameters, config.segments)
    text = chain_mjcf(parameters, design, config.timestep)
    model = compiled(text)
    omega, longest = highest_frequency(model), longest_step(model) or math.inf
    if config.timestep >= longest:
        raise ParameterError(
            f"timestep is {config.timestep:g} s; RK4 on {config.segments} segments, with a highest "
            f"frequency of {omega:.0f} rad/s, needs {SHOWN_STEP * longest:.3g} s or less"
        )
    beam = modal_integrals(parameters, MODES)
    return ChainResult(config, design, text, beam.frequency, omega, longest)


def command(config: ChainConfig) -> None:
    """Write the MJCF file and print how the chain compares, as a table or one JSON object.

    Raises:
        ParameterError: segments out of range, or a timestep that RK4 cannot take.
        RunError: the file cannot be written.
    """
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


def as_dict(result: ChainResult) -> dict[str, object]:
    """Return what JSON has."""
    of_design = ("position", "stiffness", "frequency", "frequency_error", "Phi_error")
    more = ("moment_error", "tip_error", "compliance_error", "mac")
    return {
        "file": str(result.config.out),
        "segments": result.design.segments,
        "tuned": result.design.fitted,
        "timestep": result.config.timestep,
        **{name: getattr(result.design, name) for name in (*of_design, *more)},
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


def table(result: ChainResult) -> Table:
    """Return a row per clamped mode: frequencies, errors and MAC; below, what else there is."""
    design = result.design
    hertz = (omega[:MODES] / (2 * math.pi) for omega in (result.beam_frequency, design.frequency))
    errors = (design.frequency_error, design.Phi_error, design.moment_error, design.tip_error)
    columns = zip(*hertz, *errors, design.mac, strict=False)
    note = (
        f"largest error of a coupling (Phi, moment): {100 * design.coupling_error:.4f} %\n"
        f"static deflection under a force at the tip: {100 * design.compliance_error:+.4f} %\n"
        f"highest frequency with free joints: {result.highest_frequency:.0f} rad/s\n"
        f"RK4 is stable up to {1e3 * result.longest_step:.3g} ms; "
        f"the file has {1e3 * result.config.timestep:g} ms"
    )
    rows = [ModeRow(i, *map(float, each)) for i, each in enumerate(columns, 1)]
    return Table(rows, COLUMNS, note=note)
