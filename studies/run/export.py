"""One run's time series out of a study: CSV, Parquet or MATLAB.

>>> series = series_of(Path("runs/mine"), "17")
>>> series.table.column("x")

What a run did not keep is run again, and held against the figures that it has kept.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq
import tyro
from scipy.io import savemat

from flexsim.errors import ParameterError, RunError
from flexsim.files.atomic import replacing, require_replaceable
from studies.core.folder import to_json
from studies.core.text import spelled
from studies.run.batches import carried_out, prepared, traces
from studies.run.columns import FACTORS, TRACES
from studies.run.store import RESULTS, STUDY
from studies.run.store import TRACES as FOLDER
from studies.spec.building import Workshop
from studies.spec.reading import choice, read_study
from studies.spec.resolving import resolve

Case = Annotated[
    str, tyro.conf.arg(help="A run by its number, or by what it is of: plant=chain,repeat=0.")
]
SHOWN, KNOWN = 5, 40  # runs and values that a message names
FIELD = 63  # characters of a name in MATLAB
COUNTED = ("run", "draw", "repeat")


@dataclass(frozen=True)
class ExportConfig:
    """Write one run's time series to a file."""

    run: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN", help="Its folder.")]
    case: Case
    format: Literal["csv", "parquet", "mat"] = "csv"
    """CSV, Parquet, or a file of MATLAB's."""
    out: Path | None = None
    """File to write; RUN-case-NUMBER.FORMAT beside the run unless given."""
    force: bool = False
    """Overwrite the file that is there."""
    json: bool = False
    """Print one JSON object instead of a line."""
    code: bool = True
    """Whether a Python function of the study may be run, if the run is repeated."""


@dataclass(frozen=True, eq=False)
class Series:
    """A run's time series.

    Attributes:
        run: its number. factors: what it is of. table: time series.
        again: whether it was run again.
    """

    run: int
    factors: dict[str, Any]
    table: Any
    again: bool


def run_number(results: Any, case: str) -> int:
    """Return the number of the run that a case names.

    Args:
        results: the columns of factors, counters and varied numbers.

    Raises:
        ParameterError: it names none, or several.
    """
    count = results.num_rows
    if re.fullmatch("-?[0-9]{1,12}", case):
        if not 0 <= int(case) < count:
            raise ParameterError(f"--case {case}: there are runs 0 to {count - 1}")
        return int(case)
    fits = np.ones(count, dtype=bool)
    known_names = "|".join(re.escape(name) for name in results.schema.names)
    for part in re.split(rf",(?=\s*(?:{known_names})\s*=)", case):  # names may have commas
        name, equals, value = (each.strip() for each in part.partition("="))
        if not equals or name not in results.schema.names:
            raise ParameterError(f"--case {part!r}; {choice(name, results.schema.names)}")
        column = results.column(name).to_numpy(zero_copy_only=False)
        try:
            wanted: Any = float(value) if column.dtype.kind in "if" else value
        except ValueError:
            wanted = value
        own = column == wanted
        if not own.any():
            known = [str(each) for each in results.column(name).unique().to_pylist()]
            known = known if len(known) <= KNOWN else [*known[:KNOWN], "..."]
            raise ParameterError(f"--case {name}={value}: there is none; {choice(value, known)}")
        fits &= own
    found = np.flatnonzero(fits)
    if len(found) == 1:
        return int(found[0])
    if not len(found):
        raise ParameterError(f"--case {case}: no run is of all of that")
    differ = [
        name
        for name in results.schema.names
        if len(results.column(name).take(found).unique()) > 1 and name != "run"
    ]
    shown = ", ".join(map(str, found[:SHOWN]))
    raise ParameterError(
        f"--case {case}: {len(found)} runs ({shown}, ...), which differ in {', '.join(differ)}; "
        "say which"
    )


def series_of(folder: Path, case: str, code: bool = True) -> Series:
    """Return a run's time series.

    Raises:
        RunError: the folder is no finished run of a study file, or the run is not as it was.
        ParameterError: there is no such run.
    """
    if not (folder / RESULTS).is_file() or not (folder / STUDY).is_file():
        raise RunError(f"{folder} is no finished run of a study file")
    workshop = Workshop(resolve(read_study(folder / STUDY), code))
    names = [*COUNTED, *FACTORS, *workshop.matrix.draws.paths]
    results = pq.read_table(folder / RESULTS, columns=names)
    run = run_number(results, case)
    factors = results.slice(run, 1).to_pylist()[0]
    kept = _kept(folder, run, workshop.study.batch)
    if kept is not None:
        return Series(run, factors, kept, False)
    batch = prepared(workshop, np.array([run]))
    rows = carried_out(workshop, batch).drop_columns(["diverged_at"])
    before = pq.read_table(folder / RESULTS).slice(run, 1).select(rows.column_names)
    if not before.equals(rows):
        raise RunError(
            f"{folder}: run {run} is another when it is run again: versions, or what a function "
            "designs, are not the same"
        )
    return Series(run, factors, traces(workshop, batch, "all"), True)


def _kept(folder: Path, run: int, batch: int) -> Any:
    """Return the time series that a run has kept, None if it has not."""
    first = run // batch * batch
    for path in sorted((folder / FOLDER).glob(f"{first:010d}-*.parquet")):
        with pq.ParquetFile(path) as file:
            for i in range(file.num_row_groups):
                statistics = file.metadata.row_group(i).column(0).statistics
                if statistics.min == run:
                    return file.read_row_group(i)
    return None


def write(path: Path, series: Series, form: str, force: bool) -> None:
    """Write time series in a format.

    Raises:
        RunError: the file cannot be written.
    """
    with replacing(path, "the time series", force) as temporary:
        if form == "parquet":
            pq.write_table(series.table, temporary)
        elif form == "csv":
            pa.csv.write_csv(series.table.drop_columns(["run"]), temporary)
        else:
            columns = {name: series.table.column(name).to_numpy() for name, *_ in TRACES}
            units = {name: unit for name, unit, _ in TRACES}
            about = {re.sub(r"\W+", "_", key)[:FIELD]: x for key, x in series.factors.items()}
            content = {**columns, "units": units, "about": about}
            savemat(temporary, content, appendmat=False, long_field_names=True)


def command(config: ExportConfig) -> None:
    """Write a run's time series and say where."""
    form = config.format
    if config.out is not None:
        require_replaceable(config.out, "the time series", config.force)
    series = series_of(config.run, config.case, config.code)
    out = config.out or config.run.parent / f"{config.run.name}-case-{series.run}.{form}"
    write(out, series, form, config.force)
    about = {"out": str(out), "run": series.run, "rows": series.table.num_rows, **series.factors}
    if config.json:
        print(to_json(about))
        return
    how = "run again, as it was" if series.again else "as it was kept"
    print(f"{spelled(out)}: {series.table.num_rows} samples of run {series.run}, {how}")
