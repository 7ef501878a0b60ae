"""A copy of a model without what does not move it, for loops that step it: the same bits, sooner.

    >>> chain = load_chain("models/chain6.xml")
    >>> stepped(chain.model, chain.text).ngeom
    0

Geoms that touch nothing, cameras, lights, sites and sensors cost a place each at every evaluation,
the stages of constraints a look at what there is, energies and the comparison with the inverse a
pass over all bodies. Nothing of that enters a motion. Every number that does is copied as it is.
"""

from __future__ import annotations

import copy
import warnings
from collections.abc import Iterator

import mujoco
import numpy as np

from flexsim.numerics.mujoco_c import quiet_warnings
from flexsim.numerics.types import Array

MOVES = tuple("body_ jnt_ dof_ qpos actuator_ eq_ flex_ flexedge_ M_".split())  # arrays' names
PLACED = (  # among them: where what is left out was listed
    "body_geomadr",
    "body_geomnum",
    "body_bvhadr",
    "body_bvhnum",
    "body_margin",
    "body_contype",
    "body_conaffinity",
    "flex_bvhadr",
    "flex_bvhnum",
    "flex_matid",
)
DERIVED = ("body_sameframe", "body_simple", "dof_simplenum")  # whole numbers that follow masses
SHOWS = mujoco.mjtEnableBit.mjENBL_ENERGY | mujoco.mjtEnableBit.mjENBL_FWDINV


def stepped(model: mujoco.MjModel, text: str) -> mujoco.MjModel:
    """Return a model that moves as `model` does, to the bit, at less cost; else `model` itself.

    Args:
        model: of `text`, its numbers perhaps changed since. text: self-contained MJCF.
    """
    if can_touch(model) or model.opt.density or model.opt.viscosity:  # geoms may count
        return model
    with quiet_warnings(), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # given when the file was read
        bare = _without_the_rest(text)
    moving = _moving(model)
    if bare is None or not _alike(moving, _moving(bare)):
        return model
    for name, values in moving.items():
        getattr(bare, name)[...] = values
    _copy_struct(model.opt, bare.opt)
    _copy_struct(model.stat, bare.stat)
    bare.opt.enableflags &= ~SHOWS
    if not can_be_held(model):
        bare.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    return bare


def can_touch(model: mujoco.MjModel) -> bool:
    """Return whether anything could ever make contact."""
    disabled = bool(model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_CONTACT)
    able = (model.geom_contype | model.geom_conaffinity).any()
    return not disabled and bool(able or model.npair or model.nflex)


def can_be_held(model: mujoco.MjModel) -> bool:
    """Return whether a constraint could ever act on a model that touches nothing."""
    return bool(
        model.neq or model.ntendon or model.jnt_limited.any() or model.dof_frictionloss.any()
    )


def _without_the_rest(text: str) -> mujoco.MjModel | None:
    """Return MJCF compiled without what is only shown or measured, None where that needs it."""
    spec = mujoco.MjSpec.from_string(text)
    whole = spec.compile()
    if len(spec.bodies) != whole.nbody:  # some were fused
        return None
    for body in spec.bodies[1:]:
        i = body.id
        body.explicitinertial = True
        body.mass, body.inertia = whole.body_mass[i], whole.body_inertia[i]
        body.ipos, body.iquat = whole.body_ipos[i], whole.body_iquat[i]
        body.ialt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT
        body.fullinertia = np.full(6, np.nan)
    spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    for kind in ("sensors", "excludes", "keys", "skins", "cameras", "lights", "sites", "geoms"):
        for element in list(getattr(spec, kind)):
            spec.delete(element)
    try:
        return spec.compile()
    except (ValueError, mujoco.FatalError):
        return None


def _moving(model: mujoco.MjModel) -> dict[str, Array]:
    """Return a model's arrays that enter its motion, by name."""
    names = [name for name in dir(model) if name.startswith(MOVES) and name not in PLACED]
    found = {name: getattr(model, name) for name in names}
    return {name: values for name, values in found.items() if isinstance(values, np.ndarray)}


def _alike(one: dict[str, Array], other: dict[str, Array]) -> bool:
    """Return whether two models' arrays have the same shapes and whole numbers, DERIVED aside."""
    return one.keys() == other.keys() and all(
        values.shape == other[name].shape
        and (values.dtype.kind == "f" or name in DERIVED or np.array_equal(values, other[name]))
        for name, values in one.items()
    )


def _copy_struct(source: object, target: object) -> None:
    """Copy every field of MuJoCo's `opt` or `stat`."""
    for name in _fields(source):
        value = copy.copy(getattr(source, name))
        if isinstance(value, np.ndarray):
            getattr(target, name)[...] = value
        else:
            setattr(target, name, value)


def _fields(struct: object) -> Iterator[str]:
    return (name for name in dir(struct) if not name.startswith("_"))
