"""Everything that a tuned result depends on, checked: plain values, by which a run is continued.

>>> Tuning(trajectory="circle", plant="both", seed=2).genetic.population
50
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, fields

from flexsim.arm.beam import MODES
from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.loop.hardware import Hardware, overridden
from flexsim.loop.metrics import WEIGHTS
from flexsim.loop.settings import DEFAULT_SETTING, V_GAIN, setting
from flexsim.loop.trajectories import path_named
from flexsim.numerics.clocks import PERIOD
from flexsim.robot import plant_kind
from studies.core.paper import PLANTS
from studies.tuning.genetic import GeneticSettings, Search, run_genetic
from studies.tuning.individuals import ControllerDesign
from studies.tuning.peers import check_de, run_cma, run_de

BOTH = "both"
TUNERS: dict[str, Callable[..., Search]] = {
    "genetic": run_genetic,
    "cma": run_cma,
    "de": run_de,
}
SEED_MOST = 2**32 - 1
HOLD_MOST = 1000.0  # [s]
COUNTS = (
    "terms",
    "perturb",
    "population",
    "generations",
    "patience",
    "survivors",
    "screen",
    "seed",
    "modes",
    "segments",
)


def _several(names: str | tuple[str, ...]) -> tuple[str, ...]:
    return (names,) if isinstance(names, str) else tuple(names)


@dataclass(frozen=True)
class Tuning:
    """Everything that a tuned result depends on; plain values, as a run's config.json has them.

    Attributes:
        trajectory, setting: names. plant: 'both', or names of plants, see `flexsim.robot`; the
            worst counts, of plants and of all that is named below.
        controller, realisation, terms, period, filter_time: see `ControllerDesign`.
        distribution: 'table-1', 'log-uniform' or a TOML file, see `studies.tuning.distributions`.
        tuner: 'genetic', 'cma' or 'de'.
        weights: of x, y and v in the index (5).
        perturb: perturbed robots beside the nominal one, each plant on all of them; the worst
            counts. perturb_spread: the relative changes of EI, rho and friction are at most this.
        perturb_payload: the payload at the tip is at most this [kg].
        population, generations, patience, survivors: see `GeneticSettings`.
        screen: candidates at most per individual drawn, those kept whose linear loop does not
            grow, see `studies.tuning.screened_draws`; 0 for no screening.
        hardware: names; hardware_delay, ..., hardware_with: numbers instead of their own, see
            `studies.core.options`. All individuals have the same noise, by the seed.
        payloads: at the tip, beside the robot's own [kg].
        long_hold: length of a hold [s] that runs are repeated with, in which they may not diverge.
        residual: what the largest |v| over its second half adds to the index [m s].
        exact: whether individuals are rejected whose exact linear loop grows, with any of the
            hardware and payloads, see `flexsim.linear.exact_loop`. exact_spread, exact_payload:
            relative change of EI, both ways, and payload [kg] with each of which it may not grow
            either.
        v_gain: factor of atan(v/(r+L)) in the measured angle of joint 2: -1, mirrored, in the
            paper; 0 ignores v.
        effort: what the total variation of the commanded torques adds to the index [m2 s/(N m)].
        modes: n. segments: N of the chain, None for 6 or the file's.
        robot, modal_damping: the robot without a file, or its name, arm; see `Robot.named`. mjcf,
            beam: its file; see `Robot.of`.
        joint1, joint2, hub, tip, motor1, motor2: its own names, see `flexsim.mjcf.reading.names`.

    Raises:
        ParameterError: an unknown name, a number out of range, what does not go together.
    """

    trajectory: str = "line"
    plant: str | tuple[str, ...] = "assumed-modes"
    controller: str = "fractional"
    realisation: str = "tustin"
    setting: str = DEFAULT_SETTING
    distribution: str = "table-1"
    tuner: str = "genetic"
    terms: int = 10
    period: float = PERIOD
    filter_time: float = 0.0
    weights: tuple[float, float, float] = WEIGHTS
    perturb: int = 0
    perturb_spread: float = 0.2
    perturb_payload: float = 0.02
    population: int = 50
    generations: int = 100
    patience: int = 10
    survivors: int = 6
    screen: int = 0
    seed: int = 1
    modes: int = MODES
    segments: int | None = None
    robot: Parameters = field(default_factory=Parameters)
    modal_damping: tuple[float, ...] = ()
    arm: str = "paper"
    mjcf: str | None = None
    beam: str = "file"
    joint1: str | None = None
    joint2: str | None = None
    hub: str | None = None
    tip: str | None = None
    motor1: str | None = None
    motor2: str | None = None
    payloads: tuple[float, ...] = (0.0,)
    long_hold: float = 0.0
    residual: float = 0.0
    exact: bool = False
    exact_spread: float = 0.0
    exact_payload: float = 0.0
    effort: float = 0.0
    v_gain: float = V_GAIN
    hardware: str | tuple[str, ...] = "ideal"
    hardware_delay: int | None = None
    hardware_torque_limit: tuple[float, float] | None = None
    hardware_counts: int | None = None
    hardware_noise: float | None = None
    hardware_lag: float | None = None
    hardware_with: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in COUNTS:
            value = getattr(self, name)
            if type(value) is not int and not (name == "segments" and value is None):
                raise ParameterError(f"{name} is {value!r}; give a whole number")
        path_named(self.trajectory)
        setting(self.setting)
        for name, given in (("plant", self.plants), ("hardware", self.hardwares)):
            if not given or len(set(given)) != len(given):
                raise ParameterError(f"{name} is {' '.join(given) or 'empty'}; name each once")
        for each in self.plants:
            plant_kind(each)  # refuses what is none
        if self.tuner not in TUNERS:
            raise ParameterError(
                f"tuner {self.tuner!r} is unknown; choose one of {', '.join(TUNERS)}"
            )
        if not 0 <= self.seed <= SEED_MOST:
            raise ParameterError(f"seed is {self.seed}; give 0 to {SEED_MOST}")
        if self.perturb < 0:
            raise ParameterError(f"perturb is {self.perturb}; give 0 or more perturbed robots")
        if self.screen < 0 or self.screen == 1:
            raise ParameterError(
                f"screen is {self.screen}; give 0 for none, or 2 or more candidates"
            )
        if not 0 < self.perturb_spread < 1:
            raise ParameterError(
                f"perturb spread is {self.perturb_spread}; give more than 0 and less than 1"
            )
        if not 0 <= self.perturb_payload < math.inf:
            raise ParameterError(f"perturb payload is {self.perturb_payload} kg; give 0 or more")
        if not all(0 <= each < math.inf for each in self.weights) or not any(self.weights):
            raise ParameterError(f"weights are {self.weights}; give 0 or more, one above 0")
        if not self.payloads or len(set(self.payloads)) != len(self.payloads):
            raise ParameterError(f"payloads are {self.payloads}; give one or more, each once [kg]")
        if not all(0 <= each < math.inf for each in self.payloads):
            raise ParameterError(f"payloads are {self.payloads} kg; give 0 or more")
        if not 0 <= self.long_hold <= HOLD_MOST:
            raise ParameterError(
                f"long hold is {self.long_hold} s; give 0, for none, to {HOLD_MOST:g}"
            )
        if not 0 <= self.residual < math.inf:
            raise ParameterError(f"residual is {self.residual} m s; give 0 or more")
        if not 0 <= self.exact_spread < 1:
            raise ParameterError(
                f"exact spread is {self.exact_spread}; give 0 or more and less than 1"
            )
        if not 0 <= self.exact_payload < math.inf:
            raise ParameterError(f"exact payload is {self.exact_payload} kg; give 0 or more")
        if not 0 <= self.effort < math.inf:
            raise ParameterError(f"effort is {self.effort} m2 s/(N m); give 0 or more")
        if not math.isfinite(self.v_gain):
            raise ParameterError(
                f"v gain is {self.v_gain}; give a finite number: -1 in the paper, 0 ignores v"
            )
        _ = self.built
        _ = self.design  # refuses what it cannot be made of
        genetic = self.genetic
        if self.tuner == "de":
            check_de(genetic)

    @property
    def plants(self) -> tuple[str, ...]:
        """Names of the plants."""
        return PLANTS if self.plant == BOTH else _several(self.plant)

    @property
    def hardwares(self) -> tuple[str, ...]:
        """Names of the hardware."""
        return _several(self.hardware)

    @property
    def built(self) -> tuple[Hardware, ...]:
        """Sensors, computer and motors of each name."""
        names = [item.name for item in fields(self) if item.name.startswith("hardware_")]
        numbers = {name: getattr(self, name) for name in names}
        return tuple(overridden(each, seed=self.seed, **numbers) for each in self.hardwares)

    @property
    def design(self) -> ControllerDesign:
        """What the ten parameters mean."""
        return ControllerDesign(
            self.controller, self.realisation, self.terms, self.period, self.filter_time
        )

    @property
    def genetic(self) -> GeneticSettings:
        """Numbers of the algorithm."""
        return GeneticSettings(self.population, self.generations, self.patience, self.survivors)
