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

from flexsim.arm.chain_design import ChainDesign
from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError, RunError
from flexsim.numerics.atomic import require_replaceable, write_text

STRIP_WIDTH = 0.02  # [m] of the steel strip that (24) and (26) fit; stands on edge, along z
STRIP_THICKNESS = 0.001  # [m]
LINK_MASS = 1.0  # [kg] any: link 1 turns about its own centre of mass
HOME = (0.3, 1.2)  # [rad] theta1, theta2 of the keyframes: elbow bent, tip in the workspace
BENT_TIP = 0.05  # v/L of the keyframe `bent`
DIGITS = 12  # significant, so that the compiled model matches to 1e-11


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


def chain_mjcf(parameters: Parameters, design: ChainDesign, timestep: float = 1e-3) -> str:
    """Return the text of the MJCF file of the arm with this chain for a beam.

    Args:
        parameters: the robot; design: hinges and stiffnesses of the same robot's chain.
        timestep: physics step [s].

    Raises:
        ParameterError: the timestep is not a finite number above 0.
    """
    if not (math.isfinite(timestep) and timestep > 0):
        raise ParameterError(f"timestep is {timestep!r} s; give a finite number, more than 0")
    sections = (
        _header(design, timestep),
        _looks(parameters),
        _defaults(parameters),
        _worldbody(parameters, design),
        _actuators(parameters),
        _sensors(design),
        _keyframes(parameters, design),
    )
    return "\n\n".join(section.strip("\n") for section in sections) + "\n</mujoco>\n"


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


def _f(*values: float) -> str:
    """Return numbers as MJCF writes them: short where they are, else 12 digits."""
    return " ".join(f"{value + 0.0:.{DIGITS}g}" for value in values)


def _header(design: ChainDesign, timestep: float) -> str:
    kind = "tuned" if design.tuned else "plain"
    chosen = (
        "Positions and stiffnesses of the hinges are tuned: the first three clamped frequencies\n"
        "    are the beam's own, and its modes couple to the joints as the beam's do"
        if design.tuned
        else "The hinges are at the centres of equal cells h, with stiffness EI/h: not tuned"
    )
    return f"""
<mujoco model="flexible arm, {kind} chain of {design.segments}">
  <!--
    A planar arm: a rigid link, and a flexible beam clamped to a hub on its end. The beam is a
    rigid root piece and {design.segments} rigid segments, joined by hinges with springs.
    {chosen}.
    Written by `flexsim chain`. SI units. Numbers in brackets are the paper's equations.
  -->
  <compiler angle="radian" autolimits="true" inertiafromgeom="false"/>

  <!-- The arm moves in a horizontal plane: no gravity, nothing to touch. Diverging runs are for
       the caller to judge: no automatic reset. RK4 needs timestep * highest frequency < 2.8 -->
  <option timestep="{_f(timestep)}" integrator="RK4">
    <flag contact="disable" gravity="disable" autoreset="disable"/>
  </option>"""


def _looks(p: Parameters) -> str:
    reach = p.L_R + p.reach
    return f"""
  <statistic center="{_f(round(0.4 * reach, 2), round(0.3 * reach, 2))} 0" \
extent="{_f(round(0.9 * reach, 2))}"/>

  <visual>
    <headlight ambient="0.35 0.35 0.35" diffuse="0.25 0.25 0.25" specular="0 0 0"/>
    <quality shadowsize="8192" offsamples="8"/>
    <global offwidth="1280" offheight="960" azimuth="120" elevation="-45"/>
  </visual>

  <asset>
    <texture name="sky" type="skybox" builtin="gradient" rgb1="0.92 0.94 0.96"
             rgb2="0.70 0.75 0.80" width="256" height="256"/>
    <!-- squares of 0.2 m -->
    <texture name="grid" type="2d" builtin="flat" mark="edge" rgb1="0.80 0.82 0.84"
             markrgb="0.62 0.65 0.69" width="512" height="512"/>
    <material name="table" texture="grid" texrepeat="10 10" texuniform="true" specular="0"/>
    <material name="motor" rgba="0.20 0.22 0.26 1" specular="0.4" shininess="0.5"/>
    <material name="aluminium" rgba="0.60 0.64 0.70 1" specular="0.2" shininess="0.4"/>
    <material name="steel" rgba="0.10 0.35 0.70 1" specular="0.2" shininess="0.4"/>
    <material name="mark" rgba="0.95 0.62 0.10 1"/>
    <material name="tip" rgba="0.84 0.15 0.16 1"/>
  </asset>"""


def _defaults(p: Parameters) -> str:
    return f"""
  <default>
    <default class="arm">
      <joint type="hinge" axis="0 0 1"/>
      <site size="0.004" group="4"/>
      <default class="beam">
        <!-- damping of every hinge of the beam [N m s/rad]: the paper's has none -->
        <joint damping="0"/>
      </default>
      <default class="visual">
        <!-- shown only: no contact, and no mass, as inertiafromgeom is false -->
        <geom group="2" contype="0" conaffinity="0"/>
        <default class="motor">
          <geom type="cylinder" material="motor"/>
        </default>
        <default class="link">
          <geom type="box" material="aluminium"/>
        </default>
        <default class="strip">
          <!-- drawn 5 mm thick, to be seen; the steel strip is {_f(1e3 * STRIP_THICKNESS)} mm -->
          <geom type="box" material="steel"/>
        </default>
        <default class="mark">
          <geom type="cylinder" size="0.005 0.0115" material="mark"/>
        </default>
      </default>
    </default>
  </default>"""


def _worldbody(p: Parameters, design: ChainDesign) -> str:
    disc = _f(round(0.6 * p.r, 4))
    jaw = _f(0.75 * p.r), _f(0.25 * p.r)  # centre and half-length: from r/2 to r
    beam = _beam(p, design)
    reach = p.L_R + p.reach
    return f"""
  <worldbody>
    <light name="sun" pos="0.6 -0.4 2" dir="-0.15 0.2 -1" type="directional"
           diffuse="0.5 0.5 0.5" specular="0.2 0.2 0.2"/>
    <camera name="top" pos="{_f(round(0.42 * reach, 2), round(0.38 * reach, 2))} \
{_f(round(1.3 * reach, 2))}"/>
    <camera name="perspective" pos="{_f(round(-0.25 * reach, 2), round(-0.7 * reach, 2))} \
{_f(round(0.75 * reach, 2))}"
            xyaxes="0.84 -0.54 0 0.31 0.48 0.82"/>
    <geom name="table" class="visual" type="plane" size="2 2 0.1" pos="0 0 -0.1"
          material="table"/>
    <geom name="base" class="motor" size="0.05 0.038" pos="0 0 -0.062"/>

    <body name="link1" childclass="arm">
      <!-- damping: F_1 r_1^2, (31); armature: I_m1, (36), assumed -->
      <joint name="joint1" damping="{_f(p.F_1 * p.r_1**2)}" armature="{_f(p.I_m1)}"/>
      <!-- I_R0 about joint 1, (18), put about the centre of mass: with that on the joint, the mass
           never enters, nor do the moments about x and y in a planar motion -->
      <inertial pos="0 0 0" mass="{_f(LINK_MASS)}" diaginertia="{_f(p.I_R0, p.I_R0, p.I_R0)}"/>
      <geom class="motor" size="0.05 0.016"/>
      <geom class="link" pos="{_f(p.L_R / 2)} 0 0" size="{_f(p.L_R / 2)} 0.018 0.01"/>

      <!-- at L_R, (17) -->
      <body name="hub" pos="{_f(p.L_R)} 0 0">
        <!-- damping: F_2 r_2^2, (31); armature: I_m2, (38), assumed -->
        <joint name="joint2" damping="{_f(p.F_2 * p.r_2**2)}" armature="{_f(p.I_m2)}"/>
        <!-- m_H, (20), and I_H about joint 2, (19); only the moment about z enters -->
        <inertial pos="0 0 0" mass="{_f(p.m_H)}" diaginertia="{_f(p.I_H, p.I_H, p.I_H)}"/>
        <geom class="motor" size="{disc} 0.016"/>
        <geom class="link" pos="{jaw[0]} 0 0" size="{jaw[1]} 0.01 0.014"/>
        <site name="hub"/>

{beam}
      </body>
    </body>
  </worldbody>"""


def _beam(p: Parameters, design: ChainDesign) -> str:
    """Return the nested bodies of the beam."""
    root, *segments = beam_pieces(p, design)
    how = "tuned" if design.tuned else "EI/h"
    lines = [
        "        <!-- clamped at r, (21); masses: rho times the length, moments about z: m l^2/12,",
        f"             with rho = {_f(p.rho)} kg/m, (24); positions and stiffnesses of the hinges:",
        f"             {how}, for L = {_f(p.L)} m, (22), and EI = {_f(p.EI)} N m2, (26) -->",
        f'        <body name="root" pos="{_f(p.r)} 0 0" childclass="beam">',
        *_piece(" " * 10, root),
    ]
    start = root.length
    for j, (piece, stiffness) in enumerate(zip(segments, design.stiffness, strict=True), start=1):
        pad = " " * (8 + 2 * j)
        lines += [
            f'{pad}<body name="segment{j}" pos="{_f(start)} 0 0">',
            f'{pad}  <joint name="hinge{j}" stiffness="{_f(stiffness)}"/>',
            *_piece(pad + "  ", piece),
            f'{pad}  <geom class="mark"/>',
        ]
        start = piece.length
    pad = " " * (10 + 2 * design.segments)
    lines += [
        f'{pad}<geom class="visual" type="sphere" size="0.009" pos="{_f(start)} 0 0"'
        ' material="tip"/>',
        f'{pad}<site name="tip" pos="{_f(start)} 0 0"/>',
    ]
    lines += [" " * (8 + 2 * j) + "</body>" for j in range(design.segments, -1, -1)]
    return "\n".join(lines)


def _piece(pad: str, piece: Piece) -> list[str]:
    centre, inertia = _f(piece.length / 2), _f(*piece.inertia)
    return [
        f'{pad}<inertial pos="{centre} 0 0" mass="{_f(piece.mass)}"',
        f'{pad}          diaginertia="{inertia}"/>',
        f'{pad}<geom class="strip" pos="{centre} 0 0" size="{centre} 0.0025'
        f' {_f(STRIP_WIDTH / 2)}"/>',
    ]


def _actuators(p: Parameters) -> str:
    return f"""
  <actuator>
    <!-- gear: transmission relations r_1, r_2, (36), (37), assumed; torques in N m -->
    <motor name="motor1" joint="joint1" gear="{_f(p.r_1)}"/>
    <motor name="motor2" joint="joint2" gear="{_f(p.r_2)}"/>
  </actuator>"""


def _sensors(design: ChainDesign) -> str:
    hinges = "\n".join(
        f'    <jointpos name="hinge{j}" joint="hinge{j}"/>' for j in range(1, design.segments + 1)
    )
    return f"""
  <sensor>
    <jointpos name="theta1" joint="joint1"/>
    <jointpos name="theta2" joint="joint2"/>
    <jointvel name="theta1_rate" joint="joint1"/>
    <jointvel name="theta2_rate" joint="joint2"/>
    <framepos name="tip" objtype="site" objname="tip"/>
    <!-- y is the tip deflection v -->
    <framepos name="tip_in_hub" objtype="site" objname="tip" reftype="site" refname="hub"/>
{hinges}
  </sensor>"""


def _keyframes(p: Parameters, design: ChainDesign) -> str:
    straight = _f(*HOME, *[0.0] * design.segments)
    force = BENT_TIP * p.L / p.static_compliance
    bent = _f(*HOME, *[round(angle, 6) for angle in bent_angles(p, design)])
    return f"""
  <keyframe>
    <key name="home" qpos="{straight}"/>
    <!-- at rest under a force of {force:.3g} N at the tip, across the beam: v = {BENT_TIP:g} L -->
    <key name="bent" qpos="{bent}"/>
  </keyframe>"""
