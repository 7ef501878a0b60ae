"""Runs of `flexsim tune` in a comparison: each a group of cases of its own.

>>> given = given_runs(["runs/circle", "runs/line"])
>>> given["runs/circle"].group
'run circle'
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

from flexsim.loop.hardware import HARDWARE
from studies.core.options import HardwareNumberOptions
from studies.tuning.found import FoundController, controllers_of, label_of


@dataclass(frozen=True, eq=False)
class Given:
    """A run of flexsim tune as a group of cases, called after its folder."""

    found: FoundController
    group: str

    @property
    def hardware(self) -> tuple[str, dict[str, Any]]:
        """The last of the named hardware that it was tuned for, and numbers instead of its own."""
        tuning = self.found.tuning
        names = (item.name for item in fields(HardwareNumberOptions))
        return max(tuning.hardwares, key=list(HARDWARE).index), {
            name: getattr(tuning, name) for name in names
        }


def given_runs(names: Sequence[str], others: Sequence[str] = ()) -> dict[str, Given]:
    """Return runs by the names of their folders, of runs of one name the later numbered.

    Args:
        names: of folders. others: what would have done as well, for messages.

    Raises:
        ParameterError: there is no such folder. RunError: it has no controller.
    """
    every = controllers_of(names, others)
    return {
        name: Given(each, label_of(each))
        for name, each in every.items()
        if isinstance(each, FoundController)
    }
