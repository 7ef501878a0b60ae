"""Is it one arm, in a row along the x-axis, all joints turning about z? Chain and rod.

>>> list(places("chain", model))       # what is not where it belongs, a sentence each
[]
"""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray

from flexsim.mjcf.reading.linear_checks import together
from flexsim.numerics.types import Array

PLANE_TOLERANCE = 1e-9  # [m] how far from the x-axis of the arm an anchor may lie
SINGULAR = 1e-13  # smallest to largest eigenvalue of a mass matrix: of rounding only


def joint_names(model: mujoco.MjModel) -> list[str]:
    """Return the names of all joints."""
    return [model.joint(i).name for i in range(model.njnt)]


def one_chain(model: mujoco.MjModel) -> Iterator[str]:
    """Give joints that are not carried by the one before."""
    for i in range(1, model.njnt):
        if model.dof_parentid[i] != i - 1:
            yield (
                f"joint {model.joint(i).name!r} starts another chain, as body "
                f"{model.body(model.jnt_bodyid[i]).name!r} is not carried by joint "
                f"{model.joint(i - 1).name!r}; the arm is one chain, every body carrying the next"
            )


def one_rod(spec: mujoco.MjSpec, model: mujoco.MjModel) -> Iterator[str]:
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


def sites(kind: str, model: mujoco.MjModel) -> Iterator[str]:
    """Give sites that do not move with the body they belong to."""
    for site, joint in (("hub", joint_names(model).index("joint2")), ("tip", model.njnt - 1)):
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


def places(kind: str, model: mujoco.MjModel) -> Iterator[str]:
    """Give joints that do not turn about z, and what is not in a row along the x-axis."""
    data = straight(model)
    names = [f"joint {name!r}" for name in joint_names(model)]
    hinges = 2 if kind == "rod" else model.njnt
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
        elif kind == "rod" and i == 1:  # the first edge lies about the clamp, on joint 2 or beyond
            clamp = (points[2, 0] + points[3, 0]) / 2 - points[1, 0]
            if clamp < -PLANE_TOLERANCE:
                yield f"the rod is clamped {-clamp:g} m before joint 2; it must be there or beyond"
        elif length < 0 or (length == 0 and ends[i] != "joint 'joint2'"):
            yield (  # a chain's beam may begin at joint 2
                f"{ends[i + 1]} is {length:g} m along x from {ends[i]}; it must lie beyond it"
            )


def inertia(model: mujoco.MjModel) -> Iterator[str]:
    """Give a mass matrix that moves nothing in some direction."""
    data = straight(model)
    mujoco.mj_makeM(model, data)
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    inertias = np.linalg.eigvalsh(full) if np.isfinite(full).all() else np.zeros(1)
    if inertias[0] <= SINGULAR * inertias[-1]:
        yield "the mass matrix is singular: a joint moves nothing; give its bodies inertia"
