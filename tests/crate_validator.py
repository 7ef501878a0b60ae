"""Folders checked as RO-Crates by a validator of other people's, without the network.

    .venv/crates/bin/python tests/crate_validator.py FOLDER ...      # what is wrong, as JSON

In an environment of its own, `tests/crates.txt`: the validator wants an older rich than we do.
"""

from __future__ import annotations

import io
import json
import sys
from pathlib import Path
from unittest.mock import patch

import rdflib.plugins.shared.jsonld.context as jsonld
import rocrate
from requests import PreparedRequest, Response
from requests.adapters import HTTPAdapter
from rocrate_validator import services
from rocrate_validator.models import Severity, ValidationSettings

SHIPPED = Path(rocrate.__file__).parent / "data" / "ro-crate.jsonld"  # of a later specification
FETCHED = "/ro/crate/1.1/context"  # in the address of what may be asked for
YOUNGER = ("sha256",)  # words that ours uses and 1.1 has not: its schema.org is of version 10


def context() -> dict[str, object]:
    """Return what stands for the context of 1.1: what ships, without the younger words."""
    found: dict[str, object] = json.loads(SHIPPED.read_text(encoding="utf-8"))
    words = found["@context"]
    assert isinstance(words, dict)
    found["@context"] = {name: of for name, of in words.items() if name not in YOUNGER}
    return found


def _answer(adapter: HTTPAdapter, request: PreparedRequest, **_: object) -> Response:
    """Answer a request for the crates' context from the library that ships it."""
    assert FETCHED in str(request.url), f"{request.url} would be fetched"
    response = Response()
    response.status_code, response.url, response.request = 200, str(request.url), request
    response.headers["Content-Type"] = "application/ld+json"
    response.raw = io.BytesIO(json.dumps(context()).encode())
    return response


def _context(source: object, *_: object, **__: object) -> tuple[object, None]:
    """Return the context to the reader of JSON-LD, which does not ask by requests."""
    assert FETCHED in str(source), f"{source} would be fetched"
    return context(), None


def issues(folder: Path) -> list[str]:
    """Return what the validator has against a folder, nothing for a valid crate."""
    settings = ValidationSettings(
        rocrate_uri=str(folder),
        profile_identifier="ro-crate-1.1",
        requirement_severity=Severity.REQUIRED,
        no_cache=True,
    )
    with (
        patch.object(HTTPAdapter, "send", _answer),
        patch.object(jsonld, "source_to_json", _context),
    ):
        found = services.validate(settings)
    return [f"{each.check.identifier}: {each.message}" for each in found.get_issues()]


if __name__ == "__main__":
    print(json.dumps([issues(Path(name)) for name in sys.argv[1:]]))
