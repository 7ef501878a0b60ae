"""A tuning run on disk: written a generation at a time, and read back to be continued.

    >>> start(run, force=False, tuning=tuning, draws=draws, texts={})
    >>> append(run, generation)
    >>> record = read(run)    # after a crash; what it holds of a torn generation is left out

`config.json` has what the run depends on, `generations.csv` one line per individual with numbers
that read back bit for bit. A generation is appended by one write. An incomplete one at the end of
the file, or a torn last line, is recognised and cut off when the run is continued.
"""

from __future__ import annotations

import dataclasses
import hashlib
import importlib.metadata
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flexsim.errors import RunError
from flexsim.mjcf.reading.names import Names
from studies.core.folder import require_free, run_folder, versions, write_config
from studies.core.folders.crate import CRATE
from studies.core.folders.locking import locked
from studies.core.study_options import FORMATS, Format
from studies.tuning.distributions import Distribution
from studies.tuning.genetic import Generation
from studies.tuning.individuals import SI_NAMES
from studies.tuning.kept import (
    GENERATIONS,
    HEADER,
    RESULT,
    configuration,
    described,
    draws_from,
    generations,
    rows,
    tuning_from,
)
from studies.tuning.tuning import Tuning

CONCLUDED = (  # what a run holds when it has ended, beside its figure
    *(f"convergence.{suffix}" for suffix in ("csv", "md", "tex", "rrd")),
    *("figures/captions.md", RESULT, CRATE),
)
DECIDES = (  # sources that a result depends on
    "flexsim/**/*.py",
    "controllers/**/*.py",
    "studies/core/paper.py",
    *(
        f"studies/tuning/{name}.py"
        for name in (
            "distributions",
            "genetic",
            "individuals",
            "peers",
            "problem",
            "scenarios",
            "screened_draws",
            "tuning",
        )
    ),
)
UNITS = {
    "k1 to k6": "N m ms^nu/rad, as drawn, mutated and crossed: Table 1's, time in milliseconds",
    ", ".join(SI_NAMES): "N m s^nu/rad, as the filters have them, k / 1000^nu; k3, k6: the same",
    "index": "m2 s, (5), and the shares of effort and residual v; inf where diverged or rejected",
    "diverged_at": "s, empty where not",
    "growth": "1/s, of the exact linear loop, of those rejected for it; else 0",
}


def drawings(formats: Sequence[Format] = FORMATS) -> tuple[str, ...]:
    """Return the files of a run's figure in some formats."""
    return tuple(f"figures/convergence.{each}" for each in formats)


@dataclass(frozen=True, eq=False)
class Record:
    """What a run's folder holds.

    Attributes:
        tuning, draws: what the run depends on. generations: those that are complete.
        size: length of generations.csv up to their end [bytes].
    """

    tuning: Tuning
    draws: Distribution
    generations: list[Generation]
    size: int


def _sources() -> str:
    """Return a digest of the code that decides a result: even a reordered sum changes its bits."""
    root = Path(__file__).parents[2]
    digest = hashlib.sha256()
    for path in sorted(path for pattern in DECIDES for path in root.glob(pattern)):
        digest.update(str(path.relative_to(root)).encode() + path.read_bytes())
    return digest.hexdigest()[:16]


def _versions() -> dict[str, str]:
    return versions() | {"cma": importlib.metadata.version("cma"), "sources": _sources()}


def require_startable(out: Path, force: bool) -> None:
    """Refuse a folder that no new run may be made in.

    Raises:
        RunError: as `run_folder`; or a run to be replaced is still at work.
    """
    require_free(out, force)
    if out.is_dir():
        with locked(out):
            pass
    parent = next(each for each in out.absolute().parents if each.exists())
    if not os.access(parent, os.W_OK | os.X_OK):
        raise RunError(f"{out}: cannot write there: Permission denied")


def start(
    out: Path,
    force: bool,
    tuning: Tuning,
    draws: Distribution,
    texts: Mapping[str, str],
    simulated: Sequence[str] = (),
) -> None:
    """Make the folder of a new run, before its first generation.

    Args:
        out: where. force: replace a run that is there. tuning, draws: what it depends on.
        texts: files to keep beside, such as the MJCF, by name.
        simulated: names of the plants that are, for whoever reads the configuration.

    Raises:
        RunError: as `run_folder`; or a run to be replaced is still at work.
    """
    require_startable(out, force)
    with run_folder(out, force, (*CONCLUDED, *drawings())) as folder:
        more = {"distribution": draws.table(), "units": UNITS, "simulated": list(simulated)}
        asked = f"How good can the controllers be made: {described(tuning)}?"
        write_config(folder, tuning, versions=_versions(), question=asked, **more)
        for name, text in texts.items():
            (folder / name).write_text(text)
        (folder / GENERATIONS).write_bytes(HEADER)


def append(folder: Path, generation: Generation) -> None:
    """Add a generation by one write, so that a killed run loses this one at most.

    Raises:
        RunError: it cannot be written.
    """
    block = "".join(",".join(row) + "\n" for row in rows(generation)).encode()
    try:
        with (folder / GENERATIONS).open("ab", buffering=0) as file:
            written = file.write(block)
    except OSError as error:
        raise RunError(f"{folder / GENERATIONS}: cannot write: {error.strerror}") from None
    if written != len(block):
        raise RunError(f"{folder / GENERATIONS}: the disk is full")


def cut(folder: Path, size: int) -> None:
    """Drop what a killed run left of an incomplete generation.

    Raises:
        RunError: it cannot be written.
    """
    try:
        os.truncate(folder / GENERATIONS, size)
    except OSError as error:
        raise RunError(f"{folder / GENERATIONS}: cannot write: {error.strerror}") from None


def _configuration(folder: Path) -> tuple[Tuning, Distribution]:
    """Return what a run depends on, from its config.json."""
    content = configuration(folder)
    for package, now in _versions().items():
        before = content.versions.get(package)
        if package != "platform" and before != now:
            raise RunError(
                f"{folder} was made with {package} {before}, this is {now}: the "
                "result would not be the same; start a new run"
            )
    known = {item.name for item in dataclasses.fields(Tuning)}
    newer = {item.name for item in dataclasses.fields(Names)}  # runs without them had none
    tuning = tuning_from(folder, content.values, known - newer)
    return tuning, draws_from(folder, content.draws)


def read(folder: Path) -> Record:
    """Return what a run's folder holds, which is left as it is.

    Raises:
        RunError: it is no run, made by other versions, or damaged other than at its end.
    """
    tuning, draws = _configuration(folder)
    path = folder / GENERATIONS
    if path.is_symlink():  # what is appended would go elsewhere
        raise RunError(f"{path} is a symbolic link: the run is damaged")
    return Record(tuning, draws, *generations(folder, tuning))


def check_texts(folder: Path, texts: Mapping[str, Any]) -> None:
    """Refuse a folder whose MJCF is not what the run is continued with.

    Raises:
        RunError: a file is missing or differs.
    """
    for name, text in texts.items():
        path = folder / name
        if not path.is_file() or path.read_text() != text:
            raise RunError(f"{path} is missing or not what this version makes; start a new run")
