"""The geometry of an MJCF file in motion: one entity for all its boxes, one for all cylinders, ...

>>> log_solids(stream, "line/scene/chain/solids", model, time_column, states, colour)

Drawn as wires, so that what lies inside is seen. Planes, height fields and flexes are left out.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import rerun as rr

from flexsim.numerics.types import Array
from flexsim.recording.colours import Colour

if TYPE_CHECKING:
    import mujoco

WIRE = 0.6  # radius [points]
GROUPS = 3  # of MuJoCo's six groups of geoms, those its own viewer shows


def poses(model: mujoco.MjModel, states: Array) -> tuple[Array, Array]:
    """Return where all geoms are: positions (K, G, 3) [m], quaternions (K, G, 4) as x, y, z, w.

    Args:
        states: (K, 2 nq), of which the positions are read.
    """
    import mujoco

    data = mujoco.MjData(model)
    places, turns = (np.zeros((len(states), model.ngeom, n)) for n in (3, 4))
    quaternion = np.zeros(4)
    for k, qpos in enumerate(states[:, : model.nq]):
        data.qpos[:] = qpos
        mujoco.mj_kinematics(model, data)
        places[k] = data.geom_xpos
        for i, matrix in enumerate(data.geom_xmat):
            mujoco.mju_mat2Quat(quaternion, matrix)
            turns[k, i] = quaternion[[1, 2, 3, 0]]
    return places, turns


def _static(kind: str, size: Array) -> Any:
    """Return an archetype's shape for geoms of sizes (g, 3), without their places."""
    boxes, round_ones = rr.Boxes3D.from_fields, rr.Cylinders3D.from_fields
    if kind == "boxes":
        return boxes(half_sizes=size)
    if kind == "cylinders":
        return round_ones(radii=size[:, 0], lengths=2 * size[:, 1])
    if kind == "capsules":
        return rr.Capsules3D.from_fields(radii=size[:, 0], lengths=2 * size[:, 1])
    return rr.Ellipsoids3D.from_fields(half_sizes=size)


def _kinds(model: mujoco.MjModel) -> dict[str, Any]:
    """Return the indices of geoms that are drawn, by kind."""
    from mujoco import mjtGeom

    drawn = (model.geom_group < GROUPS) & (model.geom_rgba[:, 3] > 0)
    kinds = {
        "boxes": (mjtGeom.mjGEOM_BOX,),
        "cylinders": (mjtGeom.mjGEOM_CYLINDER,),
        "capsules": (mjtGeom.mjGEOM_CAPSULE,),
        "ellipsoids": (mjtGeom.mjGEOM_SPHERE, mjtGeom.mjGEOM_ELLIPSOID),
        "meshes": (mjtGeom.mjGEOM_MESH,),
    }
    found = {
        name: np.flatnonzero(drawn & np.isin(model.geom_type, types))
        for name, types in kinds.items()
    }
    return {name: chosen for name, chosen in found.items() if chosen.size}


def _sizes(model: mujoco.MjModel, chosen: Any) -> Array:
    """Return sizes (g, 3) of geoms; a sphere's radius along every axis."""
    from mujoco import mjtGeom

    size = model.geom_size[chosen].copy()
    spheres = model.geom_type[chosen] == mjtGeom.mjGEOM_SPHERE
    size[spheres] = size[spheres, :1]
    return size


def log_solids(
    stream: rr.RecordingStream,
    path: str,
    model: mujoco.MjModel,
    time: rr.TimeColumn,
    states: Array,
    colour: Colour,
) -> None:
    """Record an MJCF file's geometry below a path, moving with states (K, 2 nq)."""
    places, turns = poses(model, states)
    for kind, chosen in _kinds(model).items():
        if kind == "meshes":
            for geom in chosen:
                _log_mesh(stream, f"{path}/meshes/{geom}", model, geom, colour)
                where: dict[str, Any] = {
                    "translations": places[:, geom],
                    "quaternions": turns[:, geom],
                }
                columns = rr.InstancePoses3D.columns(**where)
                stream.send_columns(f"{path}/meshes/{geom}", [time], columns)
            continue
        _log_kind(stream, f"{path}/{kind}", kind, _sizes(model, chosen), colour)
        centre = places[:, chosen]
        if kind == "capsules":  # MuJoCo's are centred, rerun's begin at their origin
            centre = centre - _axes(turns[:, chosen]) * model.geom_size[chosen, 1:2]
        name = "translations" if kind == "capsules" else "centers"
        where = {
            name: centre.reshape(-1, 3).astype(np.float32),
            "quaternions": turns[:, chosen].reshape(-1, 4).astype(np.float32),
        }
        archetype = getattr(rr, f"{kind.capitalize()}3D")
        counts = np.full(len(states), len(chosen))
        stream.send_columns(f"{path}/{kind}", [time], archetype.columns(**where).partition(counts))


def _log_kind(
    stream: rr.RecordingStream, path: str, kind: str, size: Array, colour: Colour
) -> None:
    """Record shape and style of all geoms of a kind."""
    archetype = getattr(rr, f"{kind.capitalize()}3D")
    wires = {"radii" if kind == "boxes" else "line_radii": rr.Radius.ui_points([WIRE])}
    how = {"colors": [colour], "fill_mode": "majorwireframe", **wires}
    stream.log(path, _static(kind, size), archetype.from_fields(**how), static=True)


def _log_mesh(
    stream: rr.RecordingStream, path: str, model: mujoco.MjModel, geom: int, colour: Colour
) -> None:
    """Record the mesh of one geom."""
    mesh = int(model.geom_dataid[geom])
    first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
    face, faces = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
    shape = rr.Mesh3D(
        vertex_positions=model.mesh_vert[first : first + count],
        triangle_indices=model.mesh_face[face : face + faces],
        albedo_factor=[*colour, 255],
    )
    stream.log(path, shape, static=True)


def _axes(turns: Array) -> Array:
    """Return the direction (..., 3) into which quaternions (..., 4) turn the z-axis."""
    x, y, z, w = np.moveaxis(turns, -1, 0)
    return np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x**2 + y**2)], axis=-1)
