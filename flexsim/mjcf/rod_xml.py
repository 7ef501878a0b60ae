"""The arm with MuJoCo's own elastic rod for a beam, as an MJCF file.

    >>> from flexsim import Parameters
    >>> from flexsim.mjcf.rod_xml import rod_mjcf
    >>> text = rod_mjcf(Parameters(), elements=14, step=5e-4)

The rod is a flex of one dimension: point masses that slide in the hub's plane, edges held to their
lengths by constraints, bending stiffness at every vertex between two edges. It is what MuJoCo's
`flexcomp` makes of a row of points (the same forces, as a test holds), written out, since that
macro gives every point the same mass, where the tip's counts less, loses the mass of pinned
points, and has no place for the site `tip`. Left to itself, points from clamp to tip, it is 3.5 %
too fast and 13 % too light. Nothing is tuned; the rules, all of second order or more:

- The first edge is fixed to the hub, its middle at the clamp: so the spring at its end stands for
  the beam from the clamp to the middle of the next edge. Its half-length is CLAMP of the others,
  for which the tip deflects under any load as the beam does, but for terms of third order.
- Point masses follow Gregory's rule from the tip on, exact for the moments that a rigid motion
  asks for; the rest of the beam's mass, with its centre and inertia, is the piece at the clamp.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
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
    sensors,
    worldbody,
)
from flexsim.numerics.dense import product
from flexsim.numerics.elementary import cos, sin
from flexsim.numerics.step_limits import halved, longest_rk4_step
from flexsim.numerics.types import Array

ELEMENTS = 14  # unless told otherwise: the most that RK4 takes at 0.5 ms
ELEMENTS_LEAST, ELEMENTS_MOST = 4, 60  # three modes and Gregory's rule; 0.03 ms and slow beyond
CLAMP = 1 / math.sqrt(6)  # of an element: c^2 = 1/4 - 1/12, so that the errors of the quadrature
# of moment times lever arm at the clamp and along the beam cancel
GREGORY = (23 / 24, 7 / 6, 3 / 8)  # weights of the last points, exact for cubic polynomials
GREGORY_SPOKEN = "23/24, 7/6, 3/8"
RADIUS = 0.0025  # [m] drawn 5 mm thick like the chain; EI is young times pi radius^4/4
POINT_INERTIA = 1e-14  # [kg m2] a body must have some; these add up to 1e-11 of the beam's
EDGE_SOLIMP = "0.9999 0.9999 0.001"  # the hardest that MuJoCo allows
EDGE_STEPS = 2.0  # time constant of the edges in steps, the shortest that MuJoCo allows
WIDTH = 98  # characters of a row of numbers
SLIDES = """\
      <!-- a vertex slides along the hub's axis and across it -->
      <default class="along">
        <joint type="slide" axis="1 0 0"/>
      </default>
      <default class="across">
        <joint type="slide" axis="0 1 0"/>
      </default>
"""
FREE_OVER_CLAMPED = 1.05  # bounds the highest frequency with free joints by that with locked ones


class RodLayout(NamedTuple):
    """Where the vertices are and what they weigh.

    Attributes:
        length: of an element [m].
        vertices: (N+1,) distances from the clamp, the first on the hub, the last the tip [m].
        masses: (N,) of the vertices beyond the first [kg].
        root_mass [kg], root_centre [m, from the clamp], root_inertia [kg m2, about it]: what
            remains of the beam, fixed to the hub.
    """

    length: float
    vertices: Array
    masses: Array
    root_mass: float
    root_centre: float
    root_inertia: float


def rod_layout(parameters: Parameters, elements: int) -> RodLayout:
    """Return the layout of a rod of N elements beyond the one that is fixed to the hub.

    Raises:
        ParameterError: elements is not a whole number from 4 to 60.
    """
    whole = isinstance(elements, int | np.integer) and not isinstance(elements, bool)
    if not (whole and ELEMENTS_LEAST <= elements <= ELEMENTS_MOST):
        raise ParameterError(
            f"elements is {elements!r}; give a whole number from {ELEMENTS_LEAST} to "
            f"{ELEMENTS_MOST}"
        )
    p = parameters
    h = p.L / (elements + CLAMP)
    x: Array = (np.arange(elements + 1, dtype=np.float64) + CLAMP) * h  # (N+1,)
    weight = np.ones(elements, dtype=np.float64)
    weight[-len(GREGORY) :] = GREGORY
    mass: Array = p.rho * h * weight
    free = x[1:]
    rest = p.rho * p.L - mass.sum()
    centre = (p.rho * p.L**2 / 2 - product(mass, free)) / rest
    inertia = p.rho * p.L**3 / 3 - product(mass, free**2) - rest * centre**2
    return RodLayout(h, x, mass, float(rest), float(centre), float(inertia))


def stable_rod_step(parameters: Parameters, elements: int) -> float:
    """Return 1 ms, halved until RK4 can take the rod [s]."""
    h = rod_layout(parameters, elements).length
    # a zigzag, with joints free [rad/s]; damping of eta times stiffness makes it decay
    fastest = FREE_OVER_CLAMPED * 4 / h**2 * math.sqrt(parameters.EI / parameters.rho)
    return halved(longest_rk4_step(fastest, parameters.eta * fastest**2))


def rod_mjcf(parameters: Parameters, elements: int = ELEMENTS, step: float | None = None) -> str:
    """Return the text of the MJCF file of the arm with a rod for a beam.

    Args:
        parameters: the robot; elements: N. step: physics step [s], None for `stable_rod_step`.

    Raises:
        ParameterError: elements out of range, a step that is not a finite number above 0, or a
            payload with an inertia, which a vertex has not.
    """
    if parameters.payload_inertia > 0:
        raise ParameterError(
            f"payload_inertia is {parameters.payload_inertia:g} kg m2; the tip of a rod is a point "
            "without rotation: give 0, or another plant than rod"
        )
    layout = rod_layout(parameters, elements)
    timestep = stable_rod_step(parameters, elements) if step is None else step
    if not (math.isfinite(timestep) and timestep > 0):
        raise ParameterError(f"step is {timestep!r} s; give a finite number, more than 0")
    moved = bent_vertices(parameters, layout)
    straight = _rows([num(*HOME), *["0 0"] * len(moved)], 27, "  ")
    bent = _rows([num(*HOME), *(num(*np.round(pair, 7)) for pair in moved)], 27, "  ")
    return document(
        _header(elements, timestep),
        looks(parameters),
        defaults(SLIDES),
        worldbody(parameters, _vertices(parameters, layout)),
        _flex(parameters, layout, timestep),
        actuators(parameters),
        sensors(),
        keyframes(parameters, straight, bent),
        beam_numbers(parameters),
    )


def _header(elements: int, timestep: float) -> str:
    return f"""
<mujoco model="flexible arm, elastic rod of {elements}">
  <!--
    A planar arm: a rigid link, and a flexible beam clamped to a hub on its end. The beam is
    MuJoCo's own elastic rod, a flex of {elements} elements, its vertices point masses that slide in
    the plane of the hub. It is what a flexcomp of dim 1 and dof 2d makes, written out: a flexcomp
    gives every point the same mass, loses that of pinned ones, and has no place for the tip's site.
    Nothing is tuned; the clamped frequencies are low by terms of 1/{elements}^2, see README.md.
    Written by flexsim.mjcf.rod_xml. SI units. Numbers in brackets are the paper's equations.
  -->
  <compiler angle="radian" autolimits="true" inertiafromgeom="false"/>

  <!-- The arm moves in a horizontal plane: no gravity, nothing to touch. Diverging runs are for
       the caller to judge: no automatic reset. No warm start: a step depends on its state alone.
       RK4 needs timestep * highest frequency < 2.8; `discrete` would damp the vibration -->
  <option timestep="{num(timestep)}" integrator="RK4">
    <flag contact="disable" gravity="disable" autoreset="disable" warmstart="disable"/>
  </option>"""


def _vertices(p: Parameters, layout: RodLayout) -> str:
    """Return the root piece and the bodies of the vertices."""
    x, n = layout.vertices, len(layout.masses)
    L, inertia = num(p.L), num(*[POINT_INERTIA] * 3)
    lines = [
        f"""\
        <!-- clamped at r, (21): the root holds the first edge, whose middle is the clamp, and
             the part of the beam that the vertices leave; of rho = {num(p.rho)} kg/m, (24) -->
        <body name="root" pos="{num(p.r)} 0 0">
          <inertial pos="{num(layout.root_centre)} 0 0" mass="{num(layout.root_mass)}"
                    diaginertia="{num(*[layout.root_inertia] * 3)}"/>
        </body>
        <!-- {n} elements of L/({n} + 1/sqrt 6), with L = {L} m, (22); masses: rho times that,
             the last three times {GREGORY_SPOKEN} -->"""
    ]
    masses = layout.masses.copy()
    masses[-1] += p.payload
    for j, (position, mass) in enumerate(zip(p.r + x[1:], masses, strict=True), start=1):
        lines += [
            f'        <body name="vertex{j}" pos="{num(position)} 0 0">',
            f'          <joint name="along{j}" class="along"/>',
            f'          <joint name="across{j}" class="across"/>',
            f'          <inertial pos="0 0 0" mass="{num(mass)}" diaginertia="{inertia}"/>',
            "        </body>",
        ]
    if p.payload > 0:
        lines[-2:-2] = [f"          <!-- with the payload, {num(p.payload)} kg, assumed -->"]
    lines[-1:] = [
        '          <geom class="visual" type="sphere" size="0.009" material="tip"/>',
        '          <site name="tip"/>',
        "        </body>",
    ]
    return "\n".join(lines)


def _flex(p: Parameters, layout: RodLayout, timestep: float) -> str:
    n, first = len(layout.masses), layout.vertices[0]
    bodies = _rows(["root", "root", *(f"vertex{j}" for j in range(1, n + 1))], 16)
    points = _rows([num(-first, 0, 0), num(first, 0, 0), *["0 0 0"] * n], 18, "  ")
    elements = _rows([f"{j} {j + 1}" for j in range(n + 1)], 19, "  ")
    EI, young = num(p.EI), p.EI / (math.pi * RADIUS**4 / 4)
    return f"""
  <deformable>
    <!-- young: EI = {EI} N m2, (26), over the second moment pi radius^4/4 of a round section:
         only their product enters. A round one, since the box of the strip would bring its stiff
         axis out of the plane. damping [s]: times stiffness, so that mode 1 of the beam has the
         ratio {num(p.zeta)}, assumed -->
    <flex name="rod" dim="1" radius="{num(RADIUS)}" material="steel"
          body="{bodies}"
          vertex="{points}"
          element="{elements}">
      <elasticity young="{num(young)}" damping="{num(p.eta)}"/>
    </flex>
  </deformable>

  <equality>
    <!-- edges keep their lengths. As hard as MuJoCo allows: a time constant of two steps, and an
         impedance of 0.9999; with the soft defaults the rod stretches, and the tip is off by mm -->
    <flex name="edges" flex="rod" solref="{num(EDGE_STEPS * timestep)} 1" solimp="{EDGE_SOLIMP}"/>
  </equality>"""


def _rows(groups: list[str], indent: int, between: str = " ") -> str:
    """Return groups of numbers or names in rows that fit, none broken."""
    rows = [groups[0]]
    for group in groups[1:]:
        if len(rows[-1]) + len(between) + len(group) > WIDTH - indent:
            rows.append(group)
        else:
            rows[-1] += between + group
    return ("\n" + " " * indent).join(rows)


def bent_vertices(parameters: Parameters, layout: RodLayout) -> Array:
    """Return displacements (N, 2) of the vertices under the tip force that bends by BENT_TIP L.

    Edges keep their lengths; the moment about a vertex is taken on the straight rod.
    """
    p, h, x = parameters, layout.length, layout.vertices
    force = BENT_TIP * p.L / p.static_compliance  # [N]
    tributary = np.full(len(x) - 1, h)  # (N,)
    tributary[0] = (0.5 + CLAMP) * h
    slope = np.cumsum(force * (p.L - x[:-1]) * tributary / p.EI)  # (N,) of the edges
    along = h * np.cumsum(cos(slope) - 1)
    return np.column_stack([along, h * np.cumsum(sin(slope))])
