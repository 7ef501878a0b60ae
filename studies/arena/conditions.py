"""What is other than in the tuning, one thing at a time: changes of the shipped study file.

>>> document(CONDITIONS["payload"], tuned, plants=("assumed-modes:5",), repeats=3)["robots"]

Nobody is told: controllers and references are designed for the nominal robot on the bench, which
stands first among the robots. A condition is carried out as a study file of its own, so it is gone
on with, spread over workers, and repeated, as any other.
"""

from __future__ import annotations

import copy
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from flexsim.numerics.clocks import PERIOD
from flexsim.robot.plant_names import plant_kind
from flexsim.shaping.aids import PLAIN
from studies.arena.contestants import CLASSES

SHIPPED = Path(__file__).parents[1] / "files" / "arena.toml"
PAYLOADS = (0.05, 0.1, 0.2)  # [kg]
STIFFNESS = {"EI -20 %": 0.8, "EI +20 %": 1.2}
DAMPING = {"undamped": 0.0, "damped 1 %": 0.01}
AIDED = (PLAIN, "true-tip", "feedforward")
NOISE = 3.0  # times the bench's
BENCH_NOISE = 1e-4  # [m] rms of v
PUSH = 0.01  # [N s] at the tip
PULSE = (5.0, 1.0)  # [N m] at the motors over 50 ms, beyond the dead zones
NOMINAL = "nominal"
CORE = "bench"  # the tuning that all classes have


class Tuned(NamedTuple):
    """A controller that a search found.

    Attributes:
        contestant: a key of `CLASSES`. tuning: what it was tuned on. seed: of the search.
        knobs: its own.
    """

    contestant: str
    tuning: str
    seed: int
    knobs: tuple[float, ...]

    @property
    def name(self) -> str:
        """Of its rows."""
        return f"{self.contestant}/{self.tuning}/{self.seed}"


@dataclass(frozen=True)
class Condition:
    """What a study file of the arena has other than the shipped one.

    Attributes:
        name, text: for tables. lists: in place of the file's. numbers: outside of its lists.
        aids: of references. finer: whether it is run on all plants, not on the first and the
            first chain alone.
    """

    name: str
    text: str
    lists: Mapping[str, list[Any]] = field(default_factory=dict)
    numbers: Mapping[str, Any] = field(default_factory=dict)
    aids: tuple[str, ...] = (PLAIN,)
    finer: bool = False


def _robots(changes: Mapping[str, Mapping[str, Any]]) -> dict[str, list[Any]]:
    return {"robots": [{"name": NOMINAL}, *({"name": k, **v} for k, v in changes.items())]}


def _rest(**more: Any) -> dict[str, Any]:
    """Return a trajectory that stands still in the middle of the paths, to be disturbed."""
    pose = {"start": [0.55, 0.35], "end": [0.5500001, 0.35]}
    return {"shape": "line", **pose, "duration": 1.0, "hold": 1.0, "lead": 0.0, **more}


_EVERY = (
    Condition(NOMINAL, "as tuned, with other references, on every plant", aids=AIDED, finer=True),
    Condition(
        "payload",
        "at the tip",
        _robots({f"{1e3 * m:.0f} g": {"payload": m} for m in PAYLOADS}),
    ),
    Condition(
        "disturbed",
        "at rest: a push at the tip, a pulse of torque",
        {
            "trajectories": [
                _rest(name="push", push=PUSH),
                _rest(name="pulse", pulse=list(PULSE), pulse_span=[0.2, 0.25]),
            ]
        },
    ),
    Condition(
        "hardware",
        "nothing between arm and controller; no delay; two samples of it; three times the noise",
        {
            "hardware": [
                {"name": "ideal", "use": "ideal"},
                {"name": "no delay", "use": "bench", "delay": 0},
                {"name": "delay 2", "use": "bench", "delay": 2},
                {"name": "noise x3", "use": "bench", "noise_v": NOISE * BENCH_NOISE},
            ]
        },
    ),
    Condition("friction", "none; against the motion", {"settings": ["none", "opposing"]}),
    Condition("damping", "of the beam", _robots({k: {"zeta": z} for k, z in DAMPING.items()})),
    Condition(
        "stiffness", "of the beam", _robots({k: {"stiffness": f} for k, f in STIFFNESS.items()})
    ),
    Condition("0.5 ms", "of sampling", numbers={"period": 0.5e-3}),
    Condition("2 ms", "of sampling", numbers={"period": 2e-3}),
)
CONDITIONS: Mapping[str, Condition] = {each.name: each for each in _EVERY}
"""Name -> condition."""


def _stepped(plant: str, period: float) -> dict[str, Any]:
    """Return a plant whose physics step divides a control period [s]; their own is 1 ms."""
    shorter = plant_kind(plant)[0] in ("assumed-modes", "closed-chain") and period < PERIOD
    return {"model": plant, **({"step": period} if shorter else {})}


@cache
def shipped() -> dict[str, Any]:
    """Return the study file that comes with flexsim, as TOML has it."""
    return tomllib.loads(SHIPPED.read_text(encoding="utf-8"))


def aided_name(trajectory: str, aid: str) -> str:
    """Return the name of a trajectory with its help."""
    return trajectory if aid == PLAIN else f"{trajectory}+{aid}"


def document(
    condition: Condition,
    tuned: Sequence[Tuned],
    plants: Sequence[str],
    repeats: int,
    seed: int = 1,
    changes: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Return the study file of a condition, as TOML has it.

    Args:
        tuned: who runs. plants: on which. repeats: of each case. seed: of noise and perturbation.
        changes: of trajectories, such as a shorter duration.
    """
    found = copy.deepcopy(shipped())
    found |= {"seed": seed, "repeats": repeats, **condition.numbers}
    found["plants"] = [_stepped(each, float(found.get("period", PERIOD))) for each in plants]
    found |= copy.deepcopy(dict(condition.lists))
    usual = [{**each, **(changes or {})} for each in found["trajectories"]]
    own = dict.fromkeys(CLASSES[each.contestant].aid for each in tuned)  # in order: kept by it
    aids = [PLAIN, *(a for a in (*condition.aids, *own) if a != PLAIN)]
    names = [str(each.get("name", each.get("use"))) for each in usual]
    found["trajectories"] = [
        {**each, "name": aided_name(name, aid), **({} if aid == PLAIN else {"aid": aid})}
        for aid in dict.fromkeys(aids)
        for name, each in zip(names, usual, strict=True)
    ]
    found["controllers"] = []
    for each in tuned:
        contestant = CLASSES[each.contestant]
        runs = [contestant.aid if aid == PLAIN else aid for aid in condition.aids]
        found["controllers"].append(
            {
                "name": each.name,
                "function": "studies.arena.entry:design",
                "options": {"contestant": each.contestant, "knobs": list(each.knobs)},
                "v_gain": contestant.v_gain,
                "trajectories": [aided_name(name, aid) for aid in runs for name in names],
            }
        )
    return found
