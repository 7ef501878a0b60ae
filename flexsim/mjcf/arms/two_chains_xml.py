"""The arm with two flexible links as MJCF: a tuned chain for each, motors and payload as ever.

>>> arm = named_arm("two-flexible")
>>> text = two_chains_mjcf(arm, segments=(6, 6))
"""

from __future__ import annotations

import math

from flexsim.arm.arms import Arm
from flexsim.arm.chain_design import ChainDesign
from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.mjcf.arm_xml import (
    BEAM_NUMBERS,
    HOME,
    SMALLEST_DISC,
    actuators,
    defaults,
    document,
    looks,
    num,
    payload,
    seen_from,
    sensors,
    stepping,
)
from flexsim.mjcf.chain_xml import STRIP, Piece, beam_pieces, bent_angles
from flexsim.numerics.step_limits import LONGEST_STEP


def two_chains_mjcf(
    arm: Arm, designs: tuple[ChainDesign, ChainDesign], timestep: float = LONGEST_STEP
) -> str:
    """Return the text of the MJCF file of an arm whose links both bend.

    Args:
        arm: whose link 1 bends; designs: of the chains of `arm.beam1` and of link 2.
        timestep: physics step [s].

    Raises:
        ParameterError: link 1 is rigid, or the timestep is not a finite number above 0.
    """
    if not (math.isfinite(timestep) and timestep > 0):
        raise ParameterError(f"timestep is {timestep!r} s; give a finite number, more than 0")
    p, (first, second) = arm.parameters, designs
    names = [f"link1_hinge{j}" for j in range(1, first.segments + 1)]
    names += [f"hinge{j}" for j in range(1, second.segments + 1)]
    still = [0.0] * first.segments
    bent = [round(angle, 6) for angle in bent_angles(p, second)]
    home = num(HOME[0], *still, HOME[1], *[0.0] * second.segments)
    return document(
        _header(first, second, timestep),
        looks(p),
        defaults(strip=STRIP),
        _worldbody(arm, first, second),
        actuators(p),
        sensors("".join(f'\n    <jointpos name="{name}" joint="{name}"/>' for name in names)),
        f"""
  <keyframe>
    <key name="home" qpos="{home}"/>
    <!-- link 1 straight, link 2 at rest under a force at the tip, across it -->
    <key name="bent" qpos="{num(HOME[0], *still, HOME[1], *bent)}"/>
  </keyframe>""",
        _beam_numbers(arm),
    )


def _header(first: ChainDesign, second: ChainDesign, timestep: float) -> str:
    return f"""
<mujoco model="arm with two flexible links, chains of {first.segments} and {second.segments}">
  <!--
    A planar arm of two flexible beams: the first clamped to hub 1 on joint 1, the second to hub 2,
    which turns on joint 2 at the end of the first. Each beam is a rigid root piece and rigid
    segments, joined by hinges with springs whose places and stiffnesses are tuned: the first three
    clamped frequencies are the beam's own, with no load and, closely, under any.
    SI units. The numbers are those of De Luca and Siciliano (1991); models/README.md has each.
  -->
{stepping(timestep)}"""


def _worldbody(arm: Arm, first: ChainDesign, second: ChainDesign) -> str:
    p, beam1 = arm.parameters, arm.beam1
    depth = 2 * (first.segments + 1)  # of indentation within link 1
    hub2 = _hub2(arm, second)
    inner = [" " * depth + line if line else line for line in hub2]
    hub = num(*[arm.hub_inertia] * 3)
    lines = [
        "",
        "  <worldbody>",
        seen_from(p),
        '    <geom name="table" class="visual" type="plane" size="2 2 0.1" pos="0 0 -0.1"',
        '          material="table"/>',
        '    <geom name="base" class="motor" size="0.05 0.038" pos="0 0 -0.062"/>',
        "",
        '    <body name="link1" childclass="arm">',
        "      <!-- damping: friction of joint 1; armature: inertia of motor 1 -->",
        f'      <joint name="joint1" damping="{num(p.F_1 * p.r_1**2)}" armature="{num(p.I_m1)}"/>',
        "      <!-- hub 1, its inertia about joint 1; its mass never enters -->",
        f'      <inertial pos="0 0 0" mass="1" diaginertia="{hub}"/>',
        '      <geom class="motor" size="0.05 0.016"/>',
        *_chain("      ", "link1_", beam1, first, arm.eta1(), inner),
        "    </body>",
        "  </worldbody>",
    ]
    return "\n".join(lines)


def _hub2(arm: Arm, design: ChainDesign) -> list[str]:
    """Return the lines of hub 2 with all that it carries, where link 1 is one body."""
    p = arm.parameters
    disc = num(round(max(0.6 * p.r, SMALLEST_DISC), 4))
    pad = " " * (8 + 2 * design.segments + 2)
    end = p.L - float(design.position[-1])  # of the last segment
    tip = [
        f'{pad}<geom class="visual" type="sphere" size="0.009" pos="{num(end)} 0 0"'
        ' material="tip"/>',
        f'{pad}<site name="tip" pos="{num(end)} 0 0"/>',
        *payload(p, pad, end),
    ]
    return [
        "      <!-- damping: friction of joint 2; armature: inertia of motor 2 -->",
        f'      <joint name="joint2" damping="{num(p.F_2 * p.r_2**2)}" armature="{num(p.I_m2)}"/>',
        "      <!-- hub 2: its mass, and its inertia about joint 2 -->",
        f'      <inertial pos="0 0 0" mass="{num(p.m_H)}" diaginertia="{num(*[p.I_H] * 3)}"/>',
        f'      <geom class="motor" size="{disc} 0.016"/>',
        '      <site name="hub"/>',
        *_chain("      ", "", p, design, p.eta, tip),
    ]


def _chain(
    pad: str, name: str, p: Parameters, design: ChainDesign, eta: float, end: list[str]
) -> list[str]:
    """Return the lines of a beam's chain on its hub.

    Args:
        pad: before the first line. name: before `root`, `segment1`, `hinge1`, ...
        p: of the beam; eta: its Kelvin-Voigt time [s]. end: lines in the last segment.
    """
    root, *segments = beam_pieces(p, design)
    lines = [
        f"{pad}<!-- masses: rho times the length, moments about z: m l^2/12, rho = {num(p.rho)}",
        f"{pad}     kg/m; hinges tuned for L = {num(p.L)} m and EI = {num(p.EI)} N m2; damping:",
        f"{pad}     {num(eta)} s times stiffness, so that mode 1 has the ratio {num(p.zeta)} -->",
        f'{pad}<body name="{name}root" pos="{num(p.r)} 0 0">',
        *_piece(pad + "  ", root),
    ]
    start, inner = root.length, pad
    for j, (piece, stiffness) in enumerate(zip(segments, design.stiffness, strict=True), start=1):
        inner += "  "
        lines += [
            f'{inner}<body name="{name}segment{j}" pos="{num(start)} 0 0">',
            f'{inner}  <joint name="{name}hinge{j}" stiffness="{num(stiffness)}"'
            f' damping="{num(eta * stiffness)}"/>',
            *_piece(inner + "  ", piece),
            f'{inner}  <geom class="mark"/>',
        ]
        start = piece.length
    if name:  # joint 2 is at the end of link 1
        end = [f'{inner}  <body name="hub" pos="{num(start)} 0 0">', *end, f"{inner}  </body>"]
    lines += end
    lines += [pad + "  " * j + "</body>" for j in range(design.segments, -1, -1)]
    return lines


def _piece(pad: str, piece: Piece) -> list[str]:
    centre, inertia = num(piece.length / 2), num(*piece.inertia)
    return [
        f'{pad}<inertial pos="{centre} 0 0" mass="{num(piece.mass)}"',
        f'{pad}          diaginertia="{inertia}"/>',
        f'{pad}<geom class="strip" pos="{centre} 0 0" size="{centre} 0.0025 0.01"/>',
    ]


def _beam_numbers(arm: Arm) -> str:
    """Return which uniform beams the file stands for."""
    lines = ["  <!-- the beams that this file stands for; link 1's r is hub 1's radius -->"]
    lines += ["  <custom>"]
    for beam, values, count in (("beam1", arm.beam1, 5), ("beam", arm.parameters, 7)):
        for name, meaning in BEAM_NUMBERS[:count]:
            lines += [
                f"    <!-- {meaning} -->",
                f'    <numeric name="{beam}_{name}" data="{num(getattr(values, name))}"/>',
            ]
    return "\n".join([*lines, "  </custom>"])
