"""One flexible link on a stand as MJCF: the arm without joint 1.

>>> text = one_link_mjcf(named_arm("one-link").parameters, design_chain(parameters, 6))
>>> designed_one_link(named_arm("one-link").parameters, segments=6).reach
0.5

The file has one joint with a motor, and the beam's hinges; how models of two joints read it is in
`flexsim.mjcf.reading.held_joint`.
"""

from __future__ import annotations

from dataclasses import replace

from flexsim.arm.chain_design import DESIGNS, SEGMENTS, TUNED, ChainDesign
from flexsim.arm.locked import LOCKED
from flexsim.arm.parameters import Parameters
from flexsim.errors import ModelError
from flexsim.mjcf.arm_xml import (
    HOME,
    beam_numbers,
    defaults,
    document,
    keyframes,
    looks,
    num,
    seen_from,
    stepping,
)
from flexsim.mjcf.chain_file import ChainModel
from flexsim.mjcf.chain_xml import STRIP, beam_bodies, bent_angles, hinge_sensors
from flexsim.mjcf.designed import designed_chain
from flexsim.mjcf.load import load_arm
from flexsim.numerics.step_limits import LONGEST_STEP


def stands_still(parameters: Parameters) -> bool:
    """Return whether joint 1 of a robot does not move: its motor is as heavy as a lock."""
    return parameters.I_m1 >= LOCKED


def designed_one_link(
    parameters: Parameters, segments: int = SEGMENTS, step: float | None = None, kind: str = TUNED
) -> ChainModel:
    """Return the chain of a robot whose joint 1 stands still; arguments as `designed_chain`.

    Raises:
        ParameterError, ModelError: segments or step out of range.
    """
    own = replace(parameters, I_m1=0.0)
    step = designed_chain(own, segments, step, kind).step  # a locked joint takes no shorter one
    design = DESIGNS[kind](own, segments)
    chain = load_arm(text=one_link_mjcf(own, design, step))
    if not isinstance(chain, ChainModel):
        raise ModelError("the arm of one link was not read as a chain")
    return chain


def one_link_mjcf(
    parameters: Parameters,
    design: ChainDesign,
    timestep: float = LONGEST_STEP,
    bridges: tuple[float, float] | None = None,
) -> str:
    """Return the text of the MJCF file of a beam on a motor on a stand.

    Args:
        parameters: the robot, whose L_R is how far the stand's joint is from the origin.
        design: hinges and stiffnesses of its chain. timestep: physics step [s].
        bridges: places of two strain bridges from the clamp [m].
    """
    p = parameters
    bent = [round(angle, 6) for angle in bent_angles(p, design)]
    straight = num(HOME[1], *[0.0] * design.segments)
    return document(
        _header(design, timestep),
        looks(p),
        defaults(strip=STRIP),
        _worldbody(p, design, bridges),
        f"""
  <actuator>
    <!-- gear: transmission relation r_2, assumed; torque in N m -->
    <motor name="motor2" joint="joint2" gear="{num(p.r_2)}"/>
  </actuator>""",
        f"""
  <sensor>
    <jointpos name="theta2" joint="joint2"/>
    <jointvel name="theta2_rate" joint="joint2"/>
    <framepos name="tip" objtype="site" objname="tip"/>
    <!-- y is the tip deflection v -->
    <framepos name="tip_in_hub" objtype="site" objname="tip" reftype="site" refname="hub"/>\
{hinge_sensors(design)}
  </sensor>""",
        keyframes(p, straight, num(HOME[1], *bent)),
        beam_numbers(p),
    )


def _header(design: ChainDesign, timestep: float) -> str:
    kind = "tuned" if design.fitted else "plain"
    return f"""
<mujoco model="one flexible link, {kind} chain of {design.segments}">
  <!--
    One flexible link: a beam clamped to a hub on a motor, on a stand that does not move. The beam
    is a rigid root piece and {design.segments} rigid segments, joined by hinges with springs.
    Written by flexsim chain, arm one-link. SI units. Numbers in brackets are the paper's
    equations for the same quantity; models/README.md has where each number is from.
  -->
{stepping(timestep)}"""


def _worldbody(
    p: Parameters, design: ChainDesign, bridges: tuple[float, float] | None = None
) -> str:
    return f"""
  <worldbody>
{seen_from(p)}
    <geom name="table" class="visual" type="plane" size="2 2 0.1" pos="0 0 -0.1"
          material="table"/>

    <!-- the stand: a link 1 whose joint does not move, or none at all -->
    <body name="stand" childclass="arm">
      <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
      <geom class="link" pos="{num(p.L_R / 2)} 0 0" size="{num(p.L_R / 2)} 0.018 0.01"/>

      <!-- where the motor is: joint angles are counted from the x-axis -->
      <body name="hub" pos="{num(p.L_R)} 0 0">
        <!-- damping: friction of the joint; armature: inertia of the motor, assumed -->
        <joint name="joint2" damping="{num(p.F_2 * p.r_2**2)}" armature="{num(p.I_m2)}"/>
        <!-- the hub's inertia about the joint; only the moment about z enters -->
        <inertial pos="0 0 0" mass="{num(p.m_H)}" diaginertia="{num(p.I_H, p.I_H, p.I_H)}"/>
        <geom class="motor" size="0.02 0.016"/>
        <site name="hub"/>

{beam_bodies(p, design, bridges)}
      </body>
    </body>
  </worldbody>"""
