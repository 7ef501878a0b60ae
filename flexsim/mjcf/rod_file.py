"""The rod as a plant's model: an MJCF file read, checked and made ready for compiled loops.

    >>> from flexsim.mjcf.rod_file import load_rod
    >>> rod = load_rod(path="models/rod.xml")

The file may be edited, as long as it stays the two-link arm of `flexsim.mjcf.rod_xml`: hinges
`joint1` and `joint2`, then two slides for every vertex of one flex, the last of which carries the
site `tip`. Its bending is MuJoCo's; what is read here is for frequencies, energy and drawing.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from flexsim.errors import ModelError
from flexsim.mjcf.chain_file import POSES, STEP_LIMITS, mass_matrix
from flexsim.mjcf.checks import require_masses, require_physical
from flexsim.mjcf.text import read_mjcf
from flexsim.numerics.mujoco_c import (
    quiet_warnings,
)
from flexsim.numerics.types import Array

SMALL = 1e-6  # [m] displacement of a vertex, at which the rod's force is still linear
PLANE_TOLERANCE = 1e-9  # [m] how far from the x-axis of the arm a vertex may lie
ARM = "write it as flexsim.mjcf.rod_xml does"


@dataclass(frozen=True, eq=False)
class RodModel:
    """A compiled MJCF file with its geometry.

    Attributes:
        model: MuJoCo's compiled model; text: the MJCF it came from; source: its name, for messages.
        L_R: distance between the joints [m]; clamp: from joint 2 to the beam's root [m].
        vertices: (N+2,) distances from joint 2, the first two on the hub, the last the tip [m].
        bending: (N,) k of the vertices from the second on, energy k |kb|^2 [N m].
    """

    model: mujoco.MjModel
    text: str
    source: str
    L_R: float
    clamp: float
    vertices: Array
    bending: Array

    @property
    def step(self) -> float:
        """The physics step, the file's `timestep` [s]."""
        return float(self.model.opt.timestep)

    @property
    def reach(self) -> float:
        """Distance from joint 2 to the tip of the straight beam [m]."""
        return float(self.vertices[-1])


def load_rod(path: str | Path | None = None, text: str | None = None) -> RodModel:
    """Return the rod of an MJCF file, or of its text, checked.

    MuJoCo's automatic reset and warm start are switched off whatever the file says: a step is to
    depend on its state alone, not on what its workspace held.

    Args:
        path: MJCF file; text: MJCF instead of a file.

    Raises:
        ModelError: the file cannot be read, does not compile, is not the two-link arm with a rod,
            or its step is beyond what its integrator can take.
    """
    source = str(path) if path is not None else "the MJCF text"
    if path is not None:
        text = read_mjcf(path)
    if text is None or not text.strip():
        raise ModelError(f"{source}: no MJCF there; name a file or pass its text")
    with quiet_warnings():
        spec, model = _compile(text, source)
        _require_rod(model, source)
        if spec.flexes[0].section != mujoco.mjtFlexSection.mjFLEXSECTION_CIRCLE:
            raise ModelError(f"{source}: give the rod a round section and its EI by young")
        require_physical(model, source)
        for flag in (mujoco.mjtDisableBit.mjDSBL_AUTORESET, mujoco.mjtDisableBit.mjDSBL_WARMSTART):
            model.opt.disableflags |= flag
        L_R, clamp, vertices = _geometry(model, source)
        spans = np.diff(vertices)
        EI = spec.flexes[0].young * math.pi * spec.flexes[0].radius ** 4 / 4
        rod = RodModel(model, text, source, L_R, clamp, vertices, EI / (spans[:-1] + spans[1:]))
        _require_stable_step(rod)
    return rod


def _compile(text: str, source: str) -> tuple[mujoco.MjSpec, mujoco.MjModel]:
    try:
        spec = mujoco.MjSpec.from_string(text)
        require_masses(spec, source)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of numbers that are checked hereafter
            return spec, spec.compile()
    except ModelError:
        raise
    except (ValueError, mujoco.FatalError) as error:
        raise ModelError(f"{source}: not valid MJCF: {' '.join(str(error).split())}") from None


def _require_rod(model: mujoco.MjModel, source: str) -> None:
    """Raise a ModelError unless the model has the elements that the plant reads."""
    names = [model.joint(i).name for i in range(min(2, model.njnt))]
    kinds = [mujoco.mjtJoint.mjJNT_HINGE] * 2 + [mujoco.mjtJoint.mjJNT_SLIDE] * (model.njnt - 2)
    motors = [model.actuator(i).name for i in range(model.nu)]
    sites = [model.site(i).name for i in range(model.nsite)]
    hub = model.jnt_bodyid[1] if model.njnt > 1 else -1
    held = model.eq_type[model.eq_active0].tolist()
    one_flex = model.nflex == 1 and model.flex_dim[0] == 1 and not model.flex_rigid[0]
    wanted = (
        ("hinges joint1, joint2 first", names == ["joint1", "joint2"]),
        ("slides only beyond them, two for a vertex", list(model.jnt_type) == kinds),
        ("the motors motor1, motor2 and no other", motors == ["motor1", "motor2"]),
        ("motors on their joints", model.actuator_trnid[:, 0].tolist() == [0, 1]),
        ("the sites hub and tip", {"hub", "tip"} <= set(sites)),
        ("one flex of dimension 1", one_flex),
        ("its edges held by an equality and no other", held == [mujoco.mjtEq.mjEQ_FLEX]),
        ("no activations", model.na == 0),
        (
            "every vertex on the hub",
            all(model.body_parentid[b] == hub for b in model.jnt_bodyid[2:]),
        ),
    )
    for what, holds in wanted:
        if not holds:
            raise ModelError(f"{source}: the arm with a rod needs {what}; {ARM}")
    moving = model.njnt // 2 - 1
    carriers = model.body_weldid[model.flex_vertbodyid].tolist()
    if carriers != [hub, hub, *model.jnt_bodyid[2::2].tolist()] or (
        model.jnt_axis[2:].tolist() != [[1, 0, 0], [0, 1, 0]] * moving
    ):
        raise ModelError(
            f"{source}: two vertices of the flex must be fixed to the hub, and each other one "
            f"slide along x, then y, in their order; {ARM}"
        )


def _geometry(model: mujoco.MjModel, source: str) -> tuple[float, float, Array]:
    """Return L_R, clamp [m] and the vertices (N+2,) from joint 2, from the file's straight pose."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_flex(model, data)
    first, second = data.xanchor[:2]
    vertices = data.flexvert_xpos - second
    tip = data.site("tip").xpos - second
    off = np.abs([*first, *second[1:], *vertices[:, 1:].ravel(), *(tip - vertices[-1])]).max()
    rising = bool((np.diff(vertices[:, 0]) > 0).all() and second[0] > 0)
    if not (off <= PLANE_TOLERANCE and rising):
        raise ModelError(
            f"{source}: at rest the arm must lie along x from the origin, the tip on the last "
            f"vertex; {ARM}"
        )
    return float(second[0]), float(vertices[:2, 0].mean()), vertices[:, 0].copy()


def rod_stiffness(model: mujoco.MjModel) -> Array:
    """Return the stiffness (nv, nv) of the straight rod, by differences of its force [N/m]."""
    data = mujoco.MjData(model)
    stiffness = np.zeros((model.nv, model.nv))
    for column in range(3, model.nv, 2):
        for sign in (1, -1):
            data.qpos[:] = 0.0
            data.qpos[column] = sign * SMALL
            mujoco.mj_forward(model, data)
            stiffness[:, column] -= sign * data.qfrc_spring / (2 * SMALL)
    return (stiffness + stiffness.T) / 2


def moving_across(model: mujoco.MjModel) -> NDArray[np.intp]:
    """Return the coordinates of joint 1, joint 2 and the vertices' motions across the rod."""
    return np.concatenate([[0, 1], np.arange(3, model.nv, 2)])


def rod_frequencies(model: mujoco.MjModel, locked: bool = True, theta2: float = 0.0) -> Array:
    """Return the frequencies, rising, of small vibrations about the straight rod [rad/s].

    Edges that keep their lengths leave each vertex of a straight rod its motion across.

    Args:
        model: a rod's. locked: whether the joints are; else theta2 is the angle of joint 2.
    """
    qpos = np.zeros(model.nq)
    qpos[1] = theta2
    moving = moving_across(model)[2 if locked else 0 :]
    take = np.ix_(moving, moving)
    squared = eigh(rod_stiffness(model)[take], mass_matrix(model, qpos)[take], eigvals_only=True)
    return np.sqrt(np.maximum(squared, 0.0))


def _require_stable_step(rod: RodModel) -> None:
    integrator = mujoco.mjtIntegrator(rod.model.opt.integrator)
    if integrator not in STEP_LIMITS:
        return
    poses = np.linspace(0.0, np.pi, POSES)
    omega = max(rod_frequencies(rod.model, False, float(pose))[-1] for pose in poses)
    longest = STEP_LIMITS[integrator] / omega
    if rod.step >= longest:
        name = integrator.name.removeprefix("mjINT_")
        raise ModelError(
            f"{rod.source}: timestep {rod.step:g} s is too long for {name} with a highest "
            f"frequency of {omega:.0f} rad/s; use less than {longest:.3g} s"
        )
