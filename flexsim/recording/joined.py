"""Several recordings in one file, each below a root of its own, on one timeline.

>>> parts = [Part("one", "runs/one", path, pages), Part("two", "runs/two", other)]
>>> write_joined(Path("both.rrd"), parts)                    # doctest: +SKIP

What a recording's layout is made from lies in it, so that it can be laid out beside others.
"""

from __future__ import annotations

import hashlib
import uuid
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path

import rerun as rr
from rerun.chunk import Chunk, LazyStore, RrdReader

from flexsim.errors import RunError
from flexsim.recording.layout import Beside, layout
from flexsim.recording.panels import Page, Plan, plans_from, plans_text
from flexsim.recording.rerun_file import (
    PLANS,
    arranged_as,
    log_properties,
    log_text,
    new_stream,
    write_rrd,
)

PROPERTIES = "/__properties"


@dataclass(frozen=True, eq=False)
class Content:
    """A page and what it shows: markdown, or the bytes of a PNG file."""

    page: Page
    content: str | bytes


@dataclass(frozen=True, eq=False)
class Part:
    """One recording among several.

    Attributes:
        root: path of its entities; '' for none. title: as headings name it.
        recording: an `.rrd` of ours; None if there are only pages. contents: pages beside it.
    """

    root: str
    title: str
    recording: Path | None = None
    contents: Sequence[Content] = ()


def store_of(path: Path) -> LazyStore:
    """Return what a recording holds, its blueprint left out, not yet read.

    Raises:
        RunError: it is no recording, or has no end.
    """
    with _refused(path), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of files that are cut off, which are refused
        return RrdReader(path).store()


def chunks_of(path: Path) -> list[Chunk]:
    """Return all that a recording holds, its blueprint left out.

    Raises:
        RunError: it is no recording.
    """
    store = store_of(path)
    with _refused(path):
        return list(store.stream().to_chunks())


@contextmanager
def _refused(path: Path) -> Iterator[None]:
    """Raise what the reader raises as a RunError of one line."""
    try:
        yield
    except (OSError, RuntimeError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise RunError(f"{path}: cannot read the recording: {reason}") from None


def plans_of(path: Path, chunks: Sequence[Chunk]) -> tuple[Plan, ...]:
    """Return what a recording of ours shows.

    Raises:
        RunError: it is none, or was made by another version.
    """
    for chunk in chunks:
        if chunk.entity_path == f"{PROPERTIES}/{PLANS}":
            batch = chunk.to_record_batch()
            name = next((each for each in batch.schema.names if each.endswith("json")), None)
            if name is not None and batch.num_rows:
                with suppress(RunError):
                    return plans_from(batch.column(name)[0].as_py()[0])
    raise RunError(
        f"{path} does not say what it shows, as recordings of this version do; run its study anew, "
        "or open it alone"
    )


def _moved(chunks: Sequence[Chunk], root: str) -> Iterator[Chunk]:
    """Give chunks below a root, what rerun itself keeps left out."""
    for chunk in chunks:
        if not chunk.entity_path.startswith(PROPERTIES):
            yield chunk.with_entity_path(
                f"/{root}{chunk.entity_path}" if root else chunk.entity_path
            )


def _log_page(stream: rr.RecordingStream, path: str, content: str | bytes) -> None:
    """Record a page."""
    if isinstance(content, str):
        log_text(stream, path, content)
    else:
        image = rr.EncodedImage(contents=content, media_type="image/png")
        stream.log(path, image, static=True)


def write_joined(path: Path, parts: Sequence[Part], shown: str = "") -> None:
    """Write recordings and pages as one recording, side by side where there are several.

    Args:
        path: the `.rrd` to write. parts: at least one.
        shown: the tab on top, the first unless given.

    Raises:
        RunError: a part is no recording of ours, or the file cannot be written.
        ParameterError: there is no such tab.
    """
    found = [(part, chunks_of(part.recording) if part.recording else []) for part in parts]
    every = [
        Beside(
            part.root,
            plans_of(part.recording, chunks) if part.recording else (),
            part.title,
            [each.page for each in part.contents],
        )
        for part, chunks in found
    ]
    digest = hashlib.sha256(repr([(of.root, of.title, of.plans) for of in every]).encode())
    for _, chunks in found:
        digest.update("".join(chunk.id for chunk in chunks).encode())

    def log(stream: rr.RecordingStream) -> None:
        stream.send_recording_name(" | ".join(part.title for part in parts))
        log_properties(stream, PLANS, {"json": plans_text(_all_plans(every))})
        for part, chunks in found:
            if chunks:
                rr.send_chunks(list(_moved(chunks, part.root)), recording=stream)
            for each in part.contents:
                entity = f"{part.root}/{each.page.entity}" if part.root else each.page.entity
                _log_page(stream, entity, each.content)

    arrangement = layout(every, shown=shown)
    identity = uuid.uuid5(uuid.NAMESPACE_URL, f"flexsim:{digest.hexdigest()}")
    stream = new_stream(arranged_as(repr((every, shown))), identity)
    write_rrd(path, stream, arrangement, log)


def _all_plans(every: Sequence[Beside]) -> list[Plan]:
    """Return the plans of all recordings as of one, named by the paths of their cases."""
    return [replace(plan, name=of.path(plan.name)[1:]) for of in every for plan in of.plans]
