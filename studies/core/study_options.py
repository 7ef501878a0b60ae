"""The options that studies share: each is spelled, explained and checked once.

>>> @dataclass(frozen=True)
... class MyConfig(SeedOptions, StudyOptions):
...     out: Out = Path("runs/mine")
...     QUICK: ClassVar = {"perturbations": 2}
>>> MyConfig(quick=True).asked()      # checked, and cut down to a quick run
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self

import tyro

from flexsim.arm.beam import MODES
from flexsim.errors import ParameterError
from flexsim.loop.runs import thread_count
from studies import headings
from studies.core.options import HardwareOptions, RobotOptions

LEAST = {"perturbations": 1, "rounds": 1, "seeds": 1, "chain_generations": 1, "seed": 0}
NAMES = ("plants", "settings", "controllers", "format")  # lists that name each once

Out = Annotated[Path, tyro.conf.arg(help="Folder of the run, made anew.")]
Perturbations = Annotated[
    int, tyro.conf.arg(help="Runs behind each median, the gains' fourth digits perturbed.")
]
SettingName = Annotated[
    str,
    tyro.conf.arg(
        help="Friction, limits and motors: none; simulink, (47) on the torque minus the dead "
        "zone's edge; jump, on the whole torque beyond it; opposing, against the joints' motion; "
        "or reconstructed, a fit."
    ),
]
Controllers = Annotated[tuple[str, ...], tyro.conf.arg(aliases=["--controller"])]
Format = Literal["png", "pdf", "svg"]
FORMATS: tuple[Format, ...] = ("png", "pdf", "svg")
Population = Annotated[int, tyro.conf.arg(help="Individuals per generation.")]


@dataclass(frozen=True, kw_only=True)
class StudyOptions(HardwareOptions, RobotOptions):
    """What every study takes; each gives `out` its own default.

    `QUICK` has the most that a quick run takes of an option: of a number, or of a list's items.
    """

    PANEL: ClassVar = headings.OUTPUT
    QUICK: ClassVar[Mapping[str, int]] = {}

    out: Out
    force: bool = False
    """Replace the run that is there."""
    quick: bool = False
    """A small part only, for a first impression in seconds."""
    json: bool = False
    """Print one JSON object instead of the tables."""
    format: tuple[Format, ...] = FORMATS
    """Of the figures, each once."""

    @property
    def for_tuning(self) -> dict[str, Any]:
        """The same options of a `studies.tuning.tuning.Tuning`."""
        return super().for_tuning | self.hardware_numbers

    def asked(self) -> Self:
        """Return what is run: this, or a small part of it if `quick`.

        Raises:
            ParameterError: an option that several studies have is out of range.
        """
        check(self)
        if not self.quick:
            return self
        most = self.QUICK.items()
        return replace(self, **{name: _cut(getattr(self, name), count) for name, count in most})


def _cut(content: Any, most: int) -> Any:
    if isinstance(content, tuple):
        return content[:most]
    return most if content is None else min(content, most)


@dataclass(frozen=True, kw_only=True)
class SeedOptions:
    """What is random follows from one number."""

    PANEL: ClassVar = headings.RUNNING

    seed: int = 1
    """Seed of everything random; searches and repeats count up from it."""


@dataclass(frozen=True, kw_only=True)
class ModelOptions:
    """Sizes of the two plants."""

    PANEL: ClassVar = headings.SIZES

    modes: int = MODES
    """Assumed modes, n."""
    segments: int | None = None
    """Segments of the chain; 6 unless given."""


@dataclass(frozen=True, kw_only=True)
class ThreadOptions:
    """How many work at once."""

    PANEL: ClassVar = headings.RUNNING

    threads: int | None = None
    """Threads; all cores unless given. Results do not depend on it."""


@dataclass(frozen=True, kw_only=True)
class LoopOptions(ModelOptions, ThreadOptions, SeedOptions, StudyOptions):
    """What a study of closed loops on both plants takes."""


def check_threads(threads: int | None) -> None:
    """Refuse a number of threads that there are not, before anything is written."""
    if threads is not None and not 1 <= threads <= thread_count():
        raise ParameterError(f"threads is {threads}; give 1 to {thread_count()}")


def check_each_once(name: str, given: Sequence[str]) -> None:
    """Refuse a list that is empty or has a name twice."""
    if not given or len(set(given)) != len(given):
        many = name if name.endswith("s") else f"{name}s"
        raise ParameterError(f"{many} are {' '.join(given) or 'empty'}; name each once")


def check(config: Any) -> None:
    """Refuse what no study can run with, whichever of these options it has.

    Raises:
        ParameterError: a number out of range, a list that is empty or has a name twice.
    """
    for name, least in LEAST.items():
        count = getattr(config, name, least)
        if count is not None and count < least:
            raise ParameterError(f"{name.replace('_', ' ')} is {count}; give {least} or more")
    for name in NAMES:
        check_each_once(name, getattr(config, name, ("any",)))
    check_threads(getattr(config, "threads", None))
    if isinstance(config, HardwareOptions):
        _ = config.built  # refuses what there is not
