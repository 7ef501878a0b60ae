"""Which chain of hinged segments is this beam? And put it into any MJCF file, on any body.

result = run(BeamConfig(Path("robot.xml"), "wrist", length=0.5, EI=0.349, rho=0.157))
result.made.frequency, result.made.text
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from flexsim.arm.chain_design import SEGMENTS
from flexsim.arm.graded_beam import GradedBeam
from flexsim.arm.graded_chain import GradedChain, design_graded
from flexsim.arm.hinged_beam import FITTED_MODES
from flexsim.errors import ParameterError
from flexsim.files.atomic import require_replaceable
from flexsim.mjcf.chain_xml import write_chain
from flexsim.mjcf.parts.attach import Attached, attached, compiled_file
from flexsim.mjcf.parts.beam_xml import UPRIGHT, BeamPart
from flexsim.mjcf.reading.elements import elements
from flexsim.numerics.step_limits import RK4_LIMIT
from studies.beam.stations import read_stations
from studies.core.console import console
from studies.core.folder import to_json
from studies.core.table import Column, Table
from studies.core.text import spelled

NAME = re.compile(r"[A-Za-z][A-Za-z0-9_.-]*")
EULER_LIMIT = 2.0  # of omega h, of semi-implicit steps without damping
LONGEST_PLACE = 1e3  # [m] of the clamp from its parent


@dataclass(frozen=True)
class BeamConfig:
    """A flexible beam, as a tuned chain of segments, put on a body of an MJCF file."""

    mjcf: Path
    """The MJCF file that the beam is put into; it stays as it is."""
    parent: str
    """Name of the body that carries the beam; world is the worldbody."""
    length: float | None = None
    """Length of the beam [m]; needed without --stations."""
    EI: float | None = None
    """Bending stiffness at the clamp [N m2]; needed without --stations."""
    rho: float | None = None
    """Linear density at the clamp [kg/m]; needed without --stations."""
    EI_out: float | None = None
    """Bending stiffness out of the plane [N m2], hinges about both axes; in the plane only unless
    given."""
    taper: float = 1.0
    """Thickness at the tip over that at the clamp [-], straight in between: the density goes with
    it, EI with its cube, EI_out with it."""
    taper_width: float = 1.0
    """Width at the tip over that at the clamp [-]: density and EI go with it, EI_out with its
    cube."""
    stations: Path | None = None
    """CSV file of the beam along its length instead: a line of names, s,EI,rho or s,EI,rho,EI_out
    (m, N m2, kg/m), then rows from the clamp, s = 0, to the tip; straight in between."""
    tip_mass: float = 0.0
    """Mass of a load at the tip [kg]."""
    tip_inertia: float = 0.0
    """Moment of inertia of that load about the tip [kg m2]."""
    segments: int = SEGMENTS
    """Number of hinged segments: 3 to 16."""
    zeta: float | None = None
    """Damping ratio of the beam's first mode [-], the others' in proportion to their frequencies;
    no damping unless given."""
    damping: float | None = None
    """Damping over stiffness of every hinge [s]; zeta gives the same by mode 1, unless given."""
    pos: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Place of the clamp in the parent's frame [m]."""
    quat: tuple[float, float, float, float] = UPRIGHT
    """Attitude of the clamp in the parent's frame [-]: the beam lies along its x-axis."""
    axis: Literal["z", "y"] = "z"
    """The clamp's axis about which the beam bends with EI."""
    prefix: str = "beam"
    """What the names of bodies, joints, sites and the default class begin with."""
    out: Path | None = None
    """MJCF file to write, in the folder of --mjcf if that needs other files; unless given beside
    it, as robot-beam.xml."""
    force: bool = False
    """Overwrite the file if it exists."""
    json: bool = False
    """Print one JSON object instead of a table."""


@dataclass(frozen=True, eq=False)
class BeamResult:
    """The chain, and the file with it."""

    config: BeamConfig
    part: BeamPart
    made: Attached

    @property
    def chain(self) -> GradedChain:
        """Hinges, springs and pieces."""
        return self.part.chain


def run(config: BeamConfig) -> BeamResult:
    """Return the file's text with the beam; writes nothing.

    Raises:
        ParameterError, ModelError: a number out of range, no such body, a name that is taken, or
            a file that does not compile or of which something else would change.
        RunError: the stations cannot be read.
    """
    beam, out = beam_of(config)
    _check(config)
    chain = design_graded(beam, config.segments)
    eta = config.damping or 0.0
    if config.zeta is not None:
        eta = 2 * config.zeta / float(beam.frequencies(FITTED_MODES)[0])
    norm = math.sqrt(sum(each * each for each in config.quat))
    w, x, y, z = (each / norm for each in config.quat)
    part = BeamPart(
        chain,
        config.prefix,
        eta,
        out,
        config.pos,
        (w, x, y, z) if norm != 1 else config.quat,
        config.axis,
    )
    return BeamResult(config, part, attached(config.mjcf, config.parent, part))


def beam_of(config: BeamConfig) -> tuple[GradedBeam, bool]:
    """Return the beam that the options are of, and whether it bends out of the plane, too.

    Raises:
        ParameterError: a number is missing, or out of range, or one that a file has is given, too.
        RunError: the stations cannot be read.
    """
    own = {"length": config.length, "EI": config.EI, "rho": config.rho}
    if config.stations is not None:
        given = own | {"EI_out": config.EI_out}
        for name, value in given.items():
            if value is not None:
                raise ParameterError(
                    f"--{name.replace('_', '-')} and --stations contradict each other: the file "
                    "has all of the beam; leave one out"
                )
        if (config.taper, config.taper_width) != (1, 1):
            raise ParameterError("--taper has no effect on --stations, which have it already")
        as_given = (1.0, 1.0, config.tip_mass, config.tip_inertia)
        place, EI, EI_out, rho = read_stations(config.stations)
        beam = GradedBeam(place, EI, EI if EI_out is None else EI_out, rho, *as_given)
        return beam, EI_out is not None
    missing = ", ".join(f"--{name}" for name, value in own.items() if value is None)
    if config.length is None or config.EI is None or config.rho is None:
        raise ParameterError(f"{missing} missing; give the beam's numbers, or --stations FILE.csv")
    numbers = (config.length, config.EI, config.rho, config.EI_out)
    taper = (config.taper, config.taper_width)
    beam = GradedBeam.uniform(*numbers, *taper, config.tip_mass, config.tip_inertia)
    return beam, config.EI_out is not None


def _check(config: BeamConfig) -> None:
    """Refuse options that are out of range or contradict each other."""
    if config.zeta is not None and config.damping is not None:
        raise ParameterError("--zeta and --damping contradict each other; leave one out")
    if config.zeta is not None and not 0 <= config.zeta < 1:
        raise ParameterError(f"zeta is {config.zeta:g}; give a fraction from 0, below 1")
    if config.damping is not None and not 0 <= config.damping < math.inf:
        raise ParameterError(f"damping is {config.damping:g} s; give a finite number, 0 or more")
    if not all(abs(each) <= LONGEST_PLACE for each in config.pos):
        raise ParameterError(f"pos is {config.pos}; give three finite numbers, at most 1000 m")
    norm = math.sqrt(sum(each * each for each in config.quat))
    if not 1e-6 < norm < math.inf:
        raise ParameterError(f"quat is {config.quat}; give four numbers, not all zero")
    if not NAME.fullmatch(config.prefix):
        raise ParameterError(
            f"prefix is {config.prefix!r}; give a letter, then letters, digits, '_', '-' or '.'"
        )


def path_of(config: BeamConfig) -> Path:
    """Return the file to write, beside the one that is read unless given."""
    if config.out is None:
        return config.mjcf.with_name(f"{config.mjcf.stem}-{config.prefix}.xml")
    return config.out


def command(config: BeamConfig) -> None:
    """Write the MJCF file and print how the chain compares, as a table or one JSON object.

    Raises:
        ParameterError, ModelError: as `run`.
        RunError: the file cannot be written, or is not for its folder.
    """
    path = path_of(config)
    if path.resolve() == config.mjcf.resolve():
        raise ParameterError(
            f"{path} is the file of --mjcf, which stays as it is; give another --out"
        )
    require_replaceable(path, force=config.force)
    result = run(config)
    _require_folder(config, result, path)
    write_chain(path, result.made.text, config.force)
    made = compiled_file(path, result.part)  # as it is on the disk
    if config.json:
        print(to_json(as_dict(result, path)))
        return
    out = console()
    out.print(f"{spelled(path)}: {_spoken(result)}", soft_wrap=True)
    out.print(table(result, made).render())


def _require_folder(config: BeamConfig, result: BeamResult, path: Path) -> None:
    """Refuse another folder than the file's where the text needs what lies beside it."""
    if path.parent.resolve() == config.mjcf.parent.resolve():
        return
    for element in elements(result.made.text):
        for name, value in element.attributes.items():
            if name.startswith("file") and value and not Path(value).is_absolute():
                raise ParameterError(
                    f"{path}: <{element.tag}> needs {value!r} beside the file; write it into "
                    f"{config.mjcf.parent}"
                )


def _spoken(result: BeamResult) -> str:
    """Return in words what was put where."""
    chain, planes = result.chain, "both planes" if result.part.out else "one plane"
    kind = "" if chain.beam.is_uniform else ", tapered"
    load = f", {chain.beam.tip_mass:g} kg at its tip" if chain.beam.tip_mass else ""
    return (
        f"a beam of {chain.beam.length:g} m{kind}{load} on body {result.config.parent!r}, "
        f"{len(chain.position)} segments, bending in {planes}"
    )


def as_dict(result: BeamResult, path: Path) -> dict[str, object]:
    """Return what JSON has, in SI units."""
    made, chain, part = result.made, result.chain, result.part
    return {
        "file": str(path),
        "parent": result.config.parent,
        "segments": len(chain.position),
        "joints": [*part.joints, *part.joints_out],
        "position": chain.position,
        "stiffness": chain.stiffness,
        "stiffness_out": chain.stiffness_out if part.out else None,
        "damping_over_stiffness": part.eta,
        "beam_frequency": made.wanted,
        "frequency": made.frequency,
        "beam_frequency_out": made.wanted_out if part.out else None,
        "frequency_out": made.frequency_out if part.out else None,
        "coupling_error": chain.coupling_error,
        "highest_frequency": made.highest,
        "timestep": made.timestep,
    }


@dataclass(frozen=True)
class ModeRow:
    """One clamped mode: frequencies [rad/s], and how far the chain's is off."""

    plane: str
    mode: int
    beam: float
    chain: float
    difference: float


COLUMNS = (
    Column("plane", ""),
    Column("mode", form="d"),
    Column("beam", unit="Hz", form=".5f", scale=1 / (2 * math.pi)),
    Column("chain", unit="Hz", form=".5f", scale=1 / (2 * math.pi)),
    Column("difference", form="+.0e"),
)


def table(result: BeamResult, made: Attached) -> Table:
    """Return a row per clamped mode of the file's beam, and what else there is to know."""
    rows = [
        ModeRow(plane, i, float(beam), float(chain), float(chain / beam - 1))
        for plane, wanted, found in (
            ("in", made.wanted, made.frequency),
            ("out", made.wanted_out, made.frequency_out),
        )
        for i, (beam, chain) in enumerate(zip(wanted, found, strict=True), start=1)
    ]
    rk4, euler = (1e3 * limit / made.highest for limit in (RK4_LIMIT, EULER_LIMIT))
    step = 1e3 * made.timestep
    short = "" if step < euler else ": shorten it, unless an implicit integrator damps this"
    note = (
        "Clamped, as the written file compiles, all else locked\n"
        f"largest error of a mode's coupling to the clamp's motion: "
        f"{100 * result.chain.coupling_error:.2g} %\n"
        f"highest frequency, clamped: {made.highest:.0f} rad/s; RK4 is stable up to {rk4:.3g} ms, "
        f"Euler and implicitfast {euler:.3g} ms\n"
        f"the file has {step:g} ms{short}; all else in it compiles as before, to the byte"
    )
    return Table(rows, COLUMNS, note=note)
