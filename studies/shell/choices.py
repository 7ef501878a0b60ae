"""What may an option's value be? Names from where they are at home, files by their endings.

>>> named("stability", "plant")[:3]
('all', 'both', 'exact')
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache

from controllers import REALISATIONS
from flexsim.linear.loop_poles import HOLDS
from flexsim.loop.hardware import HARDWARE
from flexsim.loop.settings import SETTINGS
from flexsim.loop.trajectories import SHAPES, TIME_LAWS
from flexsim.robot.plant_names import KINDS
from studies.compare.tasks import OWN as OWN_HARDWARE
from studies.compare.tasks import SETS
from studies.core.paper import PLANTS
from studies.pid_question.designs import GROUNDS
from studies.shell.parsed import Option
from studies.stability.stability import SEVERAL
from studies.tuning.distributions import DISTRIBUTIONS
from studies.tuning.found import OWN as CONTROLLERS
from studies.tuning.individuals import CONTROLLERS as KINDS_OF_CONTROLLERS
from studies.tuning.individuals import TEXTBOOK
from studies.tuning.tuning import BOTH, TUNERS

MUJOCOS = ("chain", "untuned", "rule-of-thumb", "rod")  # that the live loop steps
FOLDERS = "/"  # in place of an ending
ANY_FILE = ""
VALUES: dict[str, Iterable[str]] = {  # by the option's name; of one command by both
    "plant": KINDS,
    "plants": KINDS,
    "controller": CONTROLLERS,
    "controllers": CONTROLLERS,
    "trajectory": SHAPES,
    "setting": SETTINGS,
    "settings": SETTINGS,
    "hardware": HARDWARE,
    "realisation": REALISATIONS,
    "distribution": DISTRIBUTIONS,
    "tuner": TUNERS,
    "hold": HOLDS,
    "grounds": GROUNDS,
    "shape": SHAPES,
    "time_law": TIME_LAWS,
    "compare controllers": (*SETS, *CONTROLLERS),
    "compare hardware": (*HARDWARE, OWN_HARDWARE),
    "stability plant": (*SEVERAL, "exact", *KINDS),
    "tune controller": KINDS_OF_CONTROLLERS,
    "tune plant": (BOTH, *KINDS),
    "tune realisation": (*REALISATIONS, TEXTBOOK),
    "screening plant": (BOTH, *KINDS),
    "play plant": MUJOCOS,
    "pid-question plants": PLANTS,
}
ENDINGS = {  # of the files, by the option's name; of one command by both
    "mjcf": ".xml",
    "file": ".xml",
    "study": ".toml",
    "distribution": ".toml",
    "torque": ".csv",
    "rrd": ".rrd",
    "out": FOLDERS,
    "run": FOLDERS,
    "resume": FOLDERS,
    "controller": FOLDERS,
    "controllers": FOLDERS,
    "drive out": ".csv",
    "follow out": ".csv",
    "chain out": ".xml",
    "beam out": ".xml",
    "stations": ".csv",
    "export out": ANY_FILE,
    "view run": ".rrd",
    "view save": ".rrd",
    "play record": ".rrd",
    "play replay": ".json",
    "report out": ".html",
    "animate out": ANY_FILE,
}
NO_FILE = (("tune", "controller"), ("run", "resume"))


@cache
def named(command: str, name: str) -> tuple[str, ...]:
    """Return the names that an option's value may be; none where it is not of a list.

    Args:
        command: its name. name: of the option's field, dotted within another.
    """
    own = name.rpartition(".")[2]
    return tuple(VALUES.get(f"{command} {own}", VALUES.get(own, ())))


def offered(command: str, option: Option) -> tuple[str, ...]:
    """Return the values to offer for an option: those declared, or the names that there are."""
    if option.choices or "STR" not in option.value:
        return option.choices
    return named(command, option.name)


def ending(command: str, option: Option) -> str | None:
    """Return what the files end in that an option takes, FOLDERS of a folder; None if it has none.

    ANY_FILE is of any file.
    """
    name = option.name
    if not option.value or (command, name) in NO_FILE:
        return None
    fallback = ANY_FILE if "PATH" in option.value and "=" not in option.value else None
    return ENDINGS.get(f"{command} {name}", ENDINGS.get(name, fallback))
