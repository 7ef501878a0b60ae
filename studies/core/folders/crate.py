"""A run folder as an RO-Crate: what it is, which files it holds, what made them.

>>> write_crate(Path("runs/compare"), config)               # doctest: +SKIP

The metadata file says in JSON-LD what the folder's own `config.json` knows: question and answer,
command, versions and sources. Any archive that takes research objects reads it.

Source: RO-Crate Metadata Specification 1.1, https://w3id.org/ro/crate/1.1; the action that made the
files as in its section on provenance.
"""

from __future__ import annotations

import hashlib
import json
import mimetypes
import os
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from urllib.parse import quote

from flexsim.errors import RunError
from flexsim.files.atomic import write_text

CRATE = "ro-crate-metadata.json"
SPECIFICATION = "https://w3id.org/ro/crate/1.1"
SHA256 = {"sha256": "http://schema.org/sha256"}  # younger than the specification's own words
INPUTS = "inputs"  # a folder of what was read
LICENCE = "https://spdx.org/licenses/MIT"
CONFIG, STUDY = "config.json", "study.toml"
BLOCK = 1 << 20
FORMATS = {  # that Python's own table does not know, or not everywhere
    ".csv": "text/csv",
    ".md": "text/markdown",
    ".parquet": "application/vnd.apache.parquet",
    ".rrd": "application/x-rerun",
    ".tex": "application/x-tex",
    ".toml": "application/toml",
    ".xml": "application/xml",
}
MEANINGS = {
    CONFIG: "configuration, command, versions and machine of the run; question and answer",
    "tables.json": "the tables as they are printed",
    "results.csv": "every number in SI units, a row a case",
    "results.parquet": "every run, units in the schema's metadata",
    "run.rrd": "recording for the rerun viewer",
    STUDY: "the study with every name and default replaced by its numbers",
}


def write_crate(folder: Path, config: Mapping[str, Any]) -> None:
    """Write the metadata of a run folder whose other files all stand.

    Args:
        config: what its config.json says.

    Raises:
        RunError: a file cannot be read or written.
    """
    text = json.dumps(crate_of(folder, config), indent=1)  # ASCII: names may be no UTF-8
    write_text(folder / CRATE, text + "\n", "the crate's metadata")


def crate_of(folder: Path, config: Mapping[str, Any]) -> dict[str, Any]:
    """Return the metadata of a folder, given what its config.json says."""
    files = [_file(folder, path) for path in _files(folder)]
    parts = [{"@id": each["@id"]} for each in files]
    asked = [each for each in parts if each["@id"].partition("/")[0] in (CONFIG, STUDY, INPUTS)]
    command = " ".join(config.get("command", ["flexsim"]))
    version = config.get("machine", {}).get("version", "unknown")
    name = config.get("question") or f"A run of {command}"
    root = {
        "@id": "./",
        "@type": "Dataset",
        "name": name,
        "description": config.get("answer") or f"What {command} wrote.",
        "datePublished": published().isoformat(timespec="seconds"),
        "license": {"@id": LICENCE},
        "hasPart": parts,
        "mentions": {"@id": "#run"},
    }
    action = {
        "@id": "#run",
        "@type": "CreateAction",
        "name": command,
        "instrument": {"@id": "#flexsim"},
        "object": asked,
        "result": [each for each in parts if each not in asked],
        "endTime": root["datePublished"],
    }
    software = {
        "@id": "#flexsim",
        "@type": "SoftwareApplication",
        "name": "flexsim",
        "description": "One flexible robot arm modelled twice, under fractional-order control",
        "softwareVersion": version,
        "softwareRequirements": [
            f"{each} {number}" for each, number in config.get("versions", {}).items()
        ],
    }
    licence = {
        "@id": LICENCE,
        "@type": "CreativeWork",
        "name": "MIT License",
        "description": "that of flexsim, which wrote these files",
    }
    about = {
        "@id": CRATE,
        "@type": "CreativeWork",
        "conformsTo": {"@id": SPECIFICATION},
        "about": {"@id": "./"},
    }
    graph = [about, root, *files, action, software, licence]
    return {"@context": [f"{SPECIFICATION}/context", SHA256], "@graph": graph}


def _files(folder: Path) -> list[Path]:
    """Return the files of a run, hidden ones and the metadata itself left out."""
    found = sorted(path for path in folder.rglob("*") if path.is_file())
    inside = [path.relative_to(folder) for path in found]
    return [p for p in inside if p.name != CRATE and not any(n.startswith(".") for n in p.parts)]


def _file(folder: Path, path: Path) -> dict[str, Any]:
    """Return what the metadata say of a file."""
    digest = hashlib.sha256()
    try:
        with (folder / path).open("rb") as stream:
            while block := stream.read(BLOCK):
                digest.update(block)
            size = stream.tell()
    except OSError as error:
        raise RunError(f"{folder / path}: cannot read it: {error.strerror}") from None
    format_ = FORMATS.get(path.suffix) or mimetypes.guess_type(path.name)[0]
    return {
        "@id": quote(path.as_posix(), errors="surrogateescape"),
        "@type": "File",
        "name": os.fsencode(path.as_posix()).decode(errors="replace"),
        **({"description": MEANINGS[path.name]} if path.name in MEANINGS else {}),
        "encodingFormat": format_ or "application/octet-stream",
        "contentSize": str(size),
        "sha256": digest.hexdigest(),
    }


def published() -> datetime:
    """Return the time, or what SOURCE_DATE_EPOCH says it is, for the same bytes again.

    Raises:
        RunError: that is no time.
    """
    given = os.environ.get("SOURCE_DATE_EPOCH")
    if not given:
        return datetime.now(UTC)
    try:
        return datetime.fromtimestamp(int(given), UTC)
    except (ValueError, OverflowError, OSError):
        raise RunError(
            f"SOURCE_DATE_EPOCH is {given!r}; give whole seconds since 1970, or unset it"
        ) from None
