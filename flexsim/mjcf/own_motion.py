"""A file's own motion: MuJoCo's steps of it, called one by one, without a compiled loop of ours.

>>> own_motion(load_arm("models/chain6.xml"), (0.02, 0.001), (0.2, 1.0), 200)[-1]
>>> require_steady(arm)        # does it run away by itself?
"""

from __future__ import annotations

import mujoco
import numpy as np

from flexsim.errors import ModelError
from flexsim.mjcf.arm_file import ArmFile
from flexsim.numerics.mujoco_c import quiet_warnings
from flexsim.numerics.types import Array

TRIED = 50  # steps in which what is unstable runs away: constraints beyond their limits, mostly
TORQUE, POSE = (0.02, 0.001), (0.2, 1.0)  # [N m], [rad]
FAR = 1e6  # [rad, m] no arm gets there


def require_steady(arm: ArmFile) -> None:
    """Raise a ModelError for a file whose motion under small torques runs away by itself.

    Linear limits of its step know nothing of constraints: edges, limits, friction, contacts.
    """
    rows = own_motion(arm, TORQUE, POSE, TRIED)
    if not (np.abs(rows) < FAR).all():  # so that a nan is caught
        raise ModelError(
            f"{arm.source}: MuJoCo's own motion of it runs away within {TRIED} steps under "
            f"{TORQUE[0]:g} and {TORQUE[1]:g} N m; check solref and solimp of what holds it "
            "(solref 2 steps or more), or use a shorter timestep"
        )


def own_motion(
    arm: ArmFile, torque: tuple[float, float], theta: tuple[float, float], steps: int
) -> Array:
    """Return theta1, theta2 [rad], the tip's x, y and v [m] (K+1, 5) as MuJoCo moves a file.

    Args:
        arm: the file. torque: held, at the motors [N m]. theta: at rest at the start, the beam
            straight [rad]. steps: K of the file's own.
    """
    model, data = arm.model, mujoco.MjData(arm.model)
    data.qpos[:] = 0.0
    second = model.joint("joint2").id  # behind the hinges of link 1, if that bends
    data.qpos[0], data.qpos[second], data.ctrl[:] = *theta, torque
    rows = np.empty((steps + 1, 5))
    hub, tip = int(model.jnt_bodyid[second]), model.site("tip").id
    with quiet_warnings():
        for row in rows:
            mujoco.mj_kinematics(model, data)
            place = data.site_xpos[tip]
            row[:2], row[2:4] = data.qpos[[0, second]], place[:2]
            row[4] = data.xmat[hub].reshape(3, 3)[:, 1] @ (place - data.xanchor[second])
            mujoco.mj_step(model, data)
    return rows
