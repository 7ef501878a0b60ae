"""A study's folder while it runs and after: batches as files, then one table of results.

>>> with Store.begun(Path("runs/mine"), False, resolved, config) as store:
...     for first, last in store.pending():
...         store.keep(first, last, rows)
...     store.assemble()

A batch is a file written whole and named by the runs it holds and by the digest of the study that
they are of. Nothing of what is assembled depends on when, where or how often it was gone on with.
"""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import pairwise
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq

from flexsim.errors import RunError
from flexsim.files.atomic import replacing, write_bytes, write_text
from flexsim.files.reading import read_text
from flexsim.files.scratch import sweep
from studies.core.folder import CONFIG, CONFIG_MOST, describe, run_folder, versions, write_config
from studies.core.folders.locking import locked
from studies.core.folders.marker import MARKER, is_unfinished, sign
from studies.core.version import sources
from studies.run.columns import FACTORS, results_schema
from studies.spec.building import Workshop
from studies.spec.resolving import Resolved

STUDY = "study.toml"
RESULTS = "results.parquet"
RESULTS_CSV = "results.csv"
BATCHES = "batches"
TRACES = "traces"
SUMMARY = "summary.csv"
GROUP = 1 << 16  # rows of a row group
HASHED = 16  # characters of a hash in a name
Span = tuple[int, int]


def identity() -> dict[str, str]:
    """Return what bits of a result depend on: versions of Python, packages and our sources."""
    found = versions() | {"sources": sources()}
    found.pop("platform")
    return found


class Store:
    """A run's folder, which this process alone writes to."""

    def __init__(self, folder: Path, workshop: Workshop) -> None:
        self.folder = folder
        self.resolved = workshop.resolved
        self.matrix = workshop.matrix
        self.batch = workshop.study.batch
        self.schema = results_schema(workshop)
        self._batches: dict[str, Path] = {}
        self._look()

    @classmethod
    @contextmanager
    def begun(cls, out: Path, force: bool, workshop: Workshop, config: Any) -> Iterator[Store]:
        """Give the folder of a new run, marked as one that may be continued.

        Raises:
            RunError: as `run_folder`.
        """
        with run_folder(out, force, unfinished=True) as new:
            write_text(new / STUDY, workshop.resolved.text(), "the study")
            for name, text in workshop.resolved.inputs.items():
                (new / name).parent.mkdir(exist_ok=True)
                write_text(new / name, text, "the study's file")
            asked = workshop.study.title
            write_config(new, config, identity=identity(), question=asked)
            (new / BATCHES).mkdir()
        with locked(out):
            yield cls(out, workshop)

    @classmethod
    @contextmanager
    def continued(cls, out: Path, workshop: Workshop) -> Iterator[Store]:
        """Give the folder of a run that was begun with the same study by the same versions.

        Raises:
            RunError: it was not, it is at work elsewhere, or it is no such run.
        """
        with locked(out):
            before = _require_same(out, workshop.resolved)
            found = cls(out, workshop)
            if not found.finished:
                _require_alike(out, before)
                (out / BATCHES).mkdir(exist_ok=True)
                for each in (out, out / BATCHES, out / TRACES):
                    sweep(each)
                sign(out, unfinished=True)
            yield found

    @property
    def finished(self) -> bool:
        """Whether the run has ended, with all that it writes."""
        ours = (self.folder / MARKER).is_file() and not is_unfinished(self.folder)
        files = (RESULTS_CSV, SUMMARY)
        return ours and self.assembled and all((self.folder / each).is_file() for each in files)

    @property
    def assembled(self) -> bool:
        """Whether the results are there, of all runs."""
        try:
            return bool(pq.read_metadata(self.folder / RESULTS).num_rows == self.matrix.runs)
        except (OSError, pa.ArrowInvalid):
            return False

    def spans(self) -> Iterator[Span]:
        """Give the first run of every batch, and that after its last."""
        for first in range(0, self.matrix.runs, self.batch):
            yield first, min(first + self.batch, self.matrix.runs)

    def pending(self) -> Iterator[Span]:
        """Give the batches that are not there yet."""
        if not self.assembled:
            yield from (span for span in self.spans() if not self.has(*span))

    def path(self, first: int, last: int) -> Path | None:
        """Return the file of a batch, None if there is none."""
        return self._batches.get(self._name(first, last))

    def _look(self) -> None:
        """Look which batches there are, by their files' names."""
        self._batches = {}
        with suppress(FileNotFoundError):
            for path in sorted((self.folder / BATCHES).iterdir()):
                runs, _, rest = path.name.rpartition(f"-{self.resolved.digest}-")
                if runs and len(rest) == len(".arrow") + HASHED:
                    self._batches[runs] = path

    def trace_path(self, first: int, last: int) -> Path:
        """Return the file of a batch's time series."""
        return self.folder / TRACES / f"{self._name(first, last)}.parquet"

    @staticmethod
    def _name(first: int, last: int) -> str:
        return f"{first:010d}-{last - 1:010d}"

    def has(self, first: int, last: int) -> bool:
        """Return whether a batch is there as it was written, and its time series with it."""
        path = self.path(first, last)
        if path is None or path.is_symlink() or not path.is_file():
            return False
        content = path.read_bytes()
        if not path.name.endswith(f"-{_hash(content)}.arrow"):
            return False
        with pa.ipc.open_file(content) as reader:
            metadata = reader.schema.metadata
        wanted = metadata.get(b"traces")
        if wanted is None:
            return True
        recorded = self.trace_path(first, last)
        return recorded.is_file() and _hash(recorded.read_bytes()) == wanted.decode()

    def keep(self, first: int, last: int, rows: Any, traces: Any = None) -> None:
        """Write a batch, its time series first.

        Raises:
            RunError: it cannot be written.
        """
        if traces is not None:
            (self.folder / TRACES).mkdir(exist_ok=True)
            with replacing(self.trace_path(first, last), "the traces") as path:
                _write_traces(path, traces)
            about = {b"traces": _hash(self.trace_path(first, last).read_bytes()).encode()}
            rows = rows.replace_schema_metadata({**self.schema.metadata, **about})
        sink = pa.BufferOutputStream()
        with pa.ipc.new_file(sink, rows.schema) as writer:
            writer.write_table(rows)
        content = bytes(sink.getvalue())
        name = self._name(first, last)
        file = f"{name}-{self.resolved.digest}-{_hash(content)}.arrow"
        write_bytes(self.folder / BATCHES / file, content, "the batch")
        self._batches[name] = self.folder / BATCHES / file

    def tables(self) -> Iterator[Any]:
        """Give the rows of every batch, in the order of runs."""
        for span in self.spans():
            with pa.OSFile(str(self.path(*span)), "rb") as file, pa.ipc.open_file(file) as reader:
                yield reader.read_all().replace_schema_metadata(self.schema.metadata)

    def groups(self) -> Iterator[Any]:
        """Give the rows of all batches, GROUP at a time."""
        waiting: list[Any] = []
        count = 0
        for table in self.tables():
            waiting.append(table)
            count += table.num_rows
            while count >= GROUP:
                whole = pa.concat_tables(waiting)
                yield whole.slice(0, GROUP).combine_chunks()
                waiting, count = [whole.slice(GROUP)], count - GROUP
        if count:
            yield pa.concat_tables(waiting).combine_chunks()

    def assemble(self) -> None:
        """Write the results of all batches as one table, unless they are there.

        Raises:
            RunError: it cannot be written.
        """
        if not self.assembled:
            with replacing(self.folder / RESULTS, "the results") as path:
                self._write_results(path)

    def _write_results(self, path: Path) -> None:
        how = {"compression": "zstd", "use_dictionary": list(FACTORS)}
        with path.open("wb") as file, pq.ParquetWriter(file, self.schema, **how) as writer:
            for table in self.groups():
                writer.write_table(table, row_group_size=GROUP)

    def write_csv(self) -> None:
        """Write the results as CSV, too."""
        with (
            replacing(self.folder / RESULTS_CSV, "the results") as path,
            path.open("wb") as file,
            pa.csv.CSVWriter(file, self.schema) as writer,
            pq.ParquetFile(self.folder / RESULTS) as results,
        ):
            for i in range(results.num_row_groups):
                writer.write_table(results.read_row_group(i))

    def conclude(self) -> None:
        """Mark the run as ended, its batches gone: they are in the results."""
        shutil.rmtree(self.folder / BATCHES, ignore_errors=True)
        describe(self.folder)
        sign(self.folder)

    def figure(self, name: str) -> Any:
        """Return one column of the results (runs,)."""
        return pq.read_table(self.folder / RESULTS, columns=[name]).column(0).to_numpy()


def _hash(content: bytes) -> str:
    """Return a name for what a file holds."""
    return hashlib.sha256(content).hexdigest()[:HASHED]


def _write_traces(path: Path, traces: Any) -> None:
    """Write time series, a row group for each run."""
    runs = traces.column("run").to_numpy()
    starts = [0, *(int(i) + 1 for i in (runs[1:] != runs[:-1]).nonzero()[0]), len(runs)]
    how = {"compression": "zstd", "use_dictionary": ["run"]}
    with path.open("wb") as file, pq.ParquetWriter(file, traces.schema, **how) as writer:
        for start, end in pairwise(starts):
            writer.write_table(traces.slice(start, end - start), row_group_size=end - start)


def _require_same(out: Path, resolved: Resolved) -> dict[str, str]:
    """Return the versions that have begun a folder, with this study.

    Raises:
        RunError: as said.
    """
    try:
        kept = read_text(out / STUDY, CONFIG_MOST, "study")
        config = json.loads(read_text(out / CONFIG, CONFIG_MOST, "configuration"))
        before = dict(config["identity"])
    except (RunError, ValueError, KeyError, TypeError):
        raise RunError(f"{out} is no run of a study file; name another folder with --out") from None
    if kept != resolved.text():
        raise RunError(
            f"{out} holds another study: {_difference(kept, resolved.text())}; continue it with "
            f"its own file (flexsim run --out {out} --resume), or name another folder"
        )
    for name, text in resolved.inputs.items():
        if read_text(out / name, CONFIG_MOST, "study's file") != text:
            raise RunError(f"{out} holds another study: {name} is not the same")
    return before


def _require_alike(out: Path, before: dict[str, str]) -> None:
    """Refuse to go on with what other versions have begun.

    Raises:
        RunError: they have.
    """
    for package, now in identity().items():
        if before.get(package) != now:
            raise RunError(
                f"{out} was made with {package} {before.get(package)}, this is {now}: the results "
                "would not be the same; start a new run"
            )


def _difference(kept: str, now: str) -> str:
    """Return the first line in which two studies differ, in words."""
    for before, after in zip(kept.splitlines(), now.splitlines(), strict=False):
        if before != after:
            return f"{before.strip()!r} there, {after.strip()!r} here"
    return "one goes on where the other ends"
