"""Which beam does a file stand for? Its own one, edits and all, to hold its models against.

>>> stands = beam_of(load_arm("my.xml"))
>>> stands.reference.clamped(3)        # [rad/s], exact where the beam is uniform
>>> stands.default, stands.remarks     # the beam that was written, and what of it has changed

`flexsim chain` writes the beam into the file's `<custom>` block. What the bodies and springs are
now decides: if they are the chain of a uniform beam, with the block's numbers or others, the beam
is that, with its payload. If not, it is one of pieces (see `masses` and `stiffness` beside this).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from flexsim.arm.finite_beam import Base, Lump, Piece, finite_beam
from flexsim.arm.parameters import Parameters
from flexsim.arm.reference_beam import ReferenceBeam, uniform_reference
from flexsim.errors import ModelError, ParameterError
from flexsim.mjcf.as_parameters import parameters_of, parameters_of_rod
from flexsim.mjcf.beams.masses import SAME, Masses, masses_of
from flexsim.mjcf.beams.stiffness import Bending, bending_of
from flexsim.mjcf.bodies import parts
from flexsim.mjcf.chain_file import ChainModel
from flexsim.mjcf.rod_file import RodModel
from flexsim.numerics.elementary import cubed
from flexsim.numerics.types import Array

WRITTEN = ("L", "EI", "rho", "r", "zeta", "payload", "payload_inertia")  # beam_... in `<custom>`
NEEDED = ("L", "EI", "rho")  # of these, for a beam to be the written one
DEFAULT, AS_WRITTEN = "the default", "the written"  # beams to compare with
UNCHANGED = 1e-6  # relative: numbers of a beam that agree to this are those that were written
MILD = 2 * (1 + 1e-6)  # factor of an edit up to which a chain in pieces is held to a limit
BALANCED = 1e-12  # [kg m] of the hub about joint 2, below which its centre is on the joint


@dataclass(frozen=True, eq=False)
class StandsFor:
    """The beam that a file stands for.

    Attributes:
        reference: that beam, on the file's link and hub. default: to compare it with, the one that
            was written if the file has been edited since, else the default robot's.
        default_name: whose that is, in words. remarks: what else to know, a clause each.
        design: 'tuned' or 'plain' if the chain is as `flexsim chain` writes it for a uniform beam,
            'in pieces' if it was and hinges or masses have since been edited by MILD at most, ''
            if nothing can be said of how well it stands for the beam.
    """

    reference: ReferenceBeam
    default: ReferenceBeam
    default_name: str
    remarks: tuple[str, ...] = ()
    design: str = ""


def beam_of(arm: ChainModel | RodModel) -> StandsFor:
    """Return the beam that a file stands for.

    Raises:
        ModelError: a hinge of the beam has no stiffness, or a number of the `<custom>` block or of
            the robot is none that a beam can have.
    """
    written = written_beam(arm.model, arm.source)
    remarks: tuple[str, ...] = ()
    if isinstance(arm, RodModel):  # its other models are the chain that is designed for its beam
        reference, design = uniform_reference(parameters_of_rod(arm)), "tuned"
    else:
        reference, remarks, design = _of_chain(arm, written)
    if not written:
        remarks += (f"{_without(arm.model)}: its beam is read from bodies and springs",)
    return StandsFor(reference, *_default(reference, written), remarks, design)


def written_beam(model: mujoco.MjModel, source: str) -> dict[str, float]:
    """Return the numbers of a file's `<custom>` block by their parameters, none without NEEDED.

    Raises:
        ModelError: a number is not one that a beam can have, or there are several for one.
    """
    found = {}
    for name in WRITTEN:
        i = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_NUMERIC, f"beam_{name}")
        if i < 0:
            continue
        if model.numeric_size[i] != 1:
            raise ModelError(
                f"{source}: its <custom> block: beam_{name} has {model.numeric_size[i]} numbers; "
                "give one"
            )
        found[name] = float(model.numeric_data[model.numeric_adr[i]])
    if not set(NEEDED) <= set(found):
        return {}
    try:
        replace(Parameters(), **found)
    except ParameterError as error:
        raise ModelError(f"{source}: its <custom> block: {error}") from None
    return found


def _without(model: mujoco.MjModel) -> str:
    """Return in words what a file's `<custom>` block lacks to say which beam it was written for."""
    kind = mujoco.mjtObj.mjOBJ_NUMERIC
    there = {name: mujoco.mj_name2id(model, kind, f"beam_{name}") >= 0 for name in WRITTEN}
    if not any(there.values()):
        return "the file has no <custom> block"
    missing = " and ".join(f"beam_{name}" for name in NEEDED if not there[name])
    return f"the file's <custom> block lacks the number {missing}"


def _of_chain(
    chain: ChainModel, written: dict[str, float]
) -> tuple[ReferenceBeam, tuple[str, ...], str]:
    robot, masses = parameters_of(chain), masses_of(chain)  # refuses hinges without springs
    bending = bending_of(chain, [written["L"]] if written else [])
    L = chain.reach - chain.clamp
    beam = Parameters(L=L, EI=_equivalent(bending, L), rho=_mean(masses, L))
    pieces, lumps = _pieces(bending, masses)
    finite = finite_beam(pieces, lumps)
    payload, payload_inertia = masses.payload
    without = finite_beam(pieces, masses.lumps).damping_ratio[0] if sum(masses.payload) else None
    zeta = float(finite.damping_ratio[0] if without is None else without)
    own = replace(
        robot,
        L=L,
        EI=beam.EI,
        rho=beam.rho,
        r=chain.clamp,
        zeta=zeta,
        payload=payload,
        payload_inertia=payload_inertia,
    )
    hub = parts(chain)[1]
    first = float(hub.mass @ hub.x)
    base = Base(own, first if abs(first) > BALANCED else 0.0)
    uniform = bending.uniform and masses.uniform
    if not bending.design and not written:
        # hinges of another's design: no cell is known to be softer than others
        uniform = masses.uniform
        finite = finite if not uniform else uniform_reference(own).finite
    remarks = tuple(_remarks(bending, masses, bool(written)))
    return ReferenceBeam(base, finite, uniform), remarks, _design(bending, masses)


def _design(bending: Bending, masses: Masses) -> str:
    """Return how well a chain stands for its beam; see `StandsFor`."""
    if not bending.design or abs(masses.spin - 1) > SAME:
        return ""
    if bending.uniform and masses.uniform:
        return bending.design
    mild = max(float(each.max() / each.min()) for each in (bending.EI, masses.rho)) <= MILD
    aside = sum(lump.mass for lump in masses.lumps)  # at most one usual piece's mass
    light = aside <= float(masses.rho.mean() * masses.ends[-1]) / len(masses.rho)
    return "in pieces" if mild and light else ""


def _equivalent(bending: Bending, L: float) -> float:
    """Return the EI of the uniform beam that deflects as far under a force at the tip [N m2]."""
    if bending.uniform:
        return float(bending.EI.mean())
    cubes = cubed(L - bending.ends)
    return L**3 / float(np.sum((cubes[:-1] - cubes[1:]) / bending.EI))


def _mean(masses: Masses, L: float) -> float:
    """Return the density of a uniform beam with the mass of all but the payload [kg/m]."""
    total = np.sum(masses.rho * np.diff(masses.ends)) + sum(lump.mass for lump in masses.lumps)
    return float(total) / L


def _pieces(bending: Bending, masses: Masses) -> tuple[list[Piece], list[Lump]]:
    """Return pieces between all ends of cells and rigid pieces, and lumps, payload among them."""
    ends = np.unique(np.concatenate([bending.ends, masses.ends]))
    ends = ends[np.append(np.diff(ends) > SAME * ends[-1], True)]
    ends[0] = 0.0
    middle = (ends[:-1] + ends[1:]) / 2
    cell = np.searchsorted(bending.ends, middle) - 1
    piece = np.searchsorted(masses.ends, middle) - 1
    columns = (np.diff(ends), bending.EI[cell], masses.rho[piece], bending.eta[cell])
    pieces = [Piece(*map(float, row)) for row in zip(*columns, strict=True)]
    mass, inertia = masses.payload
    payload = [Lump(float(ends[-1]), mass, 0.0, inertia)] if mass or inertia else []
    return pieces, [*masses.lumps, *payload]


def _remarks(bending: Bending, masses: Masses, written: bool) -> Iterator[str]:
    """Give what makes the beam another than a uniform one, and what was taken for granted."""
    if not bending.design:
        yield (
            "its hinges are where no chain of ours has them"
            + (": EI of a cell is stiffness times length" if written else "")
            + ", as one that deflects as far under a force at the tip"
        )
    if bending.design and not bending.uniform:
        yield f"EI differs along the beam: {_uneven(bending.EI, 'hinge', 1)}"
    if not masses.uniform and np.ptp(masses.rho) > SAME * masses.rho.max():
        named = "segment" if len(masses.rho) == len(bending.EI) else "piece"
        yield f"rho differs along the beam: {_uneven(masses.rho, named, int(named == 'segment'))}"
    for lump in masses.lumps:
        yield f"a body of {lump.mass:.4g} kg is fixed to the beam {lump.place:.4g} m from the clamp"
    if abs(masses.spin - 1) > SAME:
        yield (
            f"moments of inertia of all its pieces are {masses.spin:.4g} of a slender rod's "
            "(m l^2/12)"
        )


def _uneven(values: Array, name: str, start: int) -> str:
    """Return in words where values differ from the usual one among them."""
    ratio = values / np.median(values)
    odd = [j for j in range(len(ratio)) if abs(ratio[j] - 1) > SAME]
    return ", ".join(f"{ratio[j]:.4g} times at {name} {j + start}" for j in odd)


def _default(own: ReferenceBeam, written: dict[str, float]) -> tuple[ReferenceBeam, str]:
    """Return the beam to compare with: the written one if it is another, else the default's."""
    if written:
        before = replace(own.parameters, **written)
        same = all(
            abs(getattr(before, name) - getattr(own.parameters, name))
            <= UNCHANGED * abs(getattr(before, name))
            for name in WRITTEN
        )
        if not (same and own.uniform):
            first = replace(own.base, parameters=before)
            return ReferenceBeam(first, uniform_reference(before).finite), AS_WRITTEN
    return uniform_reference(Parameters()), DEFAULT
