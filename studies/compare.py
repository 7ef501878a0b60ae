"""Do the paper's controllers behave the same on both models of the robot? The main study.

    >>> result = run(CompareConfig())
    >>> result.rows[0]["envelope"]   # [m]

Three trajectories and Figure 6's transfer, on both plants, for two sets of controllers: those
tuned by us, under the friction of (47) as printed; and the paper's Table 2 under the setting
`reconstructed`, a fit. The latter move in limit cycles that a change of a gain's fourth digit can
alter, so their figures are medians over small seeded perturbations of the gains, and the plants
are compared by these only.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich import box
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from controllers import TABLE_2, TUNED, Controller, Gains
from flexsim.errors import ParameterError
from flexsim.metrics import measures
from flexsim.motion import Motion
from flexsim.parameters import Parameters
from flexsim.recording import Case, write_recording
from flexsim.robots import AssumedModesPlant, ChainPlant, Plant
from flexsim.settings import setting
from flexsim.simulate import closed_loop
from flexsim.trajectories import Trajectory, reference, trajectory
from studies.figures import case_figure, paper_envelopes, summary_figure
from studies.run_folder import run_folder, to_json, versions, write_config, write_rows

Array = NDArray[np.float64]

PERIOD = 1e-3  # [s] control period of the paper
RECORDED_EVERY = 5  # samples; 200 Hz shows the third mode
PERTURBATION = 1e-4  # relative: the fourth digit of each gain
FIGURE_OF = {"line": "figure-3", "two-loop": "figure-4", "circle": "figure-5"}
CASES = (  # trajectory, controllers devised for
    ("line", "line"),
    ("two-loop", "two-loop"),
    ("circle", "circle"),
    ("line", "two-loop"),  # Figure 6
)
MEDIANS = ("envelope", "max_error", "rms_error", "max_v", "residual_v", "index")


@dataclass(frozen=True)
class CompareConfig:
    """Run the controllers on both plants: table, figures and a recording."""

    out: Path = Path("runs/compare")
    """Folder of the run, made anew."""
    force: bool = False
    """Replace the run that is there."""
    perturbations: int = 20
    """Perturbed runs behind each median of the reconstructed case."""
    seed: int = 1
    """Seed of the perturbations."""
    segments: int = 6
    """Segments of the chain."""
    modes: int = 3
    """Assumed modes, n."""
    threads: int | None = None
    """Threads; all cores unless given. Results do not depend on it."""
    json: bool = False
    """Print one JSON object instead of the table."""


@dataclass(frozen=True)
class Task:
    """One case to run: which controllers on which trajectory under which setting."""

    trajectory: Trajectory
    label: str
    controller: Controller
    setting: str
    name: str
    median: bool


@dataclass(frozen=True, eq=False)
class CompareResult:
    """Rows for the table and cases for figures and recording; MJCF texts by file name."""

    rows: list[dict[str, Any]]
    cases: list[Case]
    mjcf: dict[str, str]


def tasks() -> list[Task]:
    """Return the eight cases: the tuned set under `print`, Table 2 under `reconstructed`."""
    found = []
    for path, devised in CASES:
        suffix = path if path == devised else f"{path}_by_{devised}"
        tuned, published = TUNED[devised], TABLE_2[FIGURE_OF[devised]]
        found.append(
            Task(trajectory(path), f"tuned {devised}", tuned, "print", f"tuned_{suffix}", False)
        )
        fitted = trajectory(path, reconstructed=True)
        found.append(
            Task(fitted, f"Table 2 {devised}", published, "reconstructed", f"table2_{suffix}", True)
        )
    return sorted(found, key=lambda task: task.median)


def plants_of(setting_name: str, modes: int, segments: int) -> list[Plant]:
    """Return both plants with a setting's motors."""
    parameters = setting(setting_name).applied(Parameters())
    return [
        AssumedModesPlant(parameters, modes=modes),
        ChainPlant.designed(parameters, segments=segments),
    ]


def perturbed(controller: Controller, count: int, rng: np.random.Generator) -> list[Controller]:
    """Return copies of a controller, every gain changed by a relative PERTURBATION (1 sd)."""

    def shaken(gains: Gains) -> Gains:
        factors = 1 + PERTURBATION * rng.standard_normal(3)
        return replace(
            gains, k1=gains.k1 * factors[0], k2=gains.k2 * factors[1], k3=gains.k3 * factors[2]
        )

    return [
        replace(controller, joint1=shaken(controller.joint1), joint2=shaken(controller.joint2))
        for _ in range(count)
    ]


def run_task(task: Task, plant: Plant, config: CompareConfig) -> tuple[dict[str, Any], Motion]:
    """Return the row of one case on one plant, and the unperturbed motion, thinned."""
    ref = reference(task.trajectory, Parameters(), PERIOD)
    chosen = setting(task.setting)
    nominal = [task.controller.filters(PERIOD)]
    motion = closed_loop(plant, chosen, ref, nominal, RECORDED_EVERY, threads=config.threads)[0]
    controllers = [task.controller]
    if task.median:
        rng = np.random.default_rng(config.seed)
        controllers = perturbed(task.controller, config.perturbations, rng)
    filters = [controller.filters(PERIOD) for controller in controllers]
    motions = closed_loop(plant, chosen, ref, filters, energy=False, threads=config.threads)
    figures = [measures(each, ref, task.trajectory.hold) for each in motions]
    row = {
        "controllers": task.label,
        "trajectory": task.trajectory.name,
        "plant": plant.name,
        "setting": task.setting,
        **summary(figures),
    }
    simulation, laboratory = paper_envelopes(task.trajectory.name, task.label) or (None, None)
    row |= {"paper_simulation": simulation, "paper_laboratory": laboratory}
    return row, motion


def summary(figures: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the medians of runs' figures of merit, the envelope's quartiles and divergences.

    A case counts as diverged when any of its runs did; its medians are of those that did not,
    None where there are none.
    """
    kept = [each for each in figures if not each["diverged"]]
    medians: dict[str, Any] = {}
    for name in MEDIANS:
        values = [each[name] for each in kept if each[name] is not None]
        medians[name] = float(np.median(values)) if values else None
    quartiles = np.percentile([each["envelope"] for each in kept], [25, 75]) if kept else [None] * 2
    times = [each["diverged_at"] for each in figures if each["diverged"]]
    return medians | {
        "envelope_quartile_1": None if quartiles[0] is None else float(quartiles[0]),
        "envelope_quartile_3": None if quartiles[1] is None else float(quartiles[1]),
        "runs": len(figures),
        "diverged": bool(times),
        "diverged_share": len(times) / len(figures),
        "diverged_at": float(min(times)) if times else None,
    }


def run(config: CompareConfig, progress: Progress | None = None) -> CompareResult:
    """Return every case on both plants.

    Raises:
        ParameterError: fewer than one perturbation.
    """
    if config.perturbations < 1:
        raise ParameterError(f"perturbations is {config.perturbations}; give 1 or more")
    todo = tasks()
    bar = progress.add_task("compare", total=2 * len(todo)) if progress else None
    plants = {
        name: plants_of(name, config.modes, config.segments) for name in ("print", "reconstructed")
    }
    rows: list[dict[str, Any]] = []
    cases = []
    for task in todo:
        motions = {}
        for plant in plants[task.setting]:
            row, motion = run_task(task, plant, config)
            rows.append(row)
            motions[plant.name] = motion
            if progress and bar is not None:
                progress.advance(bar)
        difference = tip_difference(*motions.values())
        rows[-1]["tip_difference"] = rows[-2]["tip_difference"] = difference
        chain = next(plant for plant in plants[task.setting] if isinstance(plant, ChainPlant))
        cases.append(
            Case(
                task.name,
                task.trajectory.name,
                task.label,
                task.setting,
                motions,
                chain.chain.model,
            )
        )
    texts = {
        f"chain_{name}.xml": plant.chain.text
        for name, pair in plants.items()
        for plant in pair
        if isinstance(plant, ChainPlant)
    }
    return CompareResult(rows, cases, texts)


def tip_difference(first: Motion, second: Motion) -> float | None:
    """Return the rms distance between two plants' tips while both ran [m], None if neither did."""
    rows = min(len(first.time), len(second.time))
    if rows == 0:
        return None
    distance = np.linalg.norm(first.tip[:rows] - second.tip[:rows], axis=1)
    return float(np.sqrt(np.mean(distance**2)))


def write(folder: Path, config: CompareConfig, result: CompareResult) -> None:
    """Write configuration, MJCF, table, figures and recording into a folder."""
    write_config(folder, config, cases=[case.name for case in result.cases])
    for name, text in result.mjcf.items():
        (folder / name).write_text(text)
    write_rows(folder / "results.csv", result.rows)
    (folder / "figures").mkdir()
    for case in result.cases:
        case_figure(case, folder / "figures" / f"{case.name}.png")
    summary_figure(result.rows, folder / "figures" / "envelopes.png")
    about = {name.replace("-", "_"): text for name, text in versions().items()}
    about |= {"seed": str(config.seed), "control_period": f"{PERIOD} s"}
    write_recording(folder / "run.rrd", result.cases, about, Parameters())


def _mm(value: float | None) -> str:
    return "-" if value is None else f"{1e3 * value:.1f}"


def table(rows: list[dict[str, Any]], title: str) -> Table:
    """Return a table in the manner of Table 3, in mm; the paper's columns beside ours."""
    grid = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1))
    grid.add_column("trajectory", no_wrap=True)
    for heading in ("envelope", "paper sim | lab", "rms error", "max |v|"):
        grid.add_column(heading, justify="right", no_wrap=True)
    for modes, chain in zip(rows[::2], rows[1::2], strict=True):
        pairs = [
            f"{_mm(modes[name])} | {_mm(chain[name])}"
            for name in ("envelope", "rms_error", "max_v")
        ]
        paper = f"{_mm(modes['paper_simulation'])} | {_mm(modes['paper_laboratory'])}"
        devised = modes["controllers"].rsplit(" ", 1)[1]
        own = modes["trajectory"] == devised
        name = modes["trajectory"] if own else f"{modes['trajectory']} by {devised}"
        grid.add_row(name, pairs[0], paper, *pairs[1:])
        for row in (modes, chain):
            if row["diverged"]:
                grid.add_row(f"  {100 * row['diverged_share']:.0f} % diverged, {row['plant']}")
    return grid


TITLES = {
    "print": "Our controllers, friction as printed",
    "reconstructed": "The paper's Table 2, reconstructed setting",
}


def verdict(rows: list[dict[str, Any]]) -> str:
    """Return in words whether the controllers hold and the plants agree, for one setting's rows."""
    held = sum(not row["diverged"] for row in rows)
    ratios = [
        chain["envelope"] / modes["envelope"]
        for modes, chain in zip(rows[::2], rows[1::2], strict=True)
        if chain["envelope"] and modes["envelope"]
    ]
    spread = f"{min(ratios):.2f} to {max(ratios):.2f}" if ratios else "an unknown number of"
    return f"{held} of {len(rows)} hold; the chain's envelope is {spread} times the assumed modes'."


def command(config: CompareConfig) -> None:
    """Run the study and write its folder."""
    console = Console(stderr=True)
    with run_folder(config.out, config.force) as folder:
        with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
            result = run(config, progress)
            write(folder, config, result)
    if config.json:
        print(to_json({"rows": result.rows, "run": str(config.out)}))
        return
    out = Console(highlight=False)
    out.print("In mm: assumed modes | chain\n")
    for name, title in TITLES.items():
        mine = [row for row in result.rows if row["setting"] == name]
        out.print(table(mine, f"{title}: envelope half-width, errors, v"))
        out.print(f" {verdict(mine)}\n")
    out.print(
        "Table 2 moves in limit cycles, under a fit of what the paper leaves out: its rows are medians"
        "\nover perturbed gains, quartiles in results.csv.\n"
        f"{config.out}: results.csv, figures/, run.rrd "
        f"(flexsim view {config.out})",
        soft_wrap=True,
    )
