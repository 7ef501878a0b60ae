"""What any run folder has to show, recording or not: its figures, its tables, how it was made.

>>> pages(Path("runs/ladder"))               # doctest: +SKIP
"""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path

from flexsim.errors import RunError
from flexsim.files.reading import MIB, read_regular, read_text
from flexsim.recording.joined import Content
from flexsim.recording.panels import Page
from flexsim.recording.rerun_file import entity_part
from flexsim.recording.texts import escaped, table
from studies.core.folder import CONFIG
from studies.core.folders.marker import MARKER

FIGURES = "figures"
FIGURE_MOST, TABLE_MOST, TEXT_MOST = 32 * MIB, 64 * MIB, 4 * MIB
ROWS_SHOWN, COLUMNS_SHOWN = 60, 24
PNG = b"\x89PNG\r\n\x1a\n"


def is_run(folder: Path) -> bool:
    """Return whether a folder holds a run of ours, finished or not."""
    return folder.is_dir() and any((folder / name).is_file() for name in (MARKER, CONFIG))


def pages(folder: Path) -> list[Content]:
    """Return a run's figures, its tables, and its configuration, a page each.

    Raises:
        RunError: a file of it cannot be read.
    """
    found = []
    for path in sorted((folder / FIGURES).glob("*.png")):
        content = read_regular(path, FIGURE_MOST, "figure")
        if not content.startswith(PNG):
            raise RunError(f"{path}: cannot read the figure: it is no PNG file")
        title = " ".join(path.stem.replace("_", " ").split())
        page = Page(title, f"pages/{entity_part(path.stem)}", image=True)
        found.append(Content(page, content))
    tables = [f"# {escaped(path.name)}\n\n{_shown(path)}" for path in sorted(folder.glob("*.csv"))]
    if tables:
        found.append(Content(Page("tables", "pages/tables"), "\n\n".join(tables)))
    found.append(Content(Page("how it was made", "pages/config"), made(folder)))
    return found


def _shown(path: Path) -> str:
    """Return a table as the run has it for reading; without that, the first of its rows.

    Raises:
        RunError: it cannot be read.
    """
    for_reading = path.with_suffix(".md")
    if for_reading.is_file() and for_reading.stat().st_size <= TEXT_MOST:
        return read_text(for_reading, TEXT_MOST, "table")
    return csv_table(path)


def csv_table(path: Path) -> str:
    """Return the first rows and columns of a CSV file in markdown.

    Raises:
        RunError: it cannot be read.
    """
    try:
        rows = list(csv.reader(io.StringIO(read_text(path, TABLE_MOST, "table"))))
    except csv.Error as error:
        raise RunError(f"{path}: cannot read the table: {error}") from None
    if not rows:
        return "(empty)"
    width = max(len(row) for row in rows)
    shown = [
        [escaped(_short(cell)) for cell in (row + [""] * width)[: min(width, COLUMNS_SHOWN)]]
        for row in rows[: ROWS_SHOWN + 1]
    ]
    text = table(shown[0], shown[1:])
    left = []
    if len(rows) > ROWS_SHOWN + 1:
        left.append(f"the first {ROWS_SHOWN} of {len(rows) - 1} rows")
    if width > COLUMNS_SHOWN:
        left.append(f"the first {COLUMNS_SHOWN} of {width} columns")
    return f"{text}\n\n({'; '.join(left)})" if left else text


def _short(cell: str) -> str:
    """Return a cell with numbers in six digits."""
    try:
        return f"{float(cell):.6g}" if "." in cell or "e" in cell else cell
    except ValueError:
        return " ".join(cell.split())


def made(folder: Path) -> str:
    """Return how a run was made, as its configuration says it; what it lacks.

    Raises:
        RunError: the configuration cannot be read.
    """
    path = folder / CONFIG
    if not path.is_file():
        return f"# Unfinished\n\nThe run has no {CONFIG} yet."
    try:
        content = json.loads(read_text(path, TEXT_MOST, "configuration"))
        rows = [(escaped(name), escaped(value)) for name, value in flat(content)]
    except (ValueError, AttributeError) as error:
        raise RunError(f"{path}: cannot read the configuration: {error}") from None
    return f"# How it was made\n\n{table(('', ''), rows)}"


def flat(content: object, name: str = "") -> list[tuple[str, str]]:
    """Return nested values by the paths to them, in words."""
    if isinstance(content, dict) and content:
        return [
            row for key, each in content.items() for row in flat(each, f"{name}.{key}"[not name :])
        ]
    if isinstance(content, list) and any(isinstance(each, dict) for each in content):
        return [row for i, each in enumerate(content) for row in flat(each, f"{name}[{i}]")]
    if isinstance(content, list):
        return [(name, " ".join(str(each) for each in content))]
    return [(name, "none" if content is None else str(content))]
