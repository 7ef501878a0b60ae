"""The chain as an MJCF file, written so that a person can read and edit it.

>>> from flexsim import Parameters
>>> from flexsim.arm.chain_design import design_chain
>>> from flexsim.mjcf.chain_xml import chain_mjcf, write_chain
>>> text = chain_mjcf(Parameters(), design_chain(Parameters(), 6))
>>> write_chain(Path("chain6.xml"), text)
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np

from flexsim.arm.chain_design import THUMB, TUNED, UNTUNED, ChainDesign
from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError, RunError
from flexsim.files.atomic import require_replaceable, write_text
from flexsim.mjcf.arm_xml import (
    BENT_TIP,
    HOME,
    actuators,
    beam_numbers,
    defaults,
    document,
    keyframes,
    looks,
    num,
    payload,
    sensors,
    stepping,
    worldbody,
)
from flexsim.numerics.step_limits import LONGEST_STEP

STRIP_WIDTH = 0.02  # [m] of the steel strip that (24) and (26) fit; stands on edge, along z
STRIP_THICKNESS = 0.001  # [m]
STRIP = f"""\
        <default class="strip">
          <!-- drawn 5 mm thick, to be seen; the steel strip is {1e3 * STRIP_THICKNESS:g} mm -->
          <geom type="box" material="steel"/>
        </default>
        <default class="mark">
          <geom type="cylinder" size="0.005 0.0115" material="mark"/>
        </default>
"""
KINDS = {  # what a file says of its chain, by its design
    TUNED: (
        "tuned",
        "Positions and stiffnesses of the hinges are tuned: the first three clamped frequencies\n"
        "    are the beam's own, its modes couple to the joints as the beam's do, and a payload\n"
        "    changes both alike",
    ),
    UNTUNED: (
        "plain",
        "The hinges are at the centres of equal cells h, with stiffness EI/h: not tuned",
    ),
    THUMB: (
        "rule-of-thumb",
        "The hinges are between equal cells h, the first fixed to the hub, with stiffness EI/h,\n"
        "    as MuJoCo's cable had them: not tuned",
    ),
}


class Piece(NamedTuple):
    """A rigid piece of the beam: length [m], mass [kg], moments of inertia about its centre."""

    length: float
    mass: float
    inertia: tuple[float, float, float]


def beam_pieces(parameters: Parameters, design: ChainDesign) -> list[Piece]:
    """Return the N+1 pieces of the beam, the root piece first, of total mass rho L.

    The moment about z is m l^2/12 of a slender rod, as in the beam's equations; the two others,
    which no planar motion excites, are those of the strip.
    """
    ends = np.concatenate([[0.0], design.position, [parameters.L]])
    pieces = []
    for length in np.diff(ends).tolist():
        mass = parameters.rho * length
        across = mass * (STRIP_WIDTH**2 + STRIP_THICKNESS**2) / 12
        flat = mass * (length**2 + STRIP_WIDTH**2) / 12
        pieces.append(Piece(length, mass, (across, flat, mass * length**2 / 12)))
    return pieces


def bent_angles(parameters: Parameters, design: ChainDesign) -> list[float]:
    """Return hinge angles (N,) [rad] under the tip force that bends the beam by BENT_TIP L."""
    force = BENT_TIP * parameters.L / parameters.static_compliance  # [N]
    moment = force * (parameters.L - design.position)  # (N,) about each hinge
    angles: list[float] = (moment / design.stiffness).tolist()
    return angles


def chain_mjcf(
    parameters: Parameters,
    design: ChainDesign,
    timestep: float = LONGEST_STEP,
    bridges: tuple[float, float] | None = None,
) -> str:
    """Return the text of the MJCF file of the arm with this chain for a beam.

    Args:
        parameters: the robot; design: hinges and stiffnesses of the same robot's chain.
        timestep: physics step [s]. bridges: places of strain bridges, from the clamp [m].

    Raises:
        ParameterError: the timestep is not a finite number above 0, or a bridge is off the beam.
    """
    if not (math.isfinite(timestep) and timestep > 0):
        raise ParameterError(f"timestep is {timestep!r} s; give a finite number, more than 0")
    for place in bridges or ():
        if not 0 <= place <= parameters.L:
            raise ParameterError(
                f"a strain bridge is {place:g} m from the clamp, off the beam; give 0 to "
                f"{parameters.L:g} m"
            )
    if bridges and bridges[0] == bridges[1]:
        raise ParameterError(
            f"both strain bridges are {bridges[0]:g} m from the clamp, where they read the same; "
            "give two places"
        )
    straight = num(*HOME, *[0.0] * design.segments)
    bent = [round(angle, 6) for angle in bent_angles(parameters, design)]
    return document(
        _header(design, timestep),
        looks(parameters),
        defaults(strip=STRIP),
        worldbody(parameters, beam_bodies(parameters, design, bridges)),
        actuators(parameters),
        sensors(hinge_sensors(design)),
        keyframes(parameters, straight, num(*HOME, *bent)),
        beam_numbers(parameters),
    )


def write_chain(path: Path, text: str, force: bool = False) -> Path:
    """Return the path after writing the MJCF there, whole or not at all.

    Raises:
        RunError: the file exists and force is not set, the name does not end in .xml, or the
            folder is missing or not writable.
    """
    path = Path(path)
    if path.suffix != ".xml":
        raise RunError(f"{path}: an MJCF file's name ends in .xml; name it so")
    require_replaceable(path, force=force)
    if not path.parent.is_dir():
        raise RunError(f"{path}: there is no folder {path.parent}; make it first")
    write_text(path, text, force=force)
    return path


def _header(design: ChainDesign, timestep: float) -> str:
    kind, chosen = KINDS[design.kind]
    return f"""
<mujoco model="flexible arm, {kind} chain of {design.segments}">
  <!--
    A planar arm: a rigid link, and a flexible beam clamped to a hub on its end. The beam is a
    rigid root piece and {design.segments} rigid segments, joined by hinges with springs.
    {chosen}.
    Written by `flexsim chain`. SI units. Numbers in brackets are the paper's equations.
  -->
{stepping(timestep)}"""


def beam_bodies(
    p: Parameters, design: ChainDesign, bridges: tuple[float, float] | None = None
) -> str:
    """Return the nested bodies of the beam."""
    rho = num(p.rho)
    root, *segments = beam_pieces(p, design)
    how = "tuned" if design.fitted else "EI/h"
    lines = [
        "        <!-- clamped at r, (21); masses: rho times the length, moments about z: m l^2/12,",
        f"             with rho = {rho} kg/m, (24); positions and stiffnesses of the hinges:",
        f"             {how}, for L = {num(p.L)} m, (22), and EI = {num(p.EI)} N m2, (26);",
        f"             damping: {num(p.eta)} s times stiffness, so that mode 1 of the beam has the",
        f"             ratio {num(p.zeta)}, assumed -->",
        f'        <body name="root" pos="{num(p.r)} 0 0">',
        *_piece(" " * 10, root),
        *_bridges(" " * 10, design, 0, bridges),
    ]
    start = root.length
    for j, (piece, stiffness) in enumerate(zip(segments, design.stiffness, strict=True), start=1):
        pad = " " * (8 + 2 * j)
        lines += [
            f'{pad}<body name="segment{j}" pos="{num(start)} 0 0">',
            f'{pad}  <joint name="hinge{j}" stiffness="{num(stiffness)}"'
            f' damping="{num(p.eta * stiffness)}"/>',
            *_piece(pad + "  ", piece),
            f'{pad}  <geom class="mark"/>',
            *_bridges(pad + "  ", design, j, bridges),
        ]
        start = piece.length
    pad = " " * (10 + 2 * design.segments)
    lines += [
        f'{pad}<geom class="visual" type="sphere" size="0.009" pos="{num(start)} 0 0"'
        ' material="tip"/>',
        f'{pad}<site name="tip" pos="{num(start)} 0 0"/>',
        *payload(p, pad, start),
    ]
    lines += [" " * (8 + 2 * j) + "</body>" for j in range(design.segments, -1, -1)]
    return "\n".join(lines)


def _bridges(
    pad: str, design: ChainDesign, piece: int, bridges: tuple[float, float] | None
) -> list[str]:
    """Return the sites of the strain bridges that are on a piece of the beam, 0 the root."""
    own = []
    for i, place in enumerate(bridges or (), start=1):
        on = int(np.searchsorted(design.position, place, side="right"))
        if on == piece:
            start = 0.0 if on == 0 else float(design.position[on - 1])
            own.append(f'{pad}<site name="strain{i}" pos="{num(place - start)} 0 0"/>')
    return own


def _piece(pad: str, piece: Piece) -> list[str]:
    centre, inertia = num(piece.length / 2), num(*piece.inertia)
    return [
        f'{pad}<inertial pos="{centre} 0 0" mass="{num(piece.mass)}"',
        f'{pad}          diaginertia="{inertia}"/>',
        f'{pad}<geom class="strip" pos="{centre} 0 0" size="{centre} 0.0025'
        f' {num(STRIP_WIDTH / 2)}"/>',
    ]


def hinge_sensors(design: ChainDesign) -> str:
    """Return the lines of the hinges' sensors."""
    return "".join(
        f'\n    <jointpos name="hinge{j}" joint="hinge{j}"/>' for j in range(1, design.segments + 1)
    )
