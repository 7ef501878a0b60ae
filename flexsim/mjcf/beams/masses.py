"""The masses of a compiled chain's beam: a density for each rigid piece, and what lies upon it.

>>> masses = masses_of(load_chain("models/chain6.xml"))
>>> masses.rho, masses.lumps, masses.payload      # [kg/m] of root and segments

A rigid piece with any mass, centre and moment of inertia moves as a uniform rod of its length with
one more body on it: the rod is the heaviest that leaves a body which can be. So a segment whose
mass and inertia are both doubled is a rod of twice the density, one whose mass alone is doubled a
rod with a point mass at its middle, and one with a payload in its `inertial` a rod with the payload
at its end.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np

from flexsim.arm.finite_beam import Lump
from flexsim.mjcf.bodies import parts
from flexsim.mjcf.chain_file import ChainModel
from flexsim.numerics.types import Array

SAME = 1e-8  # relative: densities that differ less are one; files have 12 digits


class Body(NamedTuple):
    """A rigid body at s from the clamp [m]: mass [kg], inertia about the beam's axis [kg m2]."""

    s: float
    mass: float
    inertia: float


@dataclass(frozen=True, eq=False)
class Masses:
    """What is distributed along a beam.

    Attributes:
        ends: (P+1,) of the pieces, from the clamp [m]; rho: (P,) [kg/m].
        lumps: bodies on it that are no payload; payload: mass [kg] and inertia [kg m2] at the tip.
        spin: moments of inertia of the pieces over a slender rod's, 1 unless all are otherwise.
    """

    ends: Array
    rho: Array
    lumps: tuple[Lump, ...]
    payload: tuple[float, float]
    spin: float

    @property
    def uniform(self) -> bool:
        """Whether the beam is, but for a payload at its tip."""
        return not self.lumps and alike(self.rho)


def alike(values: Array) -> bool:
    """Return whether values are one number, to SAME."""
    return bool(np.ptp(values) <= SAME * np.abs(values).max())


def masses_of(chain: ChainModel) -> Masses:
    """Return the masses of a chain's beam, read from its bodies."""
    ends = np.concatenate([[0.0], chain.hinges, [chain.reach - chain.clamp]])
    pieces, others = _bodies(chain)
    first = 0 if ends[1] > SAME * ends[-1] else 1  # without a root piece
    ends = np.concatenate([[0.0], ends[first + 1 :]])
    rigid = [pieces.get(j, Body(0.0, 0.0, 0.0)) for j in range(first, len(chain.lengths) + 1)]
    rho, spin = _as_written(rigid, ends)
    lumps: list[Lump] = []
    if rho is None:
        split = [_split(body, *ends[j : j + 2].tolist()) for j, body in enumerate(rigid)]
        rho = np.array([density for density, _ in split])
        lumps = [lump for _, lump in split if lump is not None]
    starts = np.append(0.0, ends)  # a body on a root piece without length is at the clamp
    for j, body in others:
        lumps.append(_fixed(body, float(starts[j - first + 1]), float(starts[j - first + 2])))
    at_tip = [lump for lump in lumps if _is_payload(lump, float(ends[-1]))]
    return Masses(
        ends,
        rho,
        tuple(lump for lump in lumps if lump not in at_tip),
        (sum(lump.mass for lump in at_tip), sum(lump.second for lump in at_tip)),
        spin,
    )


def _bodies(chain: ChainModel) -> tuple[dict[int, Body], list[tuple[int, Body]]]:
    """Return the body of each piece, root 0, and all others with the piece that they are fixed to.

    The others: bodies without a joint, as a payload is.
    """
    model, (_, _, beam) = chain.model, parts(chain)
    hinged = {int(body): j for j, body in enumerate(model.jnt_bodyid[2:], start=1)}
    root = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "root")
    own = hinged | ({root: 0} if root >= 0 else {})
    pieces: dict[int, Body] = {}
    others: list[tuple[int, Body]] = []
    for i, m, x, y, inertia in zip(beam.ids, beam.mass, beam.x, beam.y, beam.inertia, strict=True):
        body = Body(float(x) - chain.clamp, float(m), float(inertia + m * y * y))
        if i in own:
            pieces[own[i]] = body
        elif body.mass > 0 or body.inertia > 0:
            others.append((hinged.get(int(model.body_weldid[i]), 0), body))
    return pieces, others


def _as_written(bodies: list[Body], ends: Array) -> tuple[Array | None, float]:
    """Return one density (P,) where masses go with lengths and centres are in the middle.

    And the moments of inertia over a slender rod's, where that is one number, too: whoever
    multiplies all masses alone has another beam in mind, not point masses upon it.
    """
    length, middle = np.diff(ends), (ends[:-1] + ends[1:]) / 2
    s, mass, inertia = np.array(bodies).T
    spin = inertia * 12 / (np.where(mass > 0, mass, 1.0) * length**2)
    centred = (np.abs(s - middle) <= SAME * length).all()
    if not (centred and (mass > 0).all() and alike(mass / length) and alike(spin)):
        return None, 1.0
    return np.full(len(mass), mass.sum() / ends[-1]), float(spin.mean())


def _split(body: Body, start: float, end: float) -> tuple[float, Lump | None]:
    """Return the density of the heaviest rod within a piece, and what it leaves, about its middle.

    With mass m, first and second moments f, j about the middle, against l, 0, l^3/12 of a unit
    rod: the smaller root of det([[m, f], [f, j]] - rho [[l, 0], [0, l^3/12]]) = 0 leaves a body of
    no negative mass or inertia.
    """
    length, middle = end - start, (start + end) / 2
    f = body.mass * (body.s - middle)
    j = body.inertia + body.mass * (body.s - middle) ** 2
    own, turned, mixed = body.mass / length, 12 * j / length**3, f / length**2 * math.sqrt(12)
    half = (own - turned) / 2
    rho = max((own + turned) / 2 - math.hypot(half, mixed), 0.0)
    left = Lump(middle, body.mass - rho * length, f, j - rho * length**3 / 12)
    if left.mass <= SAME * body.mass and left.second <= SAME * j:
        return rho, None
    mass, second = max(left.mass, 0.0), max(left.second, 0.0)
    most = math.sqrt(mass * second)  # rounding may leave a first moment that no body has
    at = Lump(middle, mass, min(max(f, -most), most), second)
    return rho, _shifted(at, end) if _is_at(at, end) else at


def _fixed(body: Body, start: float, end: float) -> Lump:
    """Return a body that is fixed to a piece, as a lump on the beam."""
    place = min(max(body.s, start), end)
    if abs(body.s - end) <= SAME * end:
        return Lump(end, body.mass, 0.0, body.inertia)
    ahead = body.s - place
    return Lump(place, body.mass, body.mass * ahead, body.inertia + body.mass * ahead**2)


def _is_at(lump: Lump, place: float) -> bool:
    """Return whether a lump is a point mass at a place, seen from where it is written."""
    ahead = place - lump.place
    return (
        lump.mass > 0
        and abs(lump.first - lump.mass * ahead) <= math.sqrt(SAME) * lump.mass * abs(ahead)
        and abs(lump.second - lump.mass * ahead**2) <= math.sqrt(SAME) * lump.mass * ahead**2
    )


def _shifted(lump: Lump, place: float) -> Lump:
    """Return a point mass as a lump at the place where it is."""
    return Lump(place, lump.mass, 0.0, 0.0)


def _is_payload(lump: Lump, tip: float) -> bool:
    return lump.place == tip and lump.first == 0
