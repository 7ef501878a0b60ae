"""What makes MJCF the two-link arm? One list of checks, for a chain's file and for a rod's.

    >>> reasons("chain", spec, model)       # all that is against it, a sentence each
    []

Each check names the element, says what is wrong and what would do. Whatever steps otherwise than
by positions, rates and torques is refused here: what sleeps, what has a state of its own.
"""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np

from flexsim.mjcf.reading.geometry import (
    inertia,
    joint_names,
    one_chain,
    one_rod,
    places,
    sites,
)
from flexsim.numerics.step_limits import SHORTEST_STEP

GEARS = (1e-4, 1e4)  # of motors, in magnitude: what squares and quotients of them can take
NAMED = (  # what is addressed by name; the option that maps another name has ours
    ("joint", mujoco.mjtObj.mjOBJ_JOINT, ("joint1", "joint2")),
    ("site", mujoco.mjtObj.mjOBJ_SITE, ("hub", "tip")),
    ("motor", mujoco.mjtObj.mjOBJ_ACTUATOR, ("motor1", "motor2")),
)
COUNTS = {"joint": "njnt", "site": "nsite", "motor": "nactuator"}
EXAMPLES = {
    "hub": '<site name="hub"/> in the body behind joint2',
    "tip": '<site name="tip" pos="..."/> in the last body',
    "motor1": '<motor name="motor1" joint="joint1"/>',
    "motor2": '<motor name="motor2" joint="joint2"/>',
}
SHOWN = 8  # names at most that a message lists


def before_compiling(kind: str, spec: mujoco.MjSpec) -> list[str]:
    """Return what is against a specification, before the compiler trips over it or hides it."""
    return [
        *(_joint_types(spec) if kind != "rod" else ()),
        *_negative_masses(spec),
        *_unused_masses(spec),
    ]


def reasons(kind: str, spec: mujoco.MjSpec, model: mujoco.MjModel) -> list[str]:
    """Return all that is against a compiled file's being the arm with a chain or a rod.

    Args:
        kind: 'chain', 'rod' or 'two-chains'. spec, model: before and after compiling.
    """
    found = [
        *_names(model),
        *_order(kind, model),
        *_motors(model),
        *_additions(kind, model),
        *_options(kind, model),
        *_numbers(model),
    ]
    if not found:  # else these would say the same again, or not know what they look at
        found += [*(one_rod(spec, model) if kind == "rod" else one_chain(model))]
    if not found:
        found += [*sites(kind, model), *places(kind, model)]
    return found or [*inertia(model)]


def _joint_types(spec: mujoco.MjSpec) -> Iterator[str]:
    for joint in spec.joints:
        if joint.type != mujoco.mjtJoint.mjJNT_HINGE:
            kind = joint.type.name.removeprefix("mjJNT_").lower()
            yield f"joint {joint.name!r} is a {kind} joint; the planar arm has only hinges"


def _negative_masses(spec: mujoco.MjSpec) -> Iterator[str]:
    """Give negative masses and inertias, which MuJoCo would compile as zero."""
    for body in spec.bodies:
        if body.mass < 0 or min(body.inertia) < 0:
            yield (
                f"body {body.name!r} has mass {body.mass:g} and inertia "
                f"{' '.join(f'{value:g}' for value in body.inertia)}; give 0 or more"
            )


def _unused_masses(spec: mujoco.MjSpec) -> Iterator[str]:
    """Give geoms whose mass MuJoCo is told to ignore."""
    if spec.compiler.inertiafromgeom != mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE:
        return
    for geom in spec.geoms:
        if geom.mass > 0 and _moves(geom.parent):  # nan where none is given
            name = geom.name or geom.type.name.removeprefix("mjGEOM_").lower()
            yield (
                f"geom {name!r} of body {geom.parent.name!r} has mass {geom.mass:g}, which "
                "inertiafromgeom=false ignores; give it to the body's <inertial>"
            )


def _moves(body: mujoco.MjsBody) -> bool:
    """Return whether a body, or one that carries it, has a joint."""
    return bool(body.joints) or (body.name != "world" and _moves(body.parent))


def _names(model: mujoco.MjModel) -> Iterator[str]:
    for kind, code, names in NAMED:
        for name in names:
            if mujoco.mj_name2id(model, code, name) < 0:
                there = [
                    mujoco.mj_id2name(model, code, i) for i in range(getattr(model, COUNTS[kind]))
                ]
                shown = ", ".join(repr(other) for other in there if other) or "none with a name"
                add = f", add {EXAMPLES[name]}" if name in EXAMPLES else ""
                yield (
                    f"lacks the {kind} named {name!r}; name one so{add}, or say --{name} NAME "
                    f"(it has {_cut(shown)})"
                )


def _cut(text: str, most: int = 120) -> str:
    return text if len(text) <= most else f"{text[:most]}..."


def _order(kind: str, model: mujoco.MjModel) -> Iterator[str]:
    """Give another order of joints than joint1, joint2, then those of the beam."""
    names = joint_names(model)
    there = {"joint1", "joint2"} <= set(names)
    if there and kind == "two-chains":
        if names[0] != "joint1" or names[-1] == "joint2":
            yield (
                "has its joints in another order; an arm whose links both bend needs joint1, "
                "hinges along link 1, joint2, then one hinge or more along link 2"
            )
    elif there and (names[:2] != ["joint1", "joint2"] or model.nv < 3):
        shown = names if len(names) <= SHOWN else [*names[:SHOWN], "..."]
        beam = "one hinge or more along the beam" if kind == "chain" else "two slides for a vertex"
        yield f"its joints are {shown}; the arm needs joint1, joint2, then {beam}"


def _motors(model: mujoco.MjModel) -> Iterator[str]:
    """Give actuators that are not plain torques on joint 1 and joint 2."""
    names = [model.actuator(i).name for i in range(model.nactuator)]
    if {"motor1", "motor2"} <= set(names) and names != ["motor1", "motor2"]:
        yield (
            f"its actuators are {_cut(', '.join(names))}; the arm needs motor1, then motor2, and "
            "no other: put them in this order, or swap --motor1 and --motor2"
        )
        return
    for i, name in enumerate(names):
        if name not in ("motor1", "motor2"):
            continue
        joint = f"joint{name[-1]}"
        if not _plain_on(model, i, joint):
            yield (
                f"actuator {name!r} is not a plain motor on {joint}; write "
                f'<motor name="{name}" joint="{joint}"/>'
            )
            continue
        gear = abs(float(model.actuator_gear[i, 0] * model.actuator_gainprm[i, 0]))
        if gear and not GEARS[0] <= gear <= GEARS[1]:  # 0 and less: said with the robot's numbers
            yield f"actuator {name!r} has the gear {gear:g}; give {GEARS[0]:g} to {GEARS[1]:g}"
        if model.opt.disableactuator >> int(model.actuator_group[i]) & 1:
            yield (
                f"actuator {name!r} has a group that is disabled, so its torque is ignored; leave "
                "actuatorgroupdisable out"
            )
        if model.actuator_history[i].any() or model.actuator_delay[i]:
            yield f"actuator {name!r} has a delay, which outlasts a run; leave it out"


def _plain_on(model: mujoco.MjModel, i: int, joint: str) -> bool:
    """Return whether an actuator is its control times its gear, on a joint."""
    target = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, joint)
    return bool(
        model.actuator_gaintype[i] == mujoco.mjtGain.mjGAIN_FIXED
        and model.actuator_biastype[i] == mujoco.mjtBias.mjBIAS_NONE
        and model.actuator_dyntype[i] == mujoco.mjtDyn.mjDYN_NONE
        and model.actuator_actnum[i] == 0
        and model.actuator_ctrlnum[i] == 1
        and model.actuator_plugin[i] < 0
        and model.actuator_trntype[i] == mujoco.mjtTrn.mjTRN_JOINT
        and (target < 0 or model.actuator_trnid[i, 0] == target)
    )


def _additions(kind: str, model: mujoco.MjModel) -> Iterator[str]:
    """Give what a plain arm does not have."""
    kinds = [("tendon", model.ntendon)]
    if kind != "rod":
        kinds += [("equality", model.neq), ("flex", model.nflex)]
    for what, count in kinds:
        if count:
            code = getattr(mujoco.mjtObj, f"mjOBJ_{what.upper()}")
            name = mujoco.mj_id2name(model, code, 0)
            article = "an" if what[0] in "aeiou" else "a"
            named = f"the {what} {name!r}" if name else f"{article} {what} without a name"
            plain = "plain, but for its rod" if kind == "rod" else "a plain chain of hinges"
            yield f"has {named}; the arm is {plain}"
    if model.nplugin:
        yield (
            "has an instance of a plugin, which steps by rules and a state of its own; leave it "
            "out, or write a plain <motor>"
        )
    if model.nhistory:
        yield "has a sensor or actuator with a history (delay, nsample), a state; leave it out"


def _options(kind: str, model: mujoco.MjModel) -> Iterator[str]:
    """Give flags with which the arm does not move as a torque would have it."""
    disabled, enabled = model.opt.disableflags, model.opt.enableflags
    if disabled & mujoco.mjtDisableBit.mjDSBL_ACTUATION:
        yield "the option's flag disables actuation, so torques are ignored; leave it out"
    if enabled & mujoco.mjtEnableBit.mjENBL_SLEEP:
        yield (
            "the option's flag enables sleep: an arm at rest stays so under any torque; leave "
            'sleep="enable" out'
        )
    if kind == "rod":
        for name, bit in (
            ("constraint", mujoco.mjtDisableBit.mjDSBL_CONSTRAINT),
            ("equality", mujoco.mjtDisableBit.mjDSBL_EQUALITY),
        ):
            if disabled & bit:
                yield (
                    f"the option's flag disables {name}, which holds the edges of the rod; leave "
                    f'{name}="disable" out'
                )


def _numbers(model: mujoco.MjModel) -> Iterator[str]:
    """Give masses, inertias, springs and dampers that are negative or not finite.

    MuJoCo itself takes a nan with no more than a warning.
    """
    for kind, quantity, values in (
        ("joint", "stiffness", model.jnt_stiffness),
        ("joint", "damping", model.dof_damping),
        ("joint", "armature", model.dof_armature),
        ("joint", "friction loss", model.dof_frictionloss),
        ("body", "mass", model.body_mass),
        ("body", "inertia", model.body_inertia.min(axis=1)),
    ):
        for i, value in enumerate(values):
            if not 0 <= value < np.inf:
                name = getattr(model, kind)(i).name
                yield f"{kind} {name!r} has {quantity} {value:g}; give a finite number, 0 or more"
    step = float(model.opt.timestep)
    if not SHORTEST_STEP <= step < np.inf:
        least = "more than 0" if not step > 0 else f"{SHORTEST_STEP:g} or more"
        yield f"timestep is {step:g} s; give {least}"
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
                yield f"{kind} {name!r} has a {quantity} that is not a finite number"
