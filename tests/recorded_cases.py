"""Made-up motions for the tests of recordings and figures: a line followed by rigid kinematics."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from flexsim.arm.beam import mode_shapes
from flexsim.arm.kinematics import joint_angles
from flexsim.arm.parameters import Parameters
from flexsim.loop.motion import Motion
from flexsim.recording.case import Case

CHAIN_MJCF = Path(__file__).parents[1] / "models" / "chain6.xml"
SAMPLES = 500
BEAM_POINTS = 21
STEP = 0.01  # [s]
DIVERGED = 180  # samples of the chain's motion that diverges
START, END = np.array([0.70, 0.20]), np.array([0.30, 0.60])  # [m]


def chain_model() -> mujoco.MjModel:
    """Return the compiled chain of six segments."""
    return mujoco.MjModel.from_xml_path(str(CHAIN_MJCF))


def made_up_motion(
    plant: str,
    hinges: int = 0,
    samples: int = SAMPLES,
    bend: float = 0.004,
    lag: float = 0.05,
    **changes: Any,
) -> Motion:
    """Return a motion that lags a line by `lag` [s] while its beam swings by `bend` [m].

    Args:
        plant: its name; with hinges, the state holds that many angles in place of 3 modes.
        hinges: of the chain. samples: K. changes: other columns, or the time of divergence.
    """
    p = Parameters()
    time = STEP * np.arange(samples)

    def along(t: np.ndarray) -> np.ndarray:
        s = np.clip(t / 4.0, 0, 1)[:, None]
        return START + (END - START) * s**3 * (10 - 15 * s + 6 * s**2)

    joint = joint_angles(p, along(time - lag))
    eta = np.column_stack([np.sin(20 * time), 0.2 * np.sin(50 * time), 0.02 * np.sin(90 * time)])
    eta = eta * bend / 2 * np.exp(-time / 3)[:, None]
    s = np.linspace(0, 1, BEAM_POINTS)
    v = eta @ mode_shapes(3, s).T
    x, angle = np.broadcast_to(p.r + p.L * s, v.shape), joint.sum(axis=1)[:, None]
    first = joint[:, :1]
    beam = np.stack(
        [
            p.L_R * np.cos(first) + x * np.cos(angle) - v * np.sin(angle),
            p.L_R * np.sin(first) + x * np.sin(angle) + v * np.cos(angle),
        ],
        axis=-1,
    )  # (K, P, 2)
    inner = np.repeat(v[:, -1:] / p.L / max(hinges, 1) * 1.6, hinges, axis=1) if hinges else eta
    position = np.column_stack([joint, inner])
    columns = {
        "time": time,
        "state": np.column_stack([position, np.gradient(position, STEP, axis=0)]),
        "torque": np.column_stack([np.sin(3 * time), 0.3 * np.cos(5 * time)]),
        "error": np.zeros((samples, 2)),
        "applied": np.column_stack([np.sin(3 * time), 0.3 * np.cos(5 * time)]),
        "measured": np.column_stack([joint, v[:, -1]]),
        "joint": joint,
        "v": v[:, -1],
        "tip": beam[:, -1],
        "modal": eta,
        "energy": 0.1 * np.sin(time) ** 2,
        "beam": beam,
        "reference_tip": along(time),
        "reference_joint": joint_angles(p, along(time)),
    }
    return Motion(plant=plant, **{**columns, **changes})


def made_up_cases() -> list[Case]:
    """Return one case in which both plants run to the end and one in which the chain diverges."""
    model = chain_model()
    hinges = model.nq - 2
    modes = made_up_motion("assumed-modes")
    chain = made_up_motion("chain", hinges, bend=0.005, lag=0.06)
    lost = made_up_motion(
        "chain", hinges, samples=DIVERGED, bend=0.05, lag=0.3, diverged=DIVERGED * STEP
    )
    both = {"assumed-modes": modes, "chain": chain}
    one = {"assumed-modes": modes, "chain": lost}
    return [
        Case("line_tuned", "line", "tuned fractional PIDs", "opposing", both, model),
        Case("line_paper", "line", "Table 2, line", "reconstructed", one, model),
    ]
