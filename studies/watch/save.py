"""What one save of a watched file brings: its modes, and both plants' motions under trial torques.

>>> answered(Path("models/chain6.xml")).tip_rms < 1e-5
True
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from functools import cached_property
from pathlib import Path

import numpy as np

from flexsim.arm.beam import MODES
from flexsim.errors import FlexsimError, ModelError
from flexsim.loop.metrics import rms_distance
from flexsim.loop.motion import Motion
from flexsim.loop.runs import drive
from flexsim.loop.settings import setting
from flexsim.mjcf.chain_file import ChainModel
from flexsim.mjcf.differences import Difference, differences
from flexsim.mjcf.reading.names import Names
from flexsim.numerics.types import Array
from flexsim.plants.chain_as_modes import vibration
from flexsim.robot import Robot
from studies.parity.motions import AMPLITUDES, POSE, fitting_torque
from studies.parity.side_by_side import ModesResult, compared
from studies.watch.closed_loop import LoopAnswer, LoopAsked, looped

SHOWN_EVERY = 10  # samples of 1 ms: what the viewer draws


@dataclass(frozen=True, eq=False)
class Save:
    """What one save of the file brought.

    Attributes:
        robot: of the file. chain: the file. number: of this save among the good ones, from 1.
        when: it was answered. modes: as `flexsim modes` has them. shapes: (N+2, 3) of the chain's
        modes at clamp, hinges, tip [-]. motions: of both plants, open loop, by name.
        tip_rms: distance of the two tips [m]; v_max: largest tip deflection of the chain [m].
        loop: what the closed loop makes of it, if that was asked.
    """

    robot: Robot
    chain: ChainModel
    number: int
    when: datetime
    modes: ModesResult
    shapes: Array
    motions: dict[str, Motion]
    tip_rms: float
    v_max: float
    loop: LoopAnswer | None = None

    @cached_property
    def changes(self) -> list[Difference]:
        """What the file changes of the default."""
        return differences(self.robot.rod or self.chain)

    @property
    def label(self) -> str:
        """As text calls it."""
        return f"save {self.number}, {self.when:%H:%M:%S}"

    def rows(self) -> dict[str, dict[str, Array]]:
        """Return frequencies [Hz] and damping ratios, each a mapping from plant to (3,)."""
        found = {"clamped [Hz]": self.modes.clamped_hz, "joint-free [Hz]": self.modes.joint_free_hz}
        if any(np.any(ratios) for ratios in self.modes.damping_ratio.values()):
            found["damping ratio [-]"] = self.modes.damping_ratio
        return found


def answered(
    path: Path,
    beam: str = "file",
    number: int = 1,
    when: datetime = datetime.min,
    names: Names | None = None,
    asked: LoopAsked | None = None,
) -> Save:
    """Return modes and open-loop motions of both plants of a file, and of a loop if one is asked.

    Raises:
        ModelError: the file cannot be used; the message names file and element.
    """
    try:
        robot = Robot.of(path, beam, names=names)
        plants = robot.both()
        chain = plants[1].chain
        torque = fitting_torque(plants[0], AMPLITUDES["small"])
        motions = [drive(plant, setting("none"), torque, theta=POSE) for plant in plants]
        modes = compared(robot)
        shapes = vibration(chain, robot.parameters, MODES).shapes
    except FlexsimError as error:
        said = " ".join(str(error).split())
        raise ModelError(said if str(path) in said else f"{path}: {said}") from None
    except np.linalg.LinAlgError as error:
        raise ModelError(f"{path}: its modes cannot be found: {error}; check masses") from None
    return Save(
        robot=robot,
        chain=chain,
        number=number,
        when=when,
        modes=modes,
        shapes=shapes,
        motions={motion.plant: motion.thinned(SHOWN_EVERY) for motion in motions},
        tip_rms=rms_distance(motions[0].tip, motions[1].tip),
        v_max=float(np.abs(motions[1].v).max()),
        loop=None if asked is None else looped(robot, asked),
    )
