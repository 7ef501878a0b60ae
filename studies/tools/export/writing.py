"""Which format a file has, and the file, whole or not at all.

>>> format_of(Path("circle.h"), None)
'c'
"""

from __future__ import annotations

from pathlib import Path

from flexsim.errors import ParameterError
from flexsim.files.atomic import require_replaceable, write_text
from studies.tools.export.c_header import c_header
from studies.tools.export.exported import Exported
from studies.tools.export.machine import machine_readable
from studies.tools.export.matlab import check_name, matlab
from studies.tools.export.python_control import python_control

FORMATS = {".h": "c", ".m": "matlab", ".py": "python-control", ".json": "json"}  # by suffix
WORDS = {
    "c": "C header",
    "matlab": "MATLAB function",
    "python-control": "python-control module",
    "json": "JSON",
}
WHAT = "the filters"


def format_of(path: Path, asked: str | None) -> str:
    """Return the format of a file: what was asked for, else what its suffix says.

    Raises:
        ParameterError: neither says it.
    """
    if asked is not None:
        return asked
    if path.suffix not in FORMATS:
        raise ParameterError(
            f"{path}: its suffix is that of no format; give one of {', '.join(FORMATS)}, or add "
            f"--format {'|'.join(WORDS)}"
        )
    return FORMATS[path.suffix]


def check(path: Path, asked: str | None, force: bool) -> None:
    """Refuse a file that could not be written, before anything is computed.

    Raises:
        ParameterError: as `format_of`; or MATLAB could not call the function after its file.
        RunError: it exists, and `force` is not given, or it is no file.
    """
    if format_of(path, asked) == "matlab":
        check_name(path.stem)
    require_replaceable(path, WHAT, force)


def write(path: Path, exported: Exported, asked: str | None = None, force: bool = False) -> str:
    """Write filters to a file; return what it is, in words.

    Raises:
        ParameterError, RunError: as `check`; or it cannot be written.
    """
    kind = format_of(path, asked)
    if kind == "matlab":
        text = matlab(exported, path.stem)
    else:
        makers = {"c": c_header, "python-control": python_control, "json": machine_readable}
        text = makers[kind](exported)
    write_text(path, text, WHAT, force)
    return WORDS[kind]
