"""The MuJoCo chain as a plant: an MJCF file read, checked and made ready for compiled loops.

    >>> from flexsim.mjcf.chain_file import load_chain
    >>> chain = load_chain(path="models/chain6.xml")

The file may be edited, as long as it stays the two-link arm: hinges `joint1`, `joint2` and a
chain of hinges from the hub on, sites `hub` and `tip`, motors `motor1`, `motor2`, all in a plane.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from scipy.linalg import eigh

from flexsim.errors import ModelError
from flexsim.mjcf.checks import (
    require_arm,
    require_hinges,
    require_masses,
    require_physical,
    require_used_masses,
)
from flexsim.mjcf.text import read_mjcf, with_includes
from flexsim.numerics.mujoco_c import (
    quiet_warnings,
)
from flexsim.numerics.step_limits import RK4_LIMIT, fastest_decay, longest_rk4_step
from flexsim.numerics.types import Array

PLANE_TOLERANCE = 1e-9  # [m] how far from the x-axis of the arm an anchor may lie
INTEGRATOR_NAMES = {
    mujoco.mjtIntegrator.mjINT_RK4: "RK4",
    mujoco.mjtIntegrator.mjINT_EULER: "Euler",
    mujoco.mjtIntegrator.mjINT_IMPLICIT: "implicit",
    mujoco.mjtIntegrator.mjINT_IMPLICITFAST: "implicitfast",
    mujoco.mjtIntegrator.mjINT_DISCRETE: "discrete",
}
STEP_LIMITS = {  # omega step up to which an undamped oscillator stays bounded
    mujoco.mjtIntegrator.mjINT_RK4: RK4_LIMIT,
    mujoco.mjtIntegrator.mjINT_EULER: 2.0,
    mujoco.mjtIntegrator.mjINT_IMPLICIT: 2.0,
    mujoco.mjtIntegrator.mjINT_IMPLICITFAST: 2.0,
}
POSES = 5  # of joint 2, from stretched to folded


@dataclass(frozen=True, eq=False)
class ChainModel:
    """A compiled MJCF file with its geometry.

    Attributes:
        model: MuJoCo's compiled model; text: the MJCF it came from, with what that includes;
            source: its name, for messages.
        L_R: distance between the joints [m]; clamp: from joint 2 to the beam's root [m];
        root: from joint 2 to the first hinge [m]; lengths: (N,) of the segments [m].
    """

    model: mujoco.MjModel
    text: str
    source: str
    L_R: float
    clamp: float
    root: float
    lengths: Array

    @property
    def step(self) -> float:
        """The physics step, the file's `timestep` [s]."""
        return float(self.model.opt.timestep)

    @property
    def reach(self) -> float:
        """Distance from joint 2 to the tip of the straight beam [m]."""
        return self.root + float(self.lengths.sum())

    @property
    def hinges(self) -> Array:
        """Distances (N,) from the clamp to the hinges [m]."""
        starts = np.concatenate([[0.0], np.cumsum(self.lengths)[:-1]])
        return self.root - self.clamp + starts


def load_chain(path: str | Path | None = None, text: str | None = None) -> ChainModel:
    """Return the chain of an MJCF file, or of its text, checked.

    MuJoCo's automatic reset is switched off whatever the file says: whether a motion has
    diverged is for the loop to judge.

    Args:
        path: MJCF file; text: MJCF instead of a file.

    Raises:
        ModelError: the file cannot be read, does not compile, is not the two-link arm, or its
            step is beyond what its integrator can take.
    """
    source = str(path) if path is not None else "the MJCF text"
    if path is not None:
        text = read_mjcf(path)
    if text is None:
        raise ModelError("no MJCF given; name a file or pass its text")
    if not text.strip():
        raise ModelError(f"{source}: the MJCF text is empty")
    with quiet_warnings():
        model = _compile(path, text, source)
        require_arm(model, source)
        require_physical(model, source)
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
        L_R, clamp, root, lengths = _geometry(model, source)
        _require_stable_step(model, source)
        if path is not None:
            text = _self_contained(text, Path(path))
    return ChainModel(model, text, source, L_R, clamp, root, lengths)


def _self_contained(text: str, path: Path) -> str:
    """Return the MJCF of a file that compiles, such that it does without other files.

    Raises:
        ModelError: it needs some, such as meshes.
    """
    text = with_includes(text, path.parent)
    try:
        mujoco.MjSpec.from_string(text).compile()
    except (ValueError, mujoco.FatalError) as error:
        raise ModelError(
            f"{path}: needs other files, which a run could not keep; leave them out "
            f"({' '.join(str(error).split())})"
        ) from None
    return text


def _compile(path: str | Path | None, text: str, source: str) -> mujoco.MjModel:
    """Return the compiled model, read by path if given, so that an include is found beside it."""
    try:
        spec = (
            mujoco.MjSpec.from_file(str(path))
            if path is not None
            else mujoco.MjSpec.from_string(text)
        )
        require_hinges(spec, source)
        require_masses(spec, source)
        require_used_masses(spec, source)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of numbers that are checked hereafter
            return spec.compile()
    except ModelError:
        raise
    except (ValueError, mujoco.FatalError) as error:
        raise ModelError(f"{source}: not valid MJCF: {' '.join(str(error).split())}") from None


def _geometry(model: mujoco.MjModel, source: str) -> tuple[float, float, float, Array]:
    """Return L_R, clamp, root and segment lengths [m] from the straight pose of the file."""
    data = mujoco.MjData(model)
    data.qpos[:] = 0.0
    mujoco.mj_kinematics(model, data)
    names = [f"joint {model.joint(i).name!r}" for i in range(model.njnt)]
    for name, axis, turned in zip(names, data.xaxis, model.jnt_axis, strict=True):
        if not np.abs(axis - (0, 0, 1)).max() <= PLANE_TOLERANCE:  # so that a nan is caught
            found = " ".join(f"{value:g}" for value in turned)
            raise ModelError(f"{source}: {name} has the axis {found}; it must turn about z, 0 0 1")
    ends = [*names, "site 'tip'"]
    anchors = np.vstack([data.xanchor, data.site("tip").xpos])  # (N+3, 3)
    for name, (x, y, z) in zip(ends, anchors, strict=True):
        first = name == names[0]
        if not max(abs(y), abs(z), abs(x) if first else 0.0) <= PLANE_TOLERANCE:
            raise ModelError(
                f"{source}: {name} is at {x:g} {y:g} {z:g} m when all angles are zero; the arm "
                f"must {'start in the origin' if first else 'lie along the x-axis'}"
            )
    x = anchors[:, 0]
    lengths = np.diff(x)
    for i, length in enumerate(lengths):
        if length < 0 or (length == 0 and i != 1):  # the beam may begin at joint 2
            raise ModelError(
                f"{source}: {ends[i + 1]} is {length:g} m along x from {ends[i]}; it must lie "
                "beyond it"
            )
    piece = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "root")
    clamp = float(data.xpos[piece][0] - x[1]) if piece >= 0 else float(lengths[1])
    return float(lengths[0]), clamp, float(lengths[1]), lengths[2:].copy()


def mass_matrix(model: mujoco.MjModel, qpos: Array) -> Array:
    """Return the joint-space inertia (nv, nv) at a configuration (nq,) [kg m2]."""
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_forward(model, data)
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    return full


def stiffness_matrix(model: mujoco.MjModel) -> Array:
    """Return the diagonal matrix (nv, nv) of the joints' linear stiffnesses [N m/rad]."""
    return np.diag(model.jnt_stiffness)


def motor_matrix(model: mujoco.MjModel) -> Array:
    """Return S (nv, 2): the generalised forces of unit torques at the motors, their gears."""
    S = np.zeros((model.nv, 2))
    for i in range(2):
        S[i, i] = model.actuator_gear[i, 0] * model.actuator_gainprm[i, 0]
    return S


def integrator_name(model: mujoco.MjModel) -> str:
    """Return the integrator of a model as MJCF names it: RK4, Euler, implicitfast, ..."""
    return INTEGRATOR_NAMES[mujoco.mjtIntegrator(model.opt.integrator)]


def _bent_elbow(model: mujoco.MjModel, theta2: float) -> Array:
    """Return the configuration (nq,) with joint 2 at theta2 [rad] and the beam straight."""
    qpos = np.zeros(model.nq)
    qpos[1] = theta2
    return qpos


def highest_frequency(model: mujoco.MjModel) -> float:
    """Return the highest natural frequency of the free chain [rad/s], over poses of joint 2.

    It bounds the step of an explicit integrator.
    """
    K = stiffness_matrix(model)
    highest = 0.0
    for theta2 in np.linspace(0.0, np.pi, POSES):
        try:
            squared = eigh(K, mass_matrix(model, _bent_elbow(model, theta2)), eigvals_only=True)
        except np.linalg.LinAlgError:
            raise ModelError(
                "the mass matrix is singular: a joint moves nothing; give its bodies inertia"
            ) from None
        highest = max(highest, float(np.sqrt(squared.max())))
    return highest


def chain_decay(model: mujoco.MjModel) -> float:
    """Return the largest |lambda| of the damped motions of the free chain [1/s], 0 without any."""
    K, D = stiffness_matrix(model), np.diag(model.dof_damping)
    poses = np.linspace(0.0, np.pi, POSES)
    return fastest_decay((mass_matrix(model, _bent_elbow(model, pose)), D, K) for pose in poses)


def longest_step(model: mujoco.MjModel) -> float | None:
    """Return the step below which the model's integrator is stable [s], None if at any step."""
    integrator = mujoco.mjtIntegrator(model.opt.integrator)
    if integrator not in STEP_LIMITS:
        return None
    omega = highest_frequency(model)
    if integrator == mujoco.mjtIntegrator.mjINT_RK4:  # the others take the damping implicitly
        return longest_rk4_step(omega, chain_decay(model))
    return STEP_LIMITS[integrator] / omega


def _require_stable_step(model: mujoco.MjModel, source: str) -> None:
    longest, step = longest_step(model), float(model.opt.timestep)
    if longest is not None and step >= longest:
        name = mujoco.mjtIntegrator(model.opt.integrator).name.removeprefix("mjINT_")
        omega, decay = highest_frequency(model), chain_decay(model)
        damping = f" and damping at {decay:.0f} 1/s" if decay > omega else ""
        raise ModelError(
            f"{source}: timestep {step:g} s is too long for {name} with a highest frequency of "
            f"{omega:.0f} rad/s{damping}; use less than {longest:.3g} s"
        )
