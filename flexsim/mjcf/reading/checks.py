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
from numpy.typing import NDArray

from flexsim.mjcf.reading.linear_checks import together
from flexsim.numerics.types import Array

PLANE_TOLERANCE = 1e-9  # [m] how far from the x-axis of the arm an anchor may lie
GEARS = (1e-4, 1e4)  # of motors, in magnitude: what squares and quotients of them can take
SHORTEST_TIMESTEP = 1e-6  # [s] a second of it takes a chain ten of a clock
SINGULAR = 1e-13  # smallest to largest eigenvalue of a mass matrix: of rounding only
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
        *(_joint_types(spec) if kind == "chain" else ()),
        *_negative_masses(spec),
        *_unused_masses(spec),
    ]


def reasons(kind: str, spec: mujoco.MjSpec, model: mujoco.MjModel) -> list[str]:
    """Return all that is against a compiled file's being the arm with a chain or a rod.

    Args:
        kind: 'chain' or 'rod'. spec, model: before and after compiling.
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
        found += [*(_one_chain(model) if kind == "chain" else _one_rod(spec, model))]
    if not found:
        found += [*_sites(kind, model), *_places(kind, model)]
    return found or [*_inertia(model)]


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


def _joint_names(model: mujoco.MjModel) -> list[str]:
    return [model.joint(i).name for i in range(model.njnt)]


def _order(kind: str, model: mujoco.MjModel) -> Iterator[str]:
    """Give another order of joints than joint1, joint2, then those of the beam."""
    names = _joint_names(model)
    there = {"joint1", "joint2"} <= set(names)
    if there and (names[:2] != ["joint1", "joint2"] or model.nv < 3):
        shown = names if len(names) <= SHOWN else [*names[:SHOWN], "..."]
        beam = "one hinge or more along the beam" if kind == "chain" else "two slides for a vertex"
        yield f"its joints are {shown}; the arm needs joint1, joint2, then {beam}"


def _motors(model: mujoco.MjModel) -> Iterator[str]:
    """Give actuators that are not plain torques on joint 1 and joint 2."""
    names = [model.actuator(i).name for i in range(model.nactuator)]
    if {"motor1", "motor2"} <= set(names) and names != ["motor1", "motor2"]:
        yield "needs exactly the actuators motor1 and motor2, in this order"
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
    if kind == "chain":
        kinds += [("equality", model.neq), ("flex", model.nflex)]
    for what, count in kinds:
        if count:
            code = getattr(mujoco.mjtObj, f"mjOBJ_{what.upper()}")
            name = mujoco.mj_id2name(model, code, 0)
            article = "an" if what[0] in "aeiou" else "a"
            named = f"the {what} {name!r}" if name else f"{article} {what} without a name"
            plain = "a plain chain of hinges" if kind == "chain" else "plain, but for its rod"
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
    if not SHORTEST_TIMESTEP <= step < np.inf:
        least = "more than 0" if not step > 0 else f"{SHORTEST_TIMESTEP:g} or more"
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


def _one_chain(model: mujoco.MjModel) -> Iterator[str]:
    for i in range(1, model.njnt):
        if model.dof_parentid[i] != i - 1:
            yield (
                f"joint {model.joint(i).name!r} starts another chain, as body "
                f"{model.body(model.jnt_bodyid[i]).name!r} is not carried by joint "
                f"{model.joint(i - 1).name!r}; the arm is one chain, every body carrying the next"
            )


def _one_rod(spec: mujoco.MjSpec, model: mujoco.MjModel) -> Iterator[str]:
    """Give what is not as `flexsim.mjcf.rod_xml` writes it."""
    hub = int(model.jnt_bodyid[1])
    hinge, slide = mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE
    beams = model.jnt_bodyid[2:]
    vertices = list(dict.fromkeys(beams.tolist()))
    fixed = model.body_weldid[model.flex_vertbodyid].tolist() if model.nflex == 1 else []
    along_and_across = [[1, 0, 0], [0, 1, 0]] * len(vertices)
    section = mujoco.mjtFlexSection.mjFLEXSECTION_CIRCLE
    for what, holds in (
        ("one flex of dimension 1", _one_flex(model)),
        (
            "hinges joint1 and joint2, joint2 on a body that link 1 carries",
            model.jnt_type[:2].tolist() == [hinge, hinge] and model.dof_parentid[1] == 0,
        ),
        (
            "slides only beyond them, two for a vertex, along x, then y",
            all(model.jnt_type[2:] == slide) and model.jnt_axis[2:].tolist() == along_and_across,
        ),
        ("every vertex on the hub", all(model.body_parentid[b] == hub for b in vertices)),
        (
            "its edges held by an equality and no other",
            model.eq_type[model.eq_active0].tolist() == [mujoco.mjtEq.mjEQ_FLEX],
        ),
        (
            "two vertices of the flex fixed to the hub, then each other one in the order of slides",
            fixed == [hub, hub, *vertices] and beams.tolist() == sorted([*vertices, *vertices]),
        ),
        (
            "a round section, and its EI given by young",
            model.nflex == 1 and spec.flexes[0].section == section,
        ),
        (
            "edges without stiffness and damping of their own",
            not (np.any(model.flex_edgestiffness) or np.any(model.flex_edgedamping)),
        ),
    ):
        if not holds:
            yield f"the arm with a rod needs {what}; write it as flexsim.mjcf.rod_xml does"
    yield from _on_vertices(model, vertices)


def _one_flex(model: mujoco.MjModel) -> bool:
    return bool(
        model.nflex == 1
        and model.flex_dim[0] == 1
        and not model.flex_rigid[0]
        and not model.flex_interp[0]
    )


def _on_vertices(model: mujoco.MjModel, vertices: list[int]) -> Iterator[str]:
    """Give bodies that vertices carry, and what their slides have beside the rod's force."""
    for body in range(model.nbody):
        if int(model.body_parentid[body]) in vertices and body not in vertices:
            carrier = model.body(int(model.body_parentid[body])).name
            name = model.body(body).name
            named = f"body {name!r}" if name else "a body without a name"
            yield (
                f"{named} is on the vertex {carrier!r} of the rod, which has only a mass; "
                "add its mass to the vertex, or give the chain a payload"
            )
    for what, values in (("stiffness", model.jnt_stiffness), ("an armature", model.dof_armature)):
        names = [model.joint(int(i) + 2).name for i in np.flatnonzero(values[2:])]
        own = f"{what}; a vertex of the rod has only what the flex gives it"
        yield from together("joint", names, own)


def _sites(kind: str, model: mujoco.MjModel) -> Iterator[str]:
    for site, joint in (("hub", 1), ("tip", model.njnt - 1)):
        carrier = model.body_weldid[model.site(site).bodyid[0]]
        if carrier != model.jnt_bodyid[joint]:
            yield (
                f"site {site!r} moves with body {model.body(carrier).name!r}; put it on "
                f"{model.body(model.jnt_bodyid[joint]).name!r}, behind the joint "
                f"{model.joint(joint).name!r}"
            )


def straight(model: mujoco.MjModel) -> mujoco.MjData:
    """Return the arm with all angles zero: places of bodies, joints, sites and vertices."""
    data = mujoco.MjData(model)
    data.qpos[:] = 0.0
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_flex(model, data)
    return data


def _places(kind: str, model: mujoco.MjModel) -> Iterator[str]:
    """Give joints that do not turn about z, and what is not in a row along the x-axis."""
    data = straight(model)
    names = [f"joint {name!r}" for name in _joint_names(model)]
    hinges = model.njnt if kind == "chain" else 2
    for name, axis, turned in zip(names[:hinges], data.xaxis, model.jnt_axis, strict=False):
        if not np.abs(axis - (0, 0, 1)).max() <= PLANE_TOLERANCE:  # so that a nan is caught
            found = " ".join(f"{value:g}" for value in turned)
            yield f"{name} has the axis {found}; it must turn about z, 0 0 1"
    if kind == "rod":
        for name, axis, wanted in zip(names[2:], data.xaxis[2:], _slides(model), strict=True):
            if not np.abs(axis - wanted).max() <= PLANE_TOLERANCE:
                yield f"{name} slides along {axis} when all angles are zero; it must along {wanted}"
    ends = [*names[:hinges], *_vertex_names(kind, model), "site 'tip'"]
    vertices = data.flexvert_xpos if kind == "rod" else np.empty((0, 3))
    points = np.vstack([data.xanchor[:hinges], vertices, data.site("tip").xpos])
    yield from _in_a_row(kind, ends, points)


def _slides(model: mujoco.MjModel) -> NDArray[np.float64]:
    return np.tile(np.eye(3)[:2], ((model.njnt - 2) // 2, 1))


def _vertex_names(kind: str, model: mujoco.MjModel) -> list[str]:
    return [f"vertex {i} of the rod" for i in range(model.nflexvert)] if kind == "rod" else []


def _in_a_row(kind: str, ends: list[str], points: Array) -> Iterator[str]:
    """Give points (P, 3) that are off the x-axis, or not beyond the one before."""
    for name, (x, y, z) in zip(ends, points, strict=True):
        first = name == ends[0]
        if not max(abs(y), abs(z), abs(x) if first else 0.0) <= PLANE_TOLERANCE:
            yield (
                f"{name} is at {x:g} {y:g} {z:g} m when all angles are zero; the arm must "
                f"{'start in the origin' if first else 'lie along the x-axis'}"
            )
    for i, length in enumerate(np.diff(points[:, 0])):
        last = i == len(ends) - 2
        if kind == "rod" and last:  # the tip is the last vertex
            if abs(length) > PLANE_TOLERANCE:
                yield f"site 'tip' is {length:g} m from the last vertex of the rod; put it there"
        elif length < 0 or (length == 0 and (i != 1 or kind == "rod")):
            yield (  # a chain's beam may begin at joint 2
                f"{ends[i + 1]} is {length:g} m along x from {ends[i]}; it must lie beyond it"
            )


def _inertia(model: mujoco.MjModel) -> Iterator[str]:
    """Give a mass matrix that moves nothing in some direction."""
    data = straight(model)
    mujoco.mj_makeM(model, data)
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    inertias = np.linalg.eigvalsh(full) if np.isfinite(full).all() else np.zeros(1)
    if inertias[0] <= SINGULAR * inertias[-1]:
        yield "the mass matrix is singular: a joint moves nothing; give its bodies inertia"
