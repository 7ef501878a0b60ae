"""One quick run of each study per session."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from quick_run import QuickRun, carried_out


@pytest.fixture(scope="session")
def quick(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], QuickRun]:
    """Return a function from a command's name to its quick run, carried out once."""
    kept: dict[str, QuickRun] = {}

    def run(name: str) -> QuickRun:
        if name not in kept:
            kept[name] = carried_out(name, tmp_path_factory.mktemp(name) / "run")
        return kept[name]

    return run
