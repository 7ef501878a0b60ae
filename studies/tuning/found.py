"""What a run of `flexsim tune` found, to be run elsewhere: by any version, in any loop.

    >>> found = found_in(Path("runs/circle"))
    >>> (b1, a1), (b2, a2) = found.filters(found.period)

Of a run that was interrupted it is the best so far. Where a controller may be one of those that
come with flexsim, too, `controller_of` takes either:

    >>> controller_of("circle"), controller_of("runs/circle")
"""

from __future__ import annotations

import difflib
import itertools
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from controllers import TABLE_2, TUNED, TUNED_ARMS, TUNED_IDEAL, Controller, TextbookPid
from flexsim.errors import ParameterError, RunError
from flexsim.files.reading import read_text
from flexsim.loop.settings import V_GAIN
from flexsim.numerics.clocks import PERIOD
from flexsim.numerics.types import Array
from studies.core.paper import FIGURE_OF
from studies.core.text import LONGEST, plain, spelled, word
from studies.tuning.distributions import NAMES
from studies.tuning.genetic import Search
from studies.tuning.individuals import Filters, moderate
from studies.tuning.kept import (
    NO_JSON,
    RESULT,
    RESULT_MOST,
    configuration,
    generations,
    tuning_from,
)
from studies.tuning.tuning import Tuning

GAINS = tuple(NAMES.index(name) for name in NAMES if name.startswith("k"))  # k1 ... k6
MEANING = ("trajectory", "controller", "realisation", "setting", "terms", "period", "filter_time")
SAME = 1e-9  # relative: two periods that are one
TABLES = (TUNED, TUNED_IDEAL, TABLE_2, TUNED_ARMS)
OWN: Mapping[str, Controller | TextbookPid] = {
    each.name: each for table in TABLES for each in table.values()
}
ARM_PATHS = {"one-link": "turn", "two-flexible": "line"}  # of controllers for other arms
DEVISED = {  # trajectory, by name
    **{name: name for name in TUNED},
    **{each.name: shape for shape, each in TUNED_IDEAL.items()},
    **{figure: shape for shape, figure in FIGURE_OF.items()},
    **ARM_PATHS,
}


@dataclass(frozen=True, eq=False)
class FoundController:
    """The best controller of a run of `flexsim tune`.

    Attributes:
        name: the run folder's name.
        tuning: what the run was asked.
        parameters: (10,) as drawn, in Table 1's units, time in milliseconds.
    """

    name: str
    tuning: Tuning
    parameters: Array

    @property
    def period(self) -> float:
        """The control period that it was tuned with [s]."""
        return self.tuning.period

    @property
    def v_gain(self) -> float:
        """Factor of atan(v/(r+L)) in the loop that it was tuned for, -1 in the paper."""
        return self.tuning.v_gain

    @property
    def facts(self) -> dict[str, Any]:
        """What a study's run keeps of it, to be read without the folder that it is from."""
        how = {name: getattr(self.tuning, name) for name in MEANING}
        return {
            "name": spelled(self.name),
            "parameters": dict(zip(NAMES, self.parameters.tolist(), strict=True)),
            "v_gain": self.v_gain,
            **how,
        }

    def filters(self, period: float) -> Filters:
        """Return the filters ((b1, a1), (b2, a2)) in SI.

        Raises:
            ParameterError: `period` [s] is not the tuning's own; or there is no such filter.
        """
        if not abs(period - self.period) <= SAME * self.period:
            raise ParameterError(
                f"controller {self.name!r} was tuned for a control period of {self.period:g} s, "
                f"got {period:g} s; give its own"
            )
        (built,) = self.tuning.design.filters(self.parameters[None])
        if built is None:
            raise ParameterError(
                f"controller {self.name!r} has parameters that no filter can be built from: "
                f"{self.parameters.tolist()}"
            )
        return built

    def scaled(self, factors: Array) -> FoundController:
        """Return the same with gains k1 to k6 times factors (6,).

        Raises:
            ParameterError: the factors are not six finite numbers.
        """
        given = np.asarray(factors, dtype=float)
        if given.shape != (len(GAINS),) or not np.isfinite(given).all():
            raise ParameterError(
                f"factors have shape {given.shape}; give six finite ones, of k1 to k6"
            )
        parameters = self.parameters.copy()
        parameters[list(GAINS)] *= given
        return replace(self, parameters=parameters)

    def perturbed(self, factors: Array) -> Filters:
        """Return the filters with gains k1 to k6 times factors (6,); errors as `scaled`."""
        return self.scaled(factors).filters(self.period)


def _concluded(path: Path) -> Array:
    """Return the best parameters (10,) of a result.json.

    Raises:
        RunError: it is damaged, or has none.
    """
    text = read_text(path, RESULT_MOST, "result")
    try:
        best: Mapping[str, Any] | None = json.loads(text)["best_parameters"]
        found = None if best is None else [float(best[name]) for name in NAMES]
        if best is not None and len(best) != len(NAMES):
            raise ValueError
    except (*NO_JSON, OverflowError):
        raise RunError(f"{path} is damaged or not of flexsim tune") from None
    if found is None:
        raise RunError(_nothing(path.parent))
    return np.array(found)


def _nothing(folder: Path) -> str:
    return (
        f"{folder} has no controller: every individual diverged or was rejected; "
        "tune with more generations, or another distribution"
    )


def _so_far(folder: Path, tuning: Tuning) -> Array:
    """Return the best parameters (10,) of a run that was interrupted.

    Raises:
        RunError: it has no generation yet, or none of its individuals held.
    """
    done, _ = generations(folder, tuning)
    if not done:
        raise RunError(
            f"{folder} has no complete generation yet; continue it with "
            f"flexsim tune --resume {folder}"
        )
    best = Search(tuple(done), "interrupted").best_parameters
    if best is None:
        raise RunError(_nothing(folder))
    return best


def found_in(folder: Path) -> FoundController:
    """Return the best controller of a run, its best so far if it was interrupted.

    Runs of other versions are read, too, as long as this one knows their options.

    Raises:
        RunError: it is no run of flexsim tune, is damaged, or found nothing that holds.
    """
    tuning = tuning_from(folder, configuration(folder).values, MEANING)
    over = os.path.lexists(folder / RESULT)
    best = _concluded(folder / RESULT) if over else _so_far(folder, tuning)
    found = FoundController(Path(os.path.abspath(folder)).name, tuning, best)
    (built,) = tuning.design.filters(best[None])
    if built is None or not moderate(built):
        raise RunError(f"{folder} is damaged: no filter can be built from its best parameters")
    return found


AnyController: TypeAlias = Controller | TextbookPid | FoundController


def controller_of(name: str) -> AnyController:
    """Return a controller of ours or of Table 2 by its name, or that of a run by its folder.

    A name comes before a folder of that name; `./circle`, with a slash, is always the folder.

    Raises:
        ParameterError: it is neither.
        RunError: the folder has no controller, see `found_in`.
    """
    return OWN[name] if name in OWN else run_named(name)


def run_named(name: str, others: Sequence[str] = ()) -> FoundController:
    """Return the controller of a run by its folder; errors as `controller_of`.

    Args:
        name: of the folder. others: names that would have done as well, beside controllers'.
    """
    if os.path.dirname(name) or (name and os.path.isdir(name)):
        return found_in(Path(name))
    known = [*others, *OWN]
    close = difflib.get_close_matches(name.lower(), known, n=1)
    hint = f". Did you mean {close[0]}?" if close else ""
    raise ParameterError(
        f"controller {name!r} is unknown; choose of {', '.join(known)}, or give the folder of a "
        f"run of flexsim tune{hint}"
    )


def controllers_of(names: Sequence[str], others: Sequence[str] = ()) -> dict[str, AnyController]:
    """Return several controllers by what they are called; runs whose names are too alike for
    tables or files have a number, all but the first.

    Args:
        names: of controllers or folders. others: what would have done as well, for messages.

    Raises:
        ParameterError, RunError: as `controller_of`.
    """
    found: dict[str, AnyController] = {}
    taken: set[str] = set()
    for name in names:
        each = OWN[name] if name in OWN else run_named(name, others)
        if isinstance(each, FoundController):
            each = next(
                one
                for one in (_numbered(each, count) for count in itertools.count(1))
                if word(label_of(one)).lower() not in taken
            )
            taken.add(word(label_of(each)).lower())
        found[name] = each
    return found


def _numbered(controller: FoundController, count: int) -> FoundController:
    """Return a run's controller, under its plain name with a number if it is not the first."""
    if count == 1:
        return controller
    number = f" ({count})"
    return replace(controller, name=plain(controller.name, LONGEST - len(number)) + number)


def label_of(controller: AnyController) -> str:
    """Return what a controller is called in tables, figures and files: plain, runs as such."""
    run = "run " if isinstance(controller, FoundController) else ""
    return run + plain(controller.name)


def devised_for(controller: AnyController) -> str:
    """Return the name of the trajectory that a controller was tuned for."""
    if isinstance(controller, FoundController):
        return controller.tuning.trajectory
    return DEVISED[controller.name]


def period_of(controller: AnyController) -> float:
    """Return the control period that a controller is for [s]."""
    return controller.period if isinstance(controller, FoundController) else PERIOD


def v_gain_of(controller: AnyController) -> float:
    """Return what a controller's loop makes of v: -1 mirrors the tip, as in the paper."""
    return V_GAIN if isinstance(controller, Controller) else controller.v_gain
