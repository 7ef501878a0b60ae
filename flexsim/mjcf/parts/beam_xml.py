"""A chain of hinged segments as a part for any MJCF file: its default class, its bodies.

    >>> part = BeamPart(design_graded(beam, 6), prefix="boom", eta=1e-4)
    >>> body_lines(part), class_lines(part)

The beam lies along the x-axis of its clamp and bends in its xy-plane, about z; with hinges about y
as well out of that plane. Nothing twists or stretches. Names begin with the prefix; whatever the
file's own defaults may set is set back in the class, so that the beam is the same in every file.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from flexsim.arm.graded_chain import GradedChain, Moments
from flexsim.mjcf.arm_xml import num
from flexsim.numerics.types import Array

DRAWN_WIDTH, DRAWN_THICKNESS = 0.04, 0.01  # of the beam's length: half sizes of what is drawn
UPRIGHT = (1.0, 0.0, 0.0, 0.0)
TURNED = (math.sqrt(0.5), -math.sqrt(0.5), 0.0, 0.0)  # about x: what was z points along y
AXES = {"z": UPRIGHT, "y": TURNED}
SET_BACK = {  # what a file's own defaults may set, as it is without any
    "joint": {
        "pos": "0 0 0",
        "ref": "0",
        "springref": "0",
        "springdamper": "0 0",
        "armature": "0",
        "frictionloss": "0",
        "limited": "false",
        "actuatorfrclimited": "false",
    },
    "geom": {"margin": "0", "gap": "0"},
    "site": {"type": "sphere"},
}


@dataclass(frozen=True, eq=False)
class BeamPart:
    """A chain and how it is put on a body.

    Attributes:
        chain: hinges, springs and pieces. prefix: of all names. eta: damping over stiffness of
            every hinge [s]. out: whether it bends out of the plane, too.
        pos, quat: of the clamp in the parent's frame [m, -]. axis: of the clamp's own axes the one
            about which it bends in the plane, 'z' or 'y'. set_back: elements, of SET_BACK, for
            which the file has defaults.
    """

    chain: GradedChain
    prefix: str = "beam"
    eta: float = 0.0
    out: bool = False
    pos: tuple[float, float, float] = (0.0, 0.0, 0.0)
    quat: tuple[float, float, float, float] = UPRIGHT
    axis: str = "z"
    set_back: tuple[str, ...] = ()

    @property
    def root(self) -> str:
        """Name of the body that is fixed to the parent."""
        return f"{self.prefix}_root"

    @property
    def joints(self) -> list[str]:
        """Names of the hinges in the plane, from the clamp on."""
        return [f"{self.prefix}_hinge{j}" for j in range(1, len(self.chain.position) + 1)]

    @property
    def joints_out(self) -> list[str]:
        """Names of the hinges out of the plane, none of a planar beam."""
        return [f"{name}_out" for name in self.joints] if self.out else []

    @property
    def names(self) -> dict[str, list[str]]:
        """All names that the part brings, by the kind of element."""
        n, prefix = len(self.chain.position), self.prefix
        bodies = [self.root, *(f"{prefix}_segment{j}" for j in range(1, n + 1))]
        payload = [f"{prefix}_payload"] if self.chain.beam.tip_mass else []
        return {
            "default class": [prefix, *([f"{prefix}_out"] if self.out else [])],
            "body": bodies + payload,
            "joint": self.joints + self.joints_out,
            "site": [f"{prefix}_tip"],
        }


def class_lines(part: BeamPart, pad: str = "  ") -> list[str]:
    """Return the lines of the default section of the beam, indented by a pad."""
    inner = pad * 2
    own = {
        "joint": {"type": "hinge", "axis": "0 0 1"},
        "geom": {
            **{"type": "box", "group": "2", "contype": "0", "conaffinity": "0"},
            "rgba": "0.1 0.35 0.7 1",
        },
        "site": {"group": "4", "size": num(round(0.01 * part.chain.beam.length, 6))},
    }
    lines = [f"{pad}<default>", f'{inner}<default class="{part.prefix}">']
    if part.set_back:
        lines.append(f"{inner}  <!-- set back: what the file's own defaults set -->")
    for tag, attributes in own.items():
        given = attributes | (SET_BACK[tag] if tag in part.set_back else {})
        lines.append(f"{inner}  <{tag} {_attributes(given)}/>")
    if part.out:
        lines += [
            f'{inner}  <default class="{part.prefix}_out">',
            f'{inner}    <joint axis="0 1 0"/>',
            f"{inner}  </default>",
        ]
    return [*lines, f"{inner}</default>", f"{pad}</default>"]


def body_lines(part: BeamPart) -> list[str]:
    """Return the lines of the beam's bodies, not indented."""
    chain, prefix = part.chain, part.prefix
    root, *segments = chain.pieces
    ends = np.diff(chain.position, prepend=0.0, append=chain.beam.length).tolist()
    turned = _product(part.quat, AXES[part.axis])
    quat = "" if turned == UPRIGHT else f' quat="{num(*turned)}"'
    lines = [
        *_comment(part),
        f'<body name="{part.root}" childclass="{prefix}" pos="{num(*part.pos)}"{quat}>',
        *_piece("  ", root, ends[0], chain.beam.length),
    ]
    start = ends[0]
    for j, (piece, length) in enumerate(zip(segments, ends[1:], strict=True), start=1):
        pad = "  " * j
        lines += [
            f'{pad}<body name="{prefix}_segment{j}" pos="{num(start)} 0 0">',
            *_joints(part, pad + "  ", j),
            *_piece(pad + "  ", piece, length, chain.beam.length),
        ]
        start = length
    pad = "  " * (len(segments) + 1)
    lines += [
        f'{pad}<site name="{prefix}_tip" pos="{num(start)} 0 0"/>',
        *_payload(part, pad, start),
    ]
    return lines + ["  " * j + "</body>" for j in range(len(segments), -1, -1)]


def _comment(part: BeamPart) -> list[str]:
    """Return what the beam is and where its numbers are from, as a comment."""
    chain, beam = part.chain, part.chain.beam
    how = [
        f"A flexible beam of {num(beam.length)} m, clamped here: {len(chain.position)} rigid "
        "segments, hinges with springs;",
        "written by `flexsim beam`. SI units.",
        _section("EI", "N m2", beam.EI) + ", " + _section("rho", "kg/m", beam.rho)
        + (", " + _section("EI out of the plane", "N m2", beam.EI_out) if part.out else ""),
    ]  # fmt: skip
    if (beam.thickness, beam.width) != (1, 1):
        how.append(
            f"taper: thickness at the tip {num(beam.thickness)} of that at the clamp, width "
            f"{num(beam.width)}"
        )
    hertz = ", ".join(f"{omega / (2 * math.pi):.5g}" for omega in chain.frequency[:3])
    how += [
        "masses, inertias about y and z: those of the beam that each piece replaces; about x: of",
        "the box that is drawn. Hinges and springs: tuned, so that the first three clamped",
        f"frequencies are the beam's: {hertz} Hz",
    ]
    if part.out:
        hertz = ", ".join(f"{omega / (2 * math.pi):.5g}" for omega in chain.frequency_out[:3])
        how.append(f"and out of the plane {hertz} Hz; it does not twist")
    if part.eta:
        how.append(f"damping: {num(part.eta)} s times stiffness")
    return ["<!--", *(f"  {line}" for line in how), "-->"]


def _section(name: str, unit: str, values: Array) -> str:
    """Return a number, or its ends along the beam, in words."""
    first, last = float(values[0]), float(values[-1])
    if (values == first).all():
        return f"{name} = {num(first)} {unit}"
    return f"{name} from {num(first)} to {num(last)} {unit} over {len(values)} stations"


def _joints(part: BeamPart, pad: str, j: int) -> list[str]:
    k, out = float(part.chain.stiffness[j - 1]), float(part.chain.stiffness_out[j - 1])
    lines = [
        f'{pad}<joint name="{part.joints[j - 1]}" stiffness="{num(k)}"'
        f' damping="{num(part.eta * k)}"/>'
    ]
    if part.out:
        lines.append(
            f'{pad}<joint name="{part.joints_out[j - 1]}" class="{part.prefix}_out"'
            f' stiffness="{num(out)}" damping="{num(part.eta * out)}"/>'
        )
    return lines


def _piece(pad: str, piece: Moments, length: float, L: float) -> list[str]:
    half = num(length / 2, DRAWN_THICKNESS * L / 2, DRAWN_WIDTH * L / 2)
    drawn = piece.mass * (DRAWN_WIDTH**2 + DRAWN_THICKNESS**2) * L**2 / 12
    about_x = min(drawn, piece.inertia)  # no rigid body has more than both others
    return [
        f'{pad}<inertial pos="{num(piece.centre)} 0 0" mass="{num(piece.mass)}"'
        f' diaginertia="{num(about_x, piece.inertia, piece.inertia)}"/>',
        f'{pad}<geom pos="{num(length / 2)} 0 0" size="{half}"/>',
    ]


def _payload(part: BeamPart, pad: str, place: float) -> list[str]:
    beam = part.chain.beam
    if not beam.tip_mass:
        return []
    J = num(*[beam.tip_inertia] * 3)
    return [
        f"{pad}<!-- the load at the tip -->",
        f'{pad}<body name="{part.prefix}_payload" pos="{num(place)} 0 0">',
        f'{pad}  <inertial pos="0 0 0" mass="{num(beam.tip_mass)}" diaginertia="{J}"/>',
        f'{pad}  <geom type="sphere" size="{num(round(0.02 * beam.length, 6))}"/>',
        f"{pad}</body>",
    ]


def _attributes(given: dict[str, str]) -> str:
    return " ".join(f'{name}="{value}"' for name, value in given.items())


def _product(p: tuple[float, ...], q: tuple[float, ...]) -> tuple[float, float, float, float]:
    """Return the quaternion of turning by q, then by p."""
    a, b, c, d = p
    w, x, y, z = q
    return (
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    )
