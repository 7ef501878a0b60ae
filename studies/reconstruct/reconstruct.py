"""What would it take for the paper's Table 2 to work? The reconstruction, varied.

    >>> result = run(ReconstructConfig(quick=True))
    >>> result.rows[0]["variant"], result.rows[0]["bounded_share"]

Table 2's controllers on Figures 3 to 6, on both plants, under the setting `reconstructed` and
under every change of it: torque limits, friction's reading, the sign of v, each fitted number,
the placement of the figures, the numerics. Figures are shares and medians over seeded changes of
the gains' fourth digits, with their 95 % intervals. Beside them: whether the motion is chaotic,
from pairs of runs that start a hair apart; and in which unit of time Table 2's gains fall inside
Table 1's distributions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from rich.progress import Progress

from controllers import TABLE_2
from flexsim.arm.parameters import Parameters, paper
from flexsim.loop.control.stacking import stack
from flexsim.loop.populations import Stage, run_population
from flexsim.loop.runs import loop_of, measure
from flexsim.loop.trajectories import reference
from flexsim.numerics.clocks import PERIOD
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant
from studies.core.carry_out import Study, counted
from studies.core.evidence.intervals import share_of
from studies.core.evidence.repeats import perturbed, summary, values_of
from studies.core.paper import PAPER_ENVELOPES
from studies.core.study_options import LoopOptions, Out, Perturbations
from studies.reconstruct import report
from studies.reconstruct.rows import ChaosRow, FigureRow, ReconstructResult, UnitRow, misfit_row
from studies.reconstruct.variants import QUICK, Variant, variants
from studies.tuning.distributions import NAMES, TABLE_1

FIGURES = {  # of the paper: trajectory, column of Table 2, entry of Table 3
    "3": ("line", "figure-3", "line"),
    "4": ("two-loop", "figure-4", "two-loop"),
    "5": ("circle", "figure-5", "circle"),
    "6": ("line", "figure-4", "transfer"),
}
HAIRS = (1e-9, 1e-7, 1e-5)  # [rad] by which the joints of two runs differ at the start
DIRECTIONS, QUICK_DIRECTIONS = 8, 2  # random ones, for each hair
TIP_APART = 1e-3  # [m] at which two runs count as different
MOVED_FIGURE = "4"  # whose pairs are also run at every placement
SMOOTH = "dead zone off"  # variant whose torques do not jump; its pairs are run, too


@dataclass(frozen=True)
class ReconstructConfig(LoopOptions):
    """Vary what the reconstruction of Table 2 assumes: bounded runs, envelopes, chaos."""

    QUICK: ClassVar = {"perturbations": 3}

    out: Out = Path("runs/reconstruct")
    robot: Parameters = field(default_factory=paper)
    """The robot, unless --mjcf gives a file; undamped, as the paper's, unless told otherwise."""
    quick: bool = False
    """Four variants and three runs each only."""
    perturbations: Perturbations = 12


def figure_row(
    variant: Variant, figure: str, plant: Plant, config: ReconstructConfig
) -> tuple[FigureRow, list[float]]:
    """Return the row of one variant, figure and plant, and the envelopes that it is of.

    Those are of controllers with perturbed gains [m], the same for all rows; inf where diverged.
    """
    shape, column, entry = FIGURES[figure]
    ref = reference(variant.trajectory(shape), plant.parameters, PERIOD)
    rng = np.random.default_rng(config.seed)
    controllers = perturbed(TABLE_2[column], config.perturbations, rng)
    found = measure(
        plant, variant.setting, ref, controllers, threads=config.threads, v_gain=variant.v_gain
    )
    lost = [each["diverged_at"] for each in found if each["diverged"]]
    widths = [each["envelope"] for each in found if not each["diverged"]]
    figures: dict[str, Any] = {
        **share_of("bounded_share", [not each["diverged"] for each in found]),
        **summary("envelope", widths),
        **median_of("diverged_at", lost),
    }
    names = (variant.group, variant.name, figure, plant.name)
    row = FigureRow(*names, len(found), **figures, paper_simulation=PAPER_ENVELOPES[entry][0])
    return row, values_of(found, "envelope")


def median_of(name: str, values: Sequence[float]) -> dict[str, Any]:
    """Return a median and its interval by name, as `summary` has them, without quartiles."""
    return {key: each for key, each in summary(name, values).items() if "quartile" not in key}


def start_runs(
    variant: Variant, figure: str, plant: Plant, offsets: Array
) -> tuple[list[Array], list[Array]]:
    """Return joints [rad] and tips [m], each (K, 2), of runs that start beside the reference.

    Args:
        offsets: (P, 2) of the joints at the start [rad].
    """
    shape, column, _ = FIGURES[figure]
    ref = reference(variant.trajectory(shape), plant.parameters, PERIOD)
    controllers = stack([TABLE_2[column]], PERIOD)
    friction, loop = variant.setting.friction.numbers(), loop_of(plant, ref, variant.v_gain)
    joints, tips = [], []
    for offset in offsets:
        start = plant.rest_state(ref.joint[0] + offset)
        stage = Stage(plant, friction, loop, start, variant.setting.hardware)
        states = run_population(stage, controllers, stride=1, threads=1).states[0]
        joints.append(states[:, :2])
        tips.append(plant.observe(states, energy=False).tip)
    return joints, tips


def chaos_row(
    variant: Variant, figure: str, plant: Plant, config: ReconstructConfig
) -> tuple[ChaosRow, Array]:
    """Return how runs a hair apart part, and the joints' largest distance (K,) [rad].

    The kind of motion: 'chaotic' where most pairs the least hair apart come to be more than
    TIP_APART apart, 'regular' where no pair does, however large the hair, else 'mixed'.
    """
    rng = np.random.default_rng(config.seed)
    count = QUICK_DIRECTIONS if config.quick else DIRECTIONS
    angle = 2 * np.pi * rng.random(count)
    directions = np.stack([np.cos(angle), np.sin(angle)], axis=-1)  # (P, 2)
    offsets = [np.zeros((1, 2)), *(hair * directions for hair in HAIRS)]
    joints, tips = start_runs(variant, figure, plant, np.concatenate(offsets))
    apart = [np.linalg.norm(each - tips[0], axis=1).max() for each in tips[1:]]
    by_hair = np.nan_to_num(np.reshape(apart, (len(HAIRS), count)), nan=np.inf)
    shares = (by_hair > TIP_APART).mean(axis=1)
    kind = "chaotic" if shares[0] > 0.5 else "mixed" if shares.any() else "regular"
    least = np.linalg.norm(np.array(joints[1 : count + 1]) - joints[0], axis=2)  # (P, K)
    row = ChaosRow(
        variant=variant.name,
        figure=figure,
        plant=plant.name,
        **median_of("amplification", _grown(least.max(axis=1))),
        **median_of("lasting", _grown(least[:, -1])),
        apart=_shares_apart(by_hair),
        kind=kind,
    )
    return row, least.max(axis=0)


def _grown(apart: Array) -> list[float]:
    """Return distances over the least hair; inf where a run diverged."""
    return (np.nan_to_num(apart, nan=np.inf) / HAIRS[0]).tolist()


def _shares_apart(by_hair: Array) -> dict[str, float]:
    """Return the shares of pairs whose tips come to be far apart, with their intervals.

    Args:
        by_hair: (hairs, pairs) largest distances of the tips [m].
    """
    shares: dict[str, float] = {}
    for hair, apart in zip(HAIRS, by_hair, strict=True):
        shares |= share_of(f"apart_{hair:.0e}", apart > TIP_APART)
    return shares


def unit_rows() -> list[UnitRow]:
    """Return every gain of Table 2 in seconds and in milliseconds, in deviations of Table 1."""
    rows = []
    table_1 = {name: draw.numbers for name, draw in zip(NAMES, TABLE_1.draws, strict=True)}
    for figure, controller in TABLE_2.items():
        for joint, gains in ((0, controller.joint1), (3, controller.joint2)):
            terms = ((1, gains.k1, gains.nu1), (2, gains.k2, gains.nu2), (3, gains.k3, 0.0))
            for number, k, nu in terms:
                if nu is None:  # the paper's dashes
                    continue
                mean, deviation = table_1[f"k{joint + number}"]
                units = (k, k * 1000.0**nu)
                apart = [(gain - mean) / deviation for gain in units]
                name = figure.removeprefix("figure-")
                rows.append(UnitRow(name, f"k_{joint + number}", nu, *units, *apart))
    return rows


def looked_at_closely(variant: Variant, figure: str) -> bool:
    """Return whether pairs of runs are taken: as it is, without jumps of torque, and moved."""
    if variant.group == "place":
        return figure == MOVED_FIGURE
    return variant.group == "base" or variant.name == SMOOTH


def chosen(config: ReconstructConfig) -> list[Variant]:
    """Return the variants that a configuration runs."""
    kept = [each for each in variants() if not config.quick or each.name in QUICK]
    return [replace(it, setting=replace(it.setting, hardware=config.built)) for it in kept]


def run(config: ReconstructConfig, progress: Progress | None = None) -> ReconstructResult:
    """Return the reconstruction and its variants.

    Raises:
        ParameterError, ModelError: perturbations, seed, modes, segments or threads out of range.
    """
    config = config.asked()
    result = ReconstructResult([], [], unit_rows(), {}, [])
    todo, robot = chosen(config), config.robot_of()
    for variant in counted(progress, "reconstruct", todo):
        plants, every = variant.plants(robot, config.modes, config.segments), []
        for figure in FIGURES:
            for plant in plants:
                every.append(figure_row(variant, figure, plant, config))
                if looked_at_closely(variant, figure):
                    row, kept = chaos_row(variant, figure, plant, config)
                    result.chaos.append(row)
                    result.apart.setdefault((figure, plant.name), kept)
        rows = [row for row, _ in every]
        result.rows.extend(rows)
        result.misfits.append(misfit_row(rows, [widths for _, widths in every], config.seed))
    return result


command = Study(
    run,
    report.tables,
    report.verdict,
    report.figures,
    question="What would it take for the controllers of the paper's Table 2 to stay bounded?",
)
