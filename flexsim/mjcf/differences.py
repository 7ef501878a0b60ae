"""What does an edited MJCF file change? Its compiled numbers against the default's, by name.

    >>> differences(load_chain("my.xml"))
    [Difference(element='segment6', attribute='mass [kg]', default='0.0121039', yours='0.0621039')]

The default is the tuned chain of the default robot with as many segments as the file, so that
another number of them is one difference, not a hundred; of a file of one link on a stand, or of two
that bend, that of the arm of ours of this kind.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache
from typing import Any, NamedTuple

import mujoco
import numpy as np

from flexsim.arm.arms import named_arm
from flexsim.arm.chain_design import SEGMENTS, SEGMENTS_LEAST, SEGMENTS_MOST
from flexsim.arm.locked import LOCKED
from flexsim.arm.parameters import Parameters
from flexsim.mjcf.arms.one_link import designed_one_link
from flexsim.mjcf.arms.two_chains import designed_two_chains
from flexsim.mjcf.as_parameters import parameters_of, parameters_of_rod
from flexsim.mjcf.chain_file import ChainModel
from flexsim.mjcf.designed import designed_chain, designed_rod
from flexsim.mjcf.rod_file import RodModel
from flexsim.mjcf.rod_xml import ELEMENTS

RELATIVE, ABSOLUTE = 1e-9, 1e-12  # below which numbers are the same: files have 12 digits
ABSENT = "-"

BODY = (("pos", "m"), ("quat", "-"), ("mass", "kg"), ("ipos", "m"), ("inertia", "kg m2"))
JOINT = (
    ("pos", "m"),
    ("axis", "-"),
    ("stiffness", "N m/rad"),
    ("damping", "N m s/rad"),
    ("armature", "kg m2"),
    ("frictionloss", "N m"),
    ("range", "rad"),
    ("springref", "rad"),
    ("actuatorfrcrange", "N m"),
    ("stiffness, nonlinear", "SI"),
    ("damping, nonlinear", "SI"),
)
OPTION = (("gravity", "m/s2"), ("density", "kg/m3"), ("viscosity", "Pa s"))
ACTING = {"gravity": np.array([1.0, 1.0, 0.0])}  # across the plane it does nothing
FLAGS = {
    "contact": mujoco.mjtDisableBit.mjDSBL_CONTACT,
    "spring": mujoco.mjtDisableBit.mjDSBL_SPRING,
    "damper": mujoco.mjtDisableBit.mjDSBL_DAMPER,
    "constraint": mujoco.mjtDisableBit.mjDSBL_CONSTRAINT,
    "limit": mujoco.mjtDisableBit.mjDSBL_LIMIT,
    "frictionloss": mujoco.mjtDisableBit.mjDSBL_FRICTIONLOSS,
    "clampctrl": mujoco.mjtDisableBit.mjDSBL_CLAMPCTRL,
    "eulerdamp": mujoco.mjtDisableBit.mjDSBL_EULERDAMP,
}
ACTUATOR = (
    ("ctrlrange", "N m"),
    ("forcerange", "N m"),
    ("armature", "kg m2"),
    ("damping", "N m s/rad"),
    ("delay", "s"),
)
NAMES = {"ipos": "inertial pos"}
BEAM = (  # of the equivalent uniform beam
    ("L", "m"),
    ("r", "m"),
    ("rho", "kg/m"),
    ("EI", "N m2"),
    ("zeta", "-"),
    ("payload", "kg"),
    ("payload_inertia", "kg m2"),
)


class Difference(NamedTuple):
    """One number that differs, as text; elements with the same change share a row."""

    element: str
    attribute: str
    default: str
    yours: str


def differences(arm: ChainModel | RodModel) -> list[Difference]:
    """Return what a file changes, options first, then bodies, joints, sites, motors, by name."""
    return _of_rod(arm) if isinstance(arm, RodModel) else _of_chain(arm)


def _of_rod(rod: RodModel) -> list[Difference]:
    elements = len(rod.vertices) - 2
    default = designed_rod(Parameters(), elements)
    found = []
    if elements != ELEMENTS:
        found.append(Difference("beam", "elements", str(ELEMENTS), str(elements)))
    found += _beam(Parameters(), parameters_of_rod(rod))
    return _shared(found + list(_changed(dict(_values(default.model)), dict(_values(rod.model)))))


def arm_like(arm: ChainModel | RodModel) -> str:
    """Return the name of the arm of ours that a file is held against."""
    if isinstance(arm, ChainModel) and arm.bends_twice:
        return "two-flexible"
    return "one-link" if arm.model.dof_armature[0] >= LOCKED else "paper"


def _of_chain(chain: ChainModel) -> list[Difference]:
    segments, name = len(chain.lengths), arm_like(chain)
    tunable = SEGMENTS_LEAST <= segments <= SEGMENTS_MOST
    default = _default(segments if tunable else SEGMENTS, name)
    found = []
    if segments != SEGMENTS:
        found.append(Difference("beam", "segments", str(SEGMENTS), str(segments)))
    if not chain.bends_twice:
        found += _beam(parameters_of(default), parameters_of(chain))
    usual, own = dict(_values(default.model)), dict(_values(chain.model))
    if segments != SEGMENTS:
        usual[("option", "timestep [s]")] = np.array([1e-3])
    found += _changed(usual, own)
    return _shared(found)


@lru_cache
def _default(segments: int, name: str) -> ChainModel:
    """Return the tuned chain of an arm of ours; tuning it takes a while."""
    arm = named_arm(name)
    if arm.link1 is not None:
        return designed_two_chains(arm, (segments, segments))
    make = designed_one_link if name == "one-link" else designed_chain
    return make(arm.parameters, segments)


def _beam(usual: Parameters, own: Parameters) -> Iterator[Difference]:
    """Give what changes of the beam as a whole, in the numbers of the equivalent uniform one."""
    for symbol, unit in BEAM:
        before, after = getattr(usual, symbol), getattr(own, symbol)
        if not math.isclose(after, before, rel_tol=RELATIVE, abs_tol=ABSOLUTE):
            label = f"{symbol} [{unit}]"
            yield Difference("beam, as a uniform one", label, f"{before:.6g}", f"{after:.6g}")


def _values(model: mujoco.MjModel) -> Iterator[tuple[tuple[str, str], Any]]:
    """Give ((element, attribute with unit), numbers) of all that acts on the motion."""
    yield ("option", "timestep [s]"), np.array([model.opt.timestep])
    yield ("option", "integrator"), np.array([float(model.opt.integrator)])
    for attribute, unit in OPTION:
        value = np.atleast_1d(getattr(model.opt, attribute))
        yield ("option", f"{attribute} [{unit}]"), value * ACTING.get(attribute, 1.0)
    for name, bit in FLAGS.items():
        off = bool(model.opt.disableflags & bit)
        yield ("option", f"{name} disabled"), np.array([float(off)])
    for i in range(1, model.nbody):
        body = model.body(i)
        own_name = body.name or f"body {i} in {model.body(model.body_parentid[i]).name}"
        for attribute, unit in BODY:
            label = f"{NAMES.get(attribute, attribute)} [{unit}]"
            yield (own_name, label), np.atleast_1d(getattr(body, attribute)).copy()
    for i in range(model.njnt):
        joint = model.joint(i)
        dof, address = int(model.jnt_dofadr[i]), int(model.jnt_qposadr[i])
        own = {
            "damping": model.dof_damping[dof],
            "armature": model.dof_armature[dof],
            "frictionloss": model.dof_frictionloss[dof],
            "springref": model.qpos_spring[address],
            "actuatorfrcrange": model.jnt_actfrcrange[i],
            "stiffness, nonlinear": model.jnt_stiffnesspoly[i],
            "damping, nonlinear": model.dof_dampingpoly[dof],
        }
        for attribute, unit in JOINT:
            value = own[attribute] if attribute in own else getattr(joint, attribute)
            yield (joint.name, f"{attribute} [{unit}]"), np.atleast_1d(value).copy()
    for i in range(model.nsite):
        yield (f"site {model.site(i).name}", "pos [m]"), model.site(i).pos.copy()
    for i in range(model.nu):
        gear = model.actuator_gear[i, :1] * model.actuator_gainprm[i, 0]
        yield (model.actuator(i).name, "gear [-]"), gear
        for attribute, unit in ACTUATOR:
            value = np.atleast_1d(getattr(model, f"actuator_{attribute}")[i])
            yield (model.actuator(i).name, f"{attribute} [{unit}]"), value.copy()
    if not model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_CONTACT:
        for i in range(model.ngeom):
            bits = np.array([model.geom_contype[i], model.geom_conaffinity[i]], float)
            if bits.any():
                yield (f"geom {model.geom(i).name or i}", "contype, conaffinity [-]"), bits


def _text(value: Any) -> str:
    return ABSENT if value is None else " ".join(f"{x:.6g}" for x in np.asarray(value) + 0.0)


def _changed(usual: dict[Any, Any], own: dict[Any, Any]) -> Iterator[Difference]:
    missing: set[str] = {name for name, _ in usual} - {name for name, _ in own}
    added: set[str] = {name for name, _ in own} - {name for name, _ in usual}
    yield from (Difference(name, "element", "present", ABSENT) for name in sorted(missing))
    for key in [*own, *(key for key in usual if key not in own)]:
        element, attribute = key
        if element in missing:
            continue
        before, after = usual.get(key), own.get(key)
        if element in added:
            if attribute.startswith(("mass", "stiffness [", "contype")) and np.any(after):
                yield Difference(f"{element}, added", attribute, ABSENT, _text(after))
            continue
        if before is None or after is None or not _same(before, after):
            yield Difference(element, attribute, _text(before), _text(after))


def _same(before: Any, after: Any) -> bool:
    return np.shape(before) == np.shape(after) and np.allclose(before, after, RELATIVE, ABSOLUTE)


def _shared(found: list[Difference]) -> list[Difference]:
    """Return the rows, neighbours with the same change of the same attribute in one."""
    by_change: dict[tuple[str, str, str], list[str]] = {}
    for row in found:
        by_change.setdefault(row[1:], []).append(row.element)
    return [
        Difference(names[0] if len(names) == 1 else f"{names[0]} to {names[-1]}", *change)
        for change, names in by_change.items()
    ]
