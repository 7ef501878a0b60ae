"""What must be the same on every machine, as JSON: designs, files, modes, rows of compare, draws.

OPENBLAS_CORETYPE=Zen python tests/kernel_values.py
"""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from flexsim import Parameters
from flexsim.arm.chain_design import design_chain
from flexsim.loop.trajectories import TRAJECTORIES
from flexsim.mjcf.chain_xml import chain_mjcf
from flexsim.mjcf.rod_xml import rod_mjcf
from flexsim.numerics.machine import blas_kernels, machine
from studies.compare.compare import CompareConfig
from studies.compare.compare import run as compare
from studies.core.folder import to_json
from studies.laboratory.alone import sizes_of
from studies.laboratory.suspects import SUSPECTS
from studies.laboratory.together import sizes_from
from studies.parity.modes import ModesConfig
from studies.parity.modes import run as modes
from studies.run.batches import carried_out, prepare
from studies.run.run import workshop_of
from studies.tuning.individuals import in_si, series_taps
from studies.tuning.problem import distribution_for, problem_of, tune
from studies.tuning.tuning import Tuning

SEGMENTS = range(3, 9)
MODELS = Path(__file__).parents[1] / "models"
STUDIES = Path(__file__).parents[1] / "studies" / "files"
SHORT = {  # where joints have stuck and slipped a few times, last bits are millimetres
    name: replace(path, duration=1.5, hold=0.2) for name, path in TRAJECTORIES.items()
}


def study_rows() -> list[dict[str, Any]]:
    """Return results of a study file: drawn numbers, a spline through points, both plants."""
    changes = ("sweep.samples=4", 'trajectories=[{file="detour.csv", time_law="spline"}]')
    shop = workshop_of(STUDIES / "monte-carlo.toml", changes)
    rows: list[dict[str, Any]] = carried_out(shop, prepare(shop, 0, shop.matrix.runs)).to_pylist()
    return rows


def searches() -> dict[str, Any]:
    """Return all individuals of short searches, by tuner, and what individuals become."""
    found = {}
    for tuner in ("genetic", "cma", "de"):
        tuning = Tuning(
            trajectory="line",
            plant="assumed-modes",
            tuner=tuner,
            distribution="wide",
            population=12,
            generations=4,
            survivors=4,
        )
        problem, draws = problem_of(tuning, 1), distribution_for(tuning)
        search = tune(problem, draws, tuning.genetic, tuning.seed, tuner)
        found[tuner] = [vars(each) for each in search.generations]
    population = draws.sample(np.random.default_rng(1), 64)
    found["si"] = in_si(population)
    found["taps"] = series_taps(population[:, 1], 1e-3, 10, "tustin")
    return found


def values() -> dict[str, Any]:
    """Return numbers and texts by name, nested."""
    robot = Parameters()
    designs = {n: design_chain(robot, n) for n in SEGMENTS}
    config = CompareConfig(
        perturbations=1,
        true_tip=True,
        line=SHORT["line"],
        two_loop=SHORT["two-loop"],
        circle=SHORT["circle"],
    )
    found = {
        "designs": {n: vars(design) for n, design in designs.items()},
        "files": {n: chain_mjcf(robot, design, 1e-4) for n, design in designs.items()},
        "rod": rod_mjcf(robot),
        "modes": {
            name: vars(modes(ModesConfig(file=MODELS / f"{name}.xml")))
            for name in ("chain4", "chain6")
        },
        "compare": [asdict(row) for row in compare(config).rows],
    }
    found["study"], found["searches"] = study_rows(), searches()
    sized = [each for each in SUSPECTS.values() if each.sized]
    unit = np.random.default_rng(1).random((64, len(sized)))
    found["laboratory"] = {each.name: sizes_of(each, 7, 2.0) for each in sized}
    found["drawn"] = sizes_from(sized, unit, 2.0)
    return json.loads(to_json(found))  # type: ignore[no-any-return]


if __name__ == "__main__":
    print(json.dumps({"kernels": blas_kernels(), "machine": machine(), "values": values()}))
