"""What makes a compiled MJCF file the two-link arm: names, joints, masses, actuators; or refused.

>>> require_arm(model, "my.xml")        # one line that names the element, if it is not
"""

from __future__ import annotations

import mujoco
import numpy as np

from flexsim.errors import ModelError


def require_arm(model: mujoco.MjModel, source: str) -> None:
    """Raise a ModelError unless the model has the elements that the plant addresses by name."""
    kinds = (
        ("joint", mujoco.mjtObj.mjOBJ_JOINT, ("joint1", "joint2")),
        ("site", mujoco.mjtObj.mjOBJ_SITE, ("hub", "tip")),
        ("motor", mujoco.mjtObj.mjOBJ_ACTUATOR, ("motor1", "motor2")),
    )
    for kind, code, names in kinds:
        for name in names:
            if mujoco.mj_name2id(model, code, name) < 0:
                raise ModelError(f"{source}: lacks the {kind} named {name!r}; name it so")
    order = [model.joint(i).name for i in range(2)]
    if order != ["joint1", "joint2"] or model.nv < 3:
        raise ModelError(
            f"{source}: its joints are {[model.joint(i).name for i in range(model.njnt)]}; "
            "the arm needs joint1, joint2, then one hinge or more along the beam"
        )
    if model.nu != 2 or [model.actuator(i).name for i in range(2)] != ["motor1", "motor2"]:
        raise ModelError(f"{source}: needs exactly the actuators motor1 and motor2, in this order")
    for i in range(2):
        plain = (
            model.actuator_gaintype[i] == mujoco.mjtGain.mjGAIN_FIXED
            and model.actuator_biastype[i] == mujoco.mjtBias.mjBIAS_NONE
        )
        on_joint = model.actuator_trntype[i] == mujoco.mjtTrn.mjTRN_JOINT
        if not (plain and on_joint and model.actuator_trnid[i, 0] == i):
            raise ModelError(
                f"{source}: actuator 'motor{i + 1}' is not a plain motor on joint{i + 1}; "
                f'write <motor name="motor{i + 1}" joint="joint{i + 1}"/>'
            )
    for i in range(model.nu):
        if model.actuator_actnum[i]:
            _not_plain(source, f"the actuator {model.actuator(i).name!r} with an activation")
    for kind, count in (("equality", model.neq), ("flex", model.nflex), ("tendon", model.ntendon)):
        if count:
            code = getattr(mujoco.mjtObj, f"mjOBJ_{kind.upper()}")
            name = mujoco.mj_id2name(model, code, 0)
            _not_plain(source, f"the {kind} {name!r}" if name else f"an {kind} without a name")
    for i in range(1, model.njnt):
        if model.dof_parentid[i] != i - 1:
            raise ModelError(
                f"{source}: joint {model.joint(i).name!r} starts another chain, as body "
                f"{model.body(model.jnt_bodyid[i]).name!r} is not carried by joint "
                f"{model.joint(i - 1).name!r}; the arm is one chain, every body carrying the next"
            )
    for site, joint in (("hub", 1), ("tip", model.njnt - 1)):
        carrier = model.body_weldid[model.site(site).bodyid[0]]
        if carrier != model.jnt_bodyid[joint]:
            raise ModelError(
                f"{source}: site {site!r} moves with body {model.body(carrier).name!r}; put it on "
                f"{model.body(model.jnt_bodyid[joint]).name!r}, behind the joint "
                f"{model.joint(joint).name!r}"
            )


def _not_plain(source: str, what: str) -> None:
    raise ModelError(f"{source}: has {what}; the arm is a plain chain of hinges")


def require_hinges(spec: mujoco.MjSpec, source: str) -> None:
    """Raise a ModelError for a joint that is none, before anything trips over it."""
    for joint in spec.joints:
        if joint.type != mujoco.mjtJoint.mjJNT_HINGE:
            kind = joint.type.name.removeprefix("mjJNT_").lower()
            raise ModelError(
                f"{source}: joint {joint.name!r} is a {kind} joint; the planar arm has only hinges"
            )


def _moves(body: mujoco.MjsBody) -> bool:
    """Return whether a body, or one that carries it, has a joint."""
    return bool(body.joints) or (body.name != "world" and _moves(body.parent))


def require_used_masses(spec: mujoco.MjSpec, source: str) -> None:
    """Raise a ModelError for a geom whose mass MuJoCo is told to ignore."""
    if spec.compiler.inertiafromgeom != mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE:
        return
    for geom in spec.geoms:
        if geom.mass > 0 and _moves(geom.parent):  # nan where none is given
            raise ModelError(
                f"{source}: geom {geom.name or geom.type.name.removeprefix('mjGEOM_').lower()!r} "
                f"of body {geom.parent.name!r} has mass {geom.mass:g}, which inertiafromgeom=false "
                "ignores; give it to the body's <inertial>"
            )


def require_masses(spec: mujoco.MjSpec, source: str) -> None:
    """Raise a ModelError for a negative mass or inertia, which MuJoCo would compile as zero."""
    for body in spec.bodies:
        if body.mass < 0 or min(body.inertia) < 0:
            raise ModelError(
                f"{source}: body {body.name!r} has mass {body.mass:g} and inertia "
                f"{' '.join(f'{value:g}' for value in body.inertia)}; give 0 or more"
            )


def require_physical(model: mujoco.MjModel, source: str) -> None:
    """Raise a ModelError unless masses, inertias, springs and dampers are finite and not negative.

    MuJoCo itself takes a nan with no more than a warning.
    """
    checked = (
        ("joint", "stiffness", model.jnt_stiffness),
        ("joint", "damping", model.dof_damping),
        ("joint", "armature", model.dof_armature),
        ("joint", "friction loss", model.dof_frictionloss),
        ("body", "mass", model.body_mass),
        ("body", "inertia", model.body_inertia.min(axis=1)),
    )
    for kind, quantity, values in checked:
        for i, value in enumerate(values):
            if not 0 <= value < np.inf:
                name = getattr(model, kind)(i).name
                raise ModelError(
                    f"{source}: {kind} {name!r} has {quantity} {value:g}; "
                    "give a finite number, 0 or more"
                )
    if not 0 < model.opt.timestep < np.inf:
        raise ModelError(f"{source}: timestep is {model.opt.timestep:g} s; give more than 0")
    for kind, quantity, vectors in (
        ("body", "pos", model.body_pos),
        ("body", "inertial pos", model.body_ipos),
        ("joint", "pos", model.jnt_pos),
        ("joint", "axis", model.jnt_axis),
        ("actuator", "gear", model.actuator_gear),
        ("joint", "springref", model.qpos_spring[:, None]),
    ):
        for i, vector in enumerate(vectors):
            if not np.isfinite(vector).all():
                name = getattr(model, kind)(i).name
                raise ModelError(
                    f"{source}: {kind} {name!r} has a {quantity} that is not a finite number"
                )
