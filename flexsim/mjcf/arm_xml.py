"""What the MJCF of every arm of ours shares: looks, classes, link and hub, motors, sensors.

>>> worldbody(Parameters(), beam="        <body name=...")
"""

from __future__ import annotations

import math

from flexsim.arm.parameters import Parameters

LINK_MASS = 1.0  # [kg] any: link 1 turns about its own centre of mass
HOME = (0.3, 1.2)  # [rad] theta1, theta2 of the keyframes: elbow bent, tip in the workspace
BENT_TIP = 0.05  # v/L of the keyframe `bent`
DIGITS = 12  # significant, so that the compiled model matches to 1e-11
SMALLEST_DISC = 0.02  # [m] that a hub without a radius is drawn with
STEEL = 7850.0  # [kg/m3] of the ball that a payload is drawn as
PAYLOAD = "payload"  # the body at the tip that is no part of the beam
BEAM_NUMBERS = (  # of `<custom>`, with what they are of `Parameters`
    ("L", "length [m]"),
    ("EI", "bending stiffness [N m2]"),
    ("rho", "linear density [kg/m]"),
    ("r", "radius of the hub, where it is clamped [m]"),
    ("zeta", "damping ratio of its first mode, without payload [-]"),
    ("payload", "mass at its tip [kg]"),
    ("payload_inertia", "inertia of that mass about the tip [kg m2]"),
)


def document(*sections: str) -> str:
    """Return the text of a file of these sections, a blank line between them."""
    return "\n\n".join(section.strip("\n") for section in sections) + "\n</mujoco>\n"


def num(*values: float) -> str:
    """Return numbers as MJCF writes them: short where they are, else 12 digits."""
    return " ".join(f"{value + 0.0:.{DIGITS}g}" for value in values)


def stepping(timestep: float) -> str:
    """Return how the file of a chain is compiled and stepped [s]."""
    return f"""\
  <compiler angle="radian" autolimits="true" inertiafromgeom="false"/>

  <!-- The arm moves in a horizontal plane: no gravity, nothing to touch. Diverging runs are for
       the caller to judge: no automatic reset. RK4 needs timestep * highest frequency < 2.8 -->
  <option timestep="{num(timestep)}" integrator="RK4">
    <flag contact="disable" gravity="disable" autoreset="disable"/>
  </option>"""


def seen_from(p: Parameters) -> str:
    """Return the light, and the camera above."""
    reach = p.L_R + p.reach
    return f"""\
    <light name="sun" pos="0.6 -0.4 2" dir="-0.15 0.2 -1" type="directional"
           diffuse="0.5 0.5 0.5" specular="0.2 0.2 0.2"/>
    <camera name="top" pos="{num(round(0.42 * reach, 2), round(0.38 * reach, 2))} \
{num(round(1.3 * reach, 2))}"/>"""


def looks(p: Parameters) -> str:
    """Return how the arm is seen: centre, light, materials."""
    reach = p.L_R + p.reach
    return f"""
  <statistic center="{num(round(0.4 * reach, 2), round(0.3 * reach, 2))} 0" \
extent="{num(round(0.9 * reach, 2))}"/>

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


def defaults(beam: str = "", strip: str = "") -> str:
    """Return the default classes by role.

    Args:
        beam: classes of the beam's joints; strip: of its visual pieces; '' where it has none.
    """
    return f"""
  <default>
    <default class="arm">
      <joint type="hinge" axis="0 0 1"/>
      <site size="0.004" group="4"/>
{beam}      <default class="visual">
        <!-- shown only: no contact, and no mass, as inertiafromgeom is false -->
        <geom group="2" contype="0" conaffinity="0"/>
        <default class="motor">
          <geom type="cylinder" material="motor"/>
        </default>
        <default class="link">
          <geom type="box" material="aluminium"/>
        </default>
{strip}      </default>
    </default>
  </default>"""


def worldbody(p: Parameters, beam: str) -> str:
    """Return the world with link and hub; beam: the bodies that the hub carries, as text."""
    disc = num(round(max(0.6 * p.r, SMALLEST_DISC), 4))
    jaw = f"""
        <geom class="link" pos="{num(0.75 * p.r)} 0 0" size="{num(0.25 * p.r)} 0.01 0.014"/>"""
    if p.r == 0:  # the jaw reaches from r/2 to r
        jaw = ""
    reach = p.L_R + p.reach
    return f"""
  <worldbody>
{seen_from(p)}
    <camera name="perspective" pos="{num(round(-0.25 * reach, 2), round(-0.7 * reach, 2))} \
{num(round(0.75 * reach, 2))}"
            xyaxes="0.84 -0.54 0 0.31 0.48 0.82"/>
    <geom name="table" class="visual" type="plane" size="2 2 0.1" pos="0 0 -0.1"
          material="table"/>
    <geom name="base" class="motor" size="0.05 0.038" pos="0 0 -0.062"/>

    <body name="link1" childclass="arm">
      <!-- damping: F_1 r_1^2, (31); armature: I_m1, (36), assumed -->
      <joint name="joint1" damping="{num(p.F_1 * p.r_1**2)}" armature="{num(p.I_m1)}"/>
      <!-- I_R0 about joint 1, (18), put about the centre of mass: with that on the joint, the mass
           never enters, nor do the moments about x and y in a planar motion -->
      <inertial pos="0 0 0" mass="{num(LINK_MASS)}" diaginertia="{num(p.I_R0, p.I_R0, p.I_R0)}"/>
      <geom class="motor" size="0.05 0.016"/>
      <geom class="link" pos="{num(p.L_R / 2)} 0 0" size="{num(p.L_R / 2)} 0.018 0.01"/>

      <!-- at L_R, (17) -->
      <body name="hub" pos="{num(p.L_R)} 0 0">
        <!-- damping: F_2 r_2^2, (31); armature: I_m2, (38), assumed -->
        <joint name="joint2" damping="{num(p.F_2 * p.r_2**2)}" armature="{num(p.I_m2)}"/>
        <!-- m_H, (20), and I_H about joint 2, (19); only the moment about z enters -->
        <inertial pos="0 0 0" mass="{num(p.m_H)}" diaginertia="{num(p.I_H, p.I_H, p.I_H)}"/>
        <geom class="motor" size="{disc} 0.016"/>{jaw}
        <site name="hub"/>

{beam}
      </body>
    </body>
  </worldbody>"""


def actuators(p: Parameters) -> str:
    """Return the two motors."""
    return f"""
  <actuator>
    <!-- gear: transmission relations r_1, r_2, (36), (37), assumed; torques in N m -->
    <motor name="motor1" joint="joint1" gear="{num(p.r_1)}"/>
    <motor name="motor2" joint="joint2" gear="{num(p.r_2)}"/>
  </actuator>"""


def sensors(more: str = "") -> str:
    """Return the sensors of joints, tip and deflection, and lines of more."""
    return f"""
  <sensor>
    <jointpos name="theta1" joint="joint1"/>
    <jointpos name="theta2" joint="joint2"/>
    <jointvel name="theta1_rate" joint="joint1"/>
    <jointvel name="theta2_rate" joint="joint2"/>
    <framepos name="tip" objtype="site" objname="tip"/>
    <!-- y is the tip deflection v -->
    <framepos name="tip_in_hub" objtype="site" objname="tip" reftype="site" refname="hub"/>{more}
  </sensor>"""


def keyframes(p: Parameters, home: str, bent: str) -> str:
    """Return the keyframes `home` and `bent`, their joint positions as text."""
    force = BENT_TIP * p.L / p.static_compliance  # [N]
    return f"""
  <keyframe>
    <key name="home" qpos="{home}"/>
    <!-- at rest under a force of {force:.3g} N at the tip, across the beam: v = {BENT_TIP:g} L -->
    <key name="bent" qpos="{bent}"/>
  </keyframe>"""


def payload(p: Parameters, pad: str, place: float) -> list[str]:
    """Return the lines of the body that is the payload, none without one.

    Args:
        pad: before each line; place: of the tip, along the body that carries it [m].
    """
    if p.payload == 0 and p.payload_inertia == 0:
        return []
    inertia = num(*[p.payload_inertia] * 3)
    radius = (3 * p.payload / (4 * math.pi * STEEL)) ** (1 / 3)
    size = num(round(min(max(radius, 0.005), 0.05), 4))
    return [
        f"{pad}<!-- assumed; only the moment about z enters; drawn as a ball of steel -->",
        f'{pad}<body name="{PAYLOAD}" pos="{num(place)} 0 0">',
        f'{pad}  <inertial pos="0 0 0" mass="{num(p.payload)}" diaginertia="{inertia}"/>',
        f'{pad}  <geom class="visual" type="sphere" size="{size}" material="motor"/>',
        f"{pad}</body>",
    ]


def beam_numbers(p: Parameters) -> str:
    """Return which uniform beam the file stands for."""
    lines = [
        f'    <!-- {meaning} -->\n    <numeric name="beam_{name}" data="{num(getattr(p, name))}"/>'
        for name, meaning in BEAM_NUMBERS
    ]
    said = "  <!-- the beam that this file stands for: what its models are compared with -->"
    return "\n".join([said, "  <custom>", *lines, "  </custom>"])
