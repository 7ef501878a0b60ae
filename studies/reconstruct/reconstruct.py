"""What would it take for the paper's Table 2 to work? The reconstruction, varied.

    >>> result = run(ReconstructConfig(quick=True))
    >>> result.rows[0]["variant"], result.rows[0]["bounded_share"]

Table 2's controllers on Figures 3 to 6, on both plants, under the setting `reconstructed` and
under every change of it: torque limits, friction's reading, the sign of v, each fitted number,
the placement of the figures, the numerics. Figures are shares and medians over seeded changes of
the gains' fourth digits. Beside them: whether the motion is chaotic, from pairs of runs that
start a hair apart; and in which unit of time Table 2's gains fall inside Table 1's distributions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import Progress

from controllers import TABLE_2
from flexsim.errors import ParameterError
from flexsim.loop.compiled_loop import run_population, stack_filters
from flexsim.loop.metrics import envelope_half_width
from flexsim.loop.runs import evaluate, loop_of
from flexsim.loop.trajectories import reference
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant
from studies.core.carry_out import carried_out
from studies.core.figures import PAPER_ENVELOPES
from studies.core.folder import to_json, write_config, write_rows
from studies.core.options import RobotOptions
from studies.core.repeats import perturbed
from studies.reconstruct.report import (
    chaos_figure,
    chaos_table,
    envelope_figure,
    table,
    units_table,
    verdict,
)
from studies.reconstruct.variants import QUICK, Variant, variants

PERIOD = 1e-3  # [s] control period of the paper
FIGURES = {  # of the paper: trajectory, column of Table 2, entry of Table 3
    "3": ("line", "figure-3", "line"),
    "4": ("two-loop", "figure-4", "two-loop"),
    "5": ("circle", "figure-5", "circle"),
    "6": ("line", "figure-4", "transfer"),
}
SEEN_EVERY = 2  # samples; 500 Hz, envelopes of 60 Hz vibration to 2 %
QUICK_RUNS = 3
HAIRS = (1e-9, 1e-7, 1e-5)  # [rad] by which the joints of two runs differ at the start
DIRECTIONS, QUICK_DIRECTIONS = 8, 2  # random ones, for each hair
TIP_APART = 1e-3  # [m] at which two runs count as different
MOVED_FIGURE = "4"  # whose pairs are also run at every placement
SMOOTH = "dead zone off"  # variant whose torques do not jump; its pairs are run, too
TABLE_1 = {  # parameter: mean and standard deviation
    "k_1": (1e4, 2000.0), "k_2": (1.0, 0.1), "k_3": (1e-2, 0.1),
    "k_4": (1e2, 20.0), "k_5": (1.0, 0.1), "k_6": (1e-2, 0.1),
}  # fmt: skip


@dataclass(frozen=True)
class ReconstructConfig(RobotOptions):
    """Vary what the reconstruction of Table 2 assumes: bounded runs, envelopes, chaos."""

    out: Path = Path("runs/reconstruct")
    """Folder of the run, made anew."""
    force: bool = False
    """Replace the run that is there."""
    quick: bool = False
    """Four variants and three runs each only."""
    perturbations: int = 12
    """Runs behind each median, the gains' fourth digits perturbed."""
    seed: int = 1
    """Seed of the perturbations."""
    segments: int | None = None
    """Segments of the chain; 6 unless given."""
    modes: int = 3
    """Assumed modes, n."""
    threads: int | None = None
    """Threads; all cores unless given. Results do not depend on it."""
    json: bool = False
    """Print one JSON object instead of the tables."""

    @property
    def runs(self) -> int:
        """Runs behind each median."""
        return QUICK_RUNS if self.quick else self.perturbations


@dataclass(frozen=True, eq=False)
class ReconstructResult:
    """Rows per variant, figure and plant; chaos per figure and plant; units per gain.

    Attributes:
        apart: (K,) distance of the joints of two runs [rad], by figure and plant.
    """

    rows: list[dict[str, Any]]
    chaos: list[dict[str, Any]]
    units: list[dict[str, Any]]
    apart: dict[tuple[str, str], Array]


def figure_row(
    variant: Variant, figure: str, plant: Plant, config: ReconstructConfig
) -> dict[str, Any]:
    """Return the row of one variant, figure and plant over perturbed gains.

    Envelopes are of the runs that stayed bounded, None where none did; the time of divergence is
    the median of those that did not.
    """
    path, column, entry = FIGURES[figure]
    ref = reference(variant.trajectory(path), plant.parameters, PERIOD)
    controllers = perturbed(TABLE_2[column], config.runs, np.random.default_rng(config.seed))
    outcome = evaluate(
        plant,
        variant.setting,
        ref,
        [controller.filters(PERIOD) for controller in controllers],
        SEEN_EVERY,
        config.threads,
        v_gain=variant.v_gain,
    )
    bounded = np.isnan(outcome.diverged)
    widths = [
        envelope_half_width(plant.observe(states, energy=False).tip, ref.tip)
        for states in outcome.states[bounded]
    ]
    quartiles = [float(q) for q in np.percentile(widths, [25, 50, 75])] if widths else [None] * 3
    gone = outcome.diverged[~bounded]
    return {
        "group": variant.group,
        "variant": variant.name,
        "figure": figure,
        "plant": plant.name,
        "runs": len(bounded),
        "bounded_share": float(bounded.mean()),
        "envelope": quartiles[1],
        "envelope_quartile_1": quartiles[0],
        "envelope_quartile_3": quartiles[2],
        "diverged_at": float(np.median(gone)) if len(gone) else None,
        "paper_simulation": PAPER_ENVELOPES[entry][0],
    }


def start_runs(
    variant: Variant, figure: str, plant: Plant, offsets: Array
) -> tuple[list[Array], list[Array]]:
    """Return joints [rad] and tips [m], each (K, 2), of runs that start beside the reference.

    Args:
        offsets: (P, 2) of the joints at the start [rad].
    """
    path, column, _ = FIGURES[figure]
    ref = reference(variant.trajectory(path), plant.parameters, PERIOD)
    filters = stack_filters([TABLE_2[column].filters(PERIOD)])
    friction, loop = variant.setting.friction.numbers(), loop_of(plant, ref, variant.v_gain)
    joints, tips = [], []
    for offset in offsets:
        start = plant.rest_state(ref.joint[0] + offset)
        states = run_population(plant, friction, loop, filters, start, 1, 1).states[0]
        joints.append(states[:, :2])
        tips.append(plant.observe(states, energy=False).tip)
    return joints, tips


def chaos_row(
    variant: Variant, figure: str, plant: Plant, config: ReconstructConfig
) -> tuple[dict[str, Any], Array]:
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
    row = {
        "variant": variant.name,
        "figure": figure,
        "plant": plant.name,
        "amplification": float(np.median(least.max(axis=1)) / HAIRS[0]),
        "lasting": float(np.median(least[:, -1]) / HAIRS[0]),
    }
    row |= {f"apart_{hair:.0e}": float(x) for hair, x in zip(HAIRS, shares, strict=True)}
    return row | {"kind": kind}, least.max(axis=0)


def unit_rows() -> list[dict[str, Any]]:
    """Return every gain of Table 2 in seconds and in milliseconds, in deviations of Table 1."""
    rows = []
    for figure, controller in TABLE_2.items():
        for joint, gains in ((0, controller.joint1), (3, controller.joint2)):
            terms = ((1, gains.k1, gains.nu1), (2, gains.k2, gains.nu2), (3, gains.k3, 0.0))
            for number, k, nu in terms:
                if nu is None:  # the paper's dashes
                    continue
                name = f"k_{joint + number}"
                mean, deviation = TABLE_1[name]
                scaled = k * 1000.0**nu
                rows.append(
                    {
                        "figure": figure.removeprefix("figure-"),
                        "gain": name,
                        "order": nu,
                        "seconds": k,
                        "milliseconds": scaled,
                        "deviations_seconds": (k - mean) / deviation,
                        "deviations_milliseconds": (scaled - mean) / deviation,
                    }
                )
    return rows


def looked_at_closely(variant: Variant, figure: str) -> bool:
    """Return whether pairs of runs are taken: as it is, without jumps of torque, and moved."""
    if variant.group == "place":
        return figure == MOVED_FIGURE
    return variant.group == "base" or variant.name == SMOOTH


def chosen(config: ReconstructConfig) -> list[Variant]:
    """Return the variants that a configuration runs."""
    return [each for each in variants() if not config.quick or each.name in QUICK]


def run(config: ReconstructConfig, progress: Progress | None = None) -> ReconstructResult:
    """Return the reconstruction and its variants.

    Raises:
        ParameterError, ModelError: perturbations, seed, modes, segments or threads out of range.
    """
    if config.perturbations < 1:
        raise ParameterError(f"perturbations is {config.perturbations}; give 1 or more")
    if config.seed < 0:
        raise ParameterError(f"seed is {config.seed}; give 0 or more")
    result = ReconstructResult([], [], unit_rows(), {})
    todo, robot = chosen(config), config.robot_of()
    for variant in progress.track(todo, description="reconstruct") if progress else todo:
        plants = variant.plants(robot, config.modes, config.segments)
        for figure in FIGURES:
            for plant in plants:
                result.rows.append(figure_row(variant, figure, plant, config))
                if looked_at_closely(variant, figure):
                    row, kept = chaos_row(variant, figure, plant, config)
                    result.chaos.append(row)
                    result.apart.setdefault((figure, plant.name), kept)
    return result


def write(folder: Path, config: ReconstructConfig, result: ReconstructResult) -> None:
    """Write configuration, tables and figures into a folder."""
    write_config(folder, config)
    write_rows(folder / "results.csv", result.rows)
    write_rows(folder / "chaos.csv", result.chaos)
    write_rows(folder / "units.csv", result.units)
    (folder / "figures").mkdir()
    envelope_figure(result.rows, folder / "figures" / "envelopes.png")
    chaos_figure(result.apart, PERIOD, folder / "figures" / "chaos.png")


def command(config: ReconstructConfig) -> None:
    """Run the study and write its folder."""
    result = carried_out(config, run, write)
    if config.json:
        parts: dict[str, Sequence[Any]] = {"chaos": result.chaos, "units": result.units}
        print(to_json({"rows": result.rows, **parts, "run": str(config.out)}))
        return
    out = Console(highlight=False)
    out.print("Median envelope in mm, assumed modes|chain; †t: all diverge, median time in s;")
    out.print("n%: only so many runs stay bounded; off: mean factor to Table 3")
    out.print(table(result.rows))
    out.print("Pairs of runs that start a hair apart: growth of the least hair, and % of pairs")
    out.print("whose tips come to be over 1 mm apart, by hair in rad")
    out.print(chaos_table(result.chaos))
    out.print("Table 2's gains other than 0, and how many deviations from Table 1's means")
    out.print(units_table(result.units))
    out.print(verdict(result.rows, result.chaos), soft_wrap=True)
    out.print(f"{config.out}: results.csv, chaos.csv, units.csv, figures/", soft_wrap=True)
