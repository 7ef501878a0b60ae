"""A beam put into a file, and proof of it: all else compiles as before, its frequencies are right.

    >>> made = attached("robot.xml", "wrist", part)
    >>> made.text, made.frequency / made.wanted - 1

The file is compiled before and after. Of the latter the beam's body is deleted again, in MuJoCo's
own specification: what then compiles must be the former, to the byte.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np

from flexsim.arm.hinged_beam import FITTED_MODES
from flexsim.errors import ModelError, ParameterError
from flexsim.mjcf.chain_file import mass_matrix
from flexsim.mjcf.parts.beam_xml import SET_BACK, BeamPart, body_lines, class_lines
from flexsim.mjcf.parts.insert import Added, place_for, with_keys, with_part
from flexsim.mjcf.reading.elements import ROOT, elements
from flexsim.mjcf.reading.text import read_mjcf, with_includes
from flexsim.numerics.eigen import natural_modes
from flexsim.numerics.mujoco_c import quiet_warnings
from flexsim.numerics.types import Array

FREQUENCY_MOST = 1e-4  # relative error of a clamped frequency, as compiled
KINDS = {"body": "bodies", "joint": "joints", "site": "sites"}


@dataclass(frozen=True, eq=False)
class Attached:
    """A file with a beam.

    Attributes:
        text: of the file, but for the beam as it was.
        frequency, wanted: (3,) of the compiled beam, clamped, and of the beam that it stands for
            [rad/s]; frequency_out, wanted_out: out of the plane, (0,) of a planar one.
        highest: frequency of the clamped chain [rad/s]. timestep: of the file [s].
    """

    text: str
    frequency: Array
    wanted: Array
    frequency_out: Array
    wanted_out: Array
    highest: float
    timestep: float


def attached(path: str | Path, parent: str, part: BeamPart) -> Attached:
    """Return a file with a beam on one of its bodies; writes nothing.

    Raises:
        ParameterError: there is no such body, or a name is taken.
        ModelError: the file cannot be read, does not compile, or is one in which the beam would
            not be itself, or the rest would not stay as it is.
    """
    source, folder = str(path), Path(path).parent
    text = read_mjcf(path)
    try:
        whole = with_includes(text, folder)
    except ModelError as error:
        raise ModelError(f"{source}: {error}") from None
    before = _compiled(_spec(whole, folder, source), source)
    place = place_for(text, parent, source, whole)
    _require_free(_spec(whole, folder, source), whole, part, source)
    part = replace(part, set_back=_own_defaults(whole))
    new = with_part(text, place, body_lines(part), class_lines(part))
    new = with_keys(new, _added(_whole(new, folder), folder, part, source), source, whole)
    after = _compiled(_spec(_whole(new, folder), folder, source), source)
    _require_rest(before, _whole(new, folder), folder, part, source)
    _require_springs(after, part, source)
    return _measured(new, after, part, source)


def compiled_file(path: Path, part: BeamPart) -> Attached:
    """Return what is measured of a file that holds a beam, read anew.

    Raises:
        ModelError: it does not compile, or its beam is another.
    """
    text = read_mjcf(path)
    model = _compiled(_spec(_whole(text, path.parent), path.parent, str(path)), str(path))
    return _measured(text, model, part, str(path))


def _whole(text: str, folder: Path) -> str:
    return with_includes(text, folder)


def _spec(whole: str, folder: Path, source: str) -> mujoco.MjSpec:
    """Return the specification of text that includes nothing; other files are the folder's."""
    with quiet_warnings(), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            spec = mujoco.MjSpec.from_string(whole)
        except (ValueError, mujoco.FatalError) as error:
            raise ModelError(f"{source}: not valid MJCF: {' '.join(str(error).split())}") from None
    spec.modelfiledir = str(folder.resolve())
    return spec


def _compiled(spec: mujoco.MjSpec, source: str) -> mujoco.MjModel:
    with quiet_warnings(), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return spec.compile()
        except (ValueError, mujoco.FatalError) as error:
            raise ModelError(
                f"{source}: does not compile: {' '.join(str(error).split())}"
            ) from None


def _require_free(spec: mujoco.MjSpec, whole: str, part: BeamPart, source: str) -> None:
    """Refuse names that the file has already, and what would replace the beam's masses."""
    taken = {kind: {each.name for each in getattr(spec, many)} for kind, many in KINDS.items()}
    taken["default class"] = {
        each.attributes.get("class", "") for each in elements(whole) if each.tag == "default"
    }
    for kind, names in part.names.items():
        for name in names:
            if name in taken[kind]:
                raise ParameterError(
                    f"{source} has a {kind} {name!r} already; give the beam another --prefix than "
                    f"{part.prefix}"
                )
    if spec.compiler.inertiafromgeom == mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE:
        raise ModelError(
            f"{source}: its compiler has inertiafromgeom=true, which would take the beam's masses "
            "from what is drawn; leave it out: auto does so for bodies without <inertial>"
        )


def _own_defaults(whole: str) -> tuple[str, ...]:
    """Return the kinds of elements that the file has defaults for, outside all named classes."""
    found = elements(whole)
    own = set()
    for element in found:
        if element.tag in SET_BACK and element.parent != ROOT:
            outer = found[element.parent]
            if outer.tag == "default" and outer.depth == 1:
                own.add(element.tag)
    return tuple(tag for tag in SET_BACK if tag in own)


def _added(whole: str, folder: Path, part: BeamPart, source: str) -> Added:
    """Return where the beam's joints come, of text whose keyframes do not know of them yet."""
    spec = _spec(whole, folder, source)
    for key in list(spec.keys):
        spec.delete(key)
    model = _compiled(spec, source)
    joints = [model.joint(name) for name in part.joints + part.joints_out]
    qpos = sorted(int(joint.qposadr[0]) for joint in joints)
    qvel = sorted(int(joint.dofadr[0]) for joint in joints)
    return Added(qpos[0], qvel[0], len(joints))


def _require_rest(
    before: mujoco.MjModel, whole: str, folder: Path, part: BeamPart, source: str
) -> None:
    """Refuse a file of which something else than the beam would compile otherwise."""
    spec = _spec(whole, folder, source)
    spec.delete(spec.body(part.root))
    rest = _compiled(spec, source)
    if _bytes(rest) != _bytes(before):
        raise ModelError(
            f"{source}: {_changed(before, rest)} would not stay as it is with a beam on this body; "
            "choose another parent"
        )


def _bytes(model: mujoco.MjModel) -> bytes:
    buffer = np.zeros(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, buffer)
    return buffer.tobytes()


def _changed(before: mujoco.MjModel, after: mujoco.MjModel) -> str:
    """Return the name of the first array in which two models differ."""
    for name in dir(before):
        one = getattr(before, name)
        if isinstance(one, np.ndarray) and not name.startswith("_"):
            other = getattr(after, name)
            if one.shape != other.shape or not np.array_equal(
                one, other, equal_nan=one.dtype.kind == "f"
            ):
                return name
    return "something"


def _require_springs(model: mujoco.MjModel, part: BeamPart, source: str) -> None:
    """Refuse a file whose options or compiler make the beam another."""
    if model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_SPRING:
        raise ModelError(f"{source}: its option's flag disables springs, which a beam bends by")
    for name in part.joints + part.joints_out:
        joint = model.joint(name)
        dof = int(joint.dofadr[0])
        loose = not joint.limited[0] and model.dof_armature[dof] == 0
        if not loose or model.dof_frictionloss[dof] or model.qpos_spring[joint.qposadr[0]]:
            raise ModelError(f"{source}: its defaults reach joint {name!r}; give them a class")


def _measured(text: str, model: mujoco.MjModel, part: BeamPart, source: str) -> Attached:
    """Return a file with what its beam's frequencies are, all else locked."""
    beam = part.chain.beam
    found, wanted = [], []
    for joints, out in ((part.joints, False), (part.joints_out, True)):
        found.append(_frequencies(model, joints))
        wanted.append(beam.frequencies(FITTED_MODES, out) if joints else np.empty(0))
        error = found[-1][:FITTED_MODES] / wanted[-1] - 1
        if joints and not np.abs(error).max() <= FREQUENCY_MOST:
            raise ModelError(
                f"{source}: compiled, a frequency of the beam is off by {np.abs(error).max():.2g} "
                "of itself; something in the file's compiler (settotalmass, boundmass, "
                "boundinertia, balanceinertia) or defaults changes it: leave that out"
            )
    highest = max(float(each[-1]) for each in found if len(each))
    return Attached(
        text,
        found[0][:FITTED_MODES],
        wanted[0],
        found[1][:FITTED_MODES],
        wanted[1],
        highest,
        float(model.opt.timestep),
    )


def _frequencies(model: mujoco.MjModel, joints: list[str]) -> Array:
    """Return the frequencies of hinges, rising, when nothing else moves [rad/s]."""
    if not joints:
        return np.empty(0)
    dofs = [int(model.joint(name).dofadr[0]) for name in joints]
    stiffness = np.array([float(model.joint(name).stiffness[0]) for name in joints])
    M = mass_matrix(model, model.qpos0)[np.ix_(dofs, dofs)]
    mu, _ = natural_modes(M, np.diag(stiffness))
    return 1 / np.sqrt(mu[::-1])
