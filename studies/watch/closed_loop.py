"""What does the closed loop do with a file's robot? Envelopes of both plants, and poles near rest.

>>> answer = looped(Robot.of("models/chain6.xml"), asked_of("circle"))
>>> chain = answer.loops["chain"]
>>> chain.medians.envelope, chain.growth                              # [m], [1/s]

The loop is chaotic: an envelope is the median of RUNS runs whose gains differ in their fourth
digits, of the chain in closed form. The run that is drawn has the gains as they are, and MuJoCo's
own steps. Poles are those of the linear loop at the pose of the trajectory where it grows most;
the exact beam's are beside them where the beam is uniform.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from flexsim.errors import FlexsimError
from flexsim.linear.exact_loop import exact_plant
from flexsim.linear.growth import extreme_poses, loop_options
from flexsim.linear.loop_poles import LinearLoop, linear_loop
from flexsim.linear.margins import common_gains
from flexsim.loop.control.stacking import stack
from flexsim.loop.hardware import IDEAL, Hardware
from flexsim.loop.runs import closed_loop, measure
from flexsim.loop.settings import DEFAULT_SETTING, Setting, setting
from flexsim.loop.trajectories import Reference, Trajectory, reference, trajectory
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant
from flexsim.plants.chain_plant import in_closed_form
from flexsim.robot import Robot
from studies.core.evidence.repeats import Medians, medians, perturbed
from studies.core.paper import PLANT_KEYS
from studies.tuning.found import (
    AnyController,
    controller_of,
    devised_for,
    label_of,
    period_of,
    v_gain_of,
)

EXACT = "exact"
RUNS = 20  # behind each median
SHOWN_EVERY = 10  # control periods: what the viewer draws
POLES = 3  # that are named, conjugates once
SLOWEST = 1e-9  # modulus in z below which a pole is a delay


@dataclass(frozen=True)
class LoopAsked:
    """The loop that every save is tried in."""

    controller: AnyController
    path: Trajectory
    setting: Setting

    @property
    def words(self) -> str:
        """In one line."""
        hardware = self.setting.hardware
        words = "ideal hardware" if hardware.ideal else hardware.words()
        label, path = label_of(self.controller), self.path.name
        return f"{label} on the {path}, setting {self.setting.name}, {words}"


@dataclass(frozen=True, eq=False)
class PlantLoop:
    """A plant in the loop.

    Attributes:
        poles: of the linear loop (n,) [1/s, rad/s], slowest first, delays left out.
        gain_margin: factor that both joints' loop gains bear, 1 if it grows.
        medians: of the figures of merit of RUNS runs, None where nothing is run.
        time: (K,) [s], error: of the tip (K,) [m], of the run with the gains as they are.
    """

    poles: NDArray[np.complex128]
    gain_margin: float
    medians: Medians | None = None
    time: Array | None = None
    error: Array | None = None

    @property
    def growth(self) -> float:
        """Rate of what decays slowest, above 0 if it grows [1/s]."""
        return float(self.poles[0].real)

    @cached_property
    def slowest(self) -> list[dict[str, float]]:
        """The slowest poles, conjugates once: growth [1/s] and frequency [Hz]."""
        upper = self.poles[self.poles.imag >= 0][:POLES]
        return [{"growth": float(p.real), "hz": float(p.imag) / (2 * np.pi)} for p in upper]


@dataclass(frozen=True, eq=False)
class LoopAnswer:
    """What a loop makes of a save.

    Attributes:
        asked: the loop. theta2: pose of the poles [rad]. loops: by the plants' keys.
        problem: why there are none, empty if there are.
    """

    asked: LoopAsked
    theta2: float
    loops: dict[str, PlantLoop]
    problem: str = ""


def asked_of(
    controller: str,
    path: str | None = None,
    friction: str = DEFAULT_SETTING,
    hardware: Hardware = IDEAL,
) -> LoopAsked:
    """Return the loop of a controller.

    Args:
        controller: a name, or the folder of a run. path: of the tip, the controller's own if None.
        friction: name of the setting. hardware: sensors, computer, motors.

    Raises:
        ParameterError, RunError: there is none of such a name.
    """
    chosen = controller_of(controller)
    shape = path or devised_for(chosen)
    found = trajectory(shape, reconstructed=friction == "reconstructed")
    return LoopAsked(chosen, found, setting(friction, hardware))


def looped(robot: Robot, asked: LoopAsked) -> LoopAnswer:
    """Return what a loop makes of a robot; of one that it cannot be closed around, the problem."""
    try:
        plants: list[Plant] = list(robot.both(asked.setting))
        ref = reference(asked.path, plants[0].parameters, period_of(asked.controller))
        theta2, linear = _linear(robot, plants, asked, ref)
        loops = {key: _of(each) for key, each in linear.items()}
        for key, plant in zip(PLANT_KEYS, plants, strict=True):
            loops[key] = _run(plant, asked, ref, loops[key])
    except FlexsimError as error:
        return LoopAnswer(asked, np.nan, {}, " ".join(str(error).split()))
    except np.linalg.LinAlgError as error:
        return LoopAnswer(asked, np.nan, {}, f"its poles cannot be found: {error}; check masses")
    return LoopAnswer(asked, theta2, loops)


def _linear(
    robot: Robot, plants: list[Plant], asked: LoopAsked, ref: Reference
) -> tuple[float, dict[str, LinearLoop]]:
    """Return the pose where the loop grows most [rad], and the linear loops there."""
    period = period_of(asked.controller)
    stacked = stack([asked.controller], period)
    friction, hardware = asked.setting.friction, asked.setting.hardware
    found: dict[float, dict[str, LinearLoop]] = {}
    for pose in extreme_poses(ref):
        found[pose] = {}
        for key, plant, hold in _held(robot, plants):
            options = loop_options(friction, period, hold, hardware=hardware)
            options = replace(options, v_gain=v_gain_of(asked.controller))
            found[pose][key] = linear_loop(plant, pose, stacked, options)
    worst = max(found, key=lambda pose: max(each.growth_rate for each in found[pose].values()))
    return worst, found[worst]


def _held(robot: Robot, plants: list[Plant]) -> list[tuple[str, Plant, str]]:
    """Return the plants of the linear loops by key, and how they go through a period."""
    both = [(key, each, "stepped") for key, each in zip(PLANT_KEYS, plants, strict=True)]
    if robot.beam == "analytic" or robot.rod is not None:
        both.append((EXACT, exact_plant(plants[0].parameters), "exact"))
    return both


def _of(loop: LinearLoop) -> PlantLoop:
    """Return what a linear loop says."""
    poles = loop.poles[np.abs(loop.poles) > SLOWEST]
    rates = np.asarray(np.log(poles) / loop.sampled.period, dtype=np.complex128)
    margin = 1.0 if rates[0].real > 0 else common_gains(loop)[1]
    return PlantLoop(rates, margin)


def _run(plant: Plant, asked: LoopAsked, ref: Reference, of: PlantLoop) -> PlantLoop:
    """Return the same with what runs of the simulated loop show."""
    controller, v_gain = asked.controller, v_gain_of(asked.controller)
    period = period_of(controller)
    rng = np.random.default_rng(asked.setting.hardware.seed)
    others = [each.filters(period) for each in perturbed(controller, RUNS, rng)]
    quick, _ = in_closed_form(plant)
    figures = measure(quick, asked.setting, ref, others, v_gain=v_gain)
    own = [controller.filters(period)]
    (motion,) = closed_loop(plant, asked.setting, ref, own, energy=False, v_gain=v_gain)
    error = np.linalg.norm(motion.tip - motion.reference_tip, axis=1)
    return replace(
        of,
        medians=medians(figures),
        time=motion.time[::SHOWN_EVERY],
        error=error[::SHOWN_EVERY],
    )
