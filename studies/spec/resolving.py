"""Names, files and runs of others replaced by their numbers: a study that stands alone.

>>> resolved = resolve(read_study(Path("study.toml")))
>>> resolved.document["controllers"][0]["joint1"]["k1"]
>>> resolved.text()                     # the TOML that a run's folder keeps

What cannot be numbers, an MJCF file or a function's source, is kept beside, as `inputs/NAME`.
"""

from __future__ import annotations

import difflib
import hashlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from pathlib import Path, PurePosixPath
from typing import Any

import tomli_w

from controllers import Controller, ControllerError, Gains, TextbookPid
from flexsim.arm.arms import FirstLink, named_arm
from flexsim.arm.parameters import Parameters
from flexsim.errors import FlexsimError, ParameterError
from flexsim.loop.hardware import HARDWARE, Hardware
from flexsim.loop.settings import SETTINGS, Setting
from flexsim.loop.trajectories import (
    RECONSTRUCTED_TRAJECTORIES,
    SHAPES,
    TRAJECTORIES,
    TURN,
    Trajectory,
    Turn,
)
from flexsim.mjcf.load import load_arm
from flexsim.mjcf.reading.names import Names
from flexsim.robot.plant_names import KINDS, plant_kind
from flexsim.shaping.aids import AIDS
from studies.spec.functions import function_source
from studies.spec.parts import (
    HELPED,
    NUMBERS,
    SHAPE_KEYS,
    WAY_KEYS,
    WAYS,
    WITH_FILE,
    ControllerPart,
    HardwarePart,
    PlantPart,
    SettingPart,
    Study,
    TrajectoryPart,
)
from studies.spec.points import read_points
from studies.spec.reading import Given, choice
from studies.tuning.found import FoundController, controller_of, found_in, v_gain_of
from studies.tuning.individuals import TEXTBOOK, in_si

INPUTS = "inputs"
PARTED = ("seed", "sensing", "effects")  # of a Hardware, which a study file has no table of
PATHS: Mapping[str, Trajectory | Turn] = {
    **TRAJECTORIES,
    **{f"reconstructed-{name}": path for name, path in RECONSTRUCTED_TRAJECTORIES.items()},
    TURN.name: TURN,
}
FREE = ("title", "seed", "repeats", "perturbation", "period", "weights", "batch", "traces", "check")


@dataclass(frozen=True, eq=False)
class Resolved:
    """A study whose every number stands in it.

    Attributes:
        source: its file, for messages. document: as TOML has it. inputs: texts kept beside, by
            the names that the document has for them.
    """

    source: str
    document: dict[str, Any]
    inputs: Mapping[str, str] = field(default_factory=dict)

    def text(self) -> str:
        """Return the study as a file of its own."""
        return self._text

    @cached_property
    def _text(self) -> str:
        document = dict(self.document)
        if len(document["robots"]) == 1:
            (document["robot"],) = document.pop("robots")
        sweep = document.pop("sweep")
        if sweep["numbers"]:
            document["sweep"] = {k: v for k, v in sweep.items() if k != "numbers"}
            document["sweep"] |= sweep["numbers"]
        return tomli_w.dumps(document)

    @cached_property
    def digest(self) -> str:
        """A name for all that the study says."""
        digest = hashlib.sha256(self.text().encode())
        for name, text in sorted(self.inputs.items()):
            digest.update(f"\0{name}\0{text}".encode())
        return digest.hexdigest()[:16]

    @property
    def study(self) -> Study:
        """The same, typed."""
        return Study.model_validate(self.document)


class PlacedError(ParameterError):
    """A mistake at a place in the file: `place: said`."""

    def __init__(self, place: str, said: str) -> None:
        super().__init__(f"{place}: {said}")
        self.place, self.said = place, said


@contextmanager
def at(place: str) -> Iterator[None]:
    """Have errors begin with the place in the file that they are about, within an outer one."""
    try:
        yield
    except PlacedError as error:
        raise PlacedError(f"{place}.{error.place}", error.said) from None
    except (FlexsimError, ControllerError) as error:
        raise PlacedError(place, str(error)) from None


def resolve(given: Given, code: bool = True) -> Resolved:
    """Return a study whose every number stands in it.

    Args:
        given: as read. code: whether it may name a Python function.

    Raises:
        ParameterError: a name, file or run cannot be used, or a list is empty; one line.
    """
    study = given.study
    inputs: dict[str, str] = {}

    def keep(name: str, text: str) -> str:
        """Keep a text beside the study; return the path that names it."""
        path = PurePosixPath(INPUTS, name)
        number = 1
        while inputs.get(str(path), text) != text:
            number += 1
            stem, suffix = PurePosixPath(name).stem, PurePosixPath(name).suffix
            path = PurePosixPath(INPUTS, f"{stem}-{number}{suffix}")
        inputs[str(path)] = text
        return str(path)

    resolvers: dict[str, Callable[[Any], dict[str, Any]]] = {
        "robots": lambda part: _robot(part, given.folder, keep),
        "plants": _plant,
        "controllers": lambda part: _controller(part, given.folder, study.period, code, keep),
        "trajectories": lambda part: _trajectory(part, given.folder),
        "settings": _setting,
        "hardware": _hardware,
    }
    try:
        document: dict[str, Any] = {name: _plain(getattr(study, name)) for name in FREE}
        for name, resolver in resolvers.items():
            items = []
            for number, part in enumerate(getattr(study, name)):
                place = "robot" if name == "robots" and len(study.robots) == 1 else None
                with at(place or f"{name}[{number}]"):
                    items.append(resolver(part))
            document[name] = items
            _require_names(name, items)
        _require_known_trajectories(document)
        document["sweep"] = _plain(study.sweep.model_dump(by_alias=True, exclude_none=True))
    except ParameterError as error:
        raise ParameterError(f"{given.source}: {error}") from None
    return Resolved(given.source, document, inputs)


def _plain(value: Any) -> Any:
    """Return a value as TOML has it."""
    if isinstance(value, Mapping):
        return {key: _plain(each) for key, each in value.items() if each is not None}
    if isinstance(value, tuple | list):
        return [_plain(each) for each in value]
    return value


def _require_names(name: str, items: list[dict[str, Any]]) -> None:
    """Refuse an empty list, and a name twice."""
    if not items:
        raise ParameterError(f"{name} is empty, so there is nothing to run; give one or more")
    seen: dict[str, int] = {}
    for number, item in enumerate(items):
        if item["name"] in seen:
            raise ParameterError(
                f"{name}[{number}].name is {item['name']!r}, as of {name}[{seen[item['name']]}]; "
                "give each its own"
            )
        seen[item["name"]] = number


def _require_known_trajectories(document: Mapping[str, Any]) -> None:
    """Refuse a controller that is to run on a trajectory that there is not."""
    known = [each["name"] for each in document["trajectories"]]
    for number, controller in enumerate(document["controllers"]):
        for each in controller.get("trajectories", known):
            if each not in known:
                raise ParameterError(
                    f"controllers[{number}].trajectories has {each!r}; {choice(each, known)}"
                )


def _robot(part: Any, folder: Path, keep: Callable[[str, str], str]) -> dict[str, Any]:
    """Return a robot by its parameters, or by the text of its file with our names in it."""
    if part.mjcf is None:
        found = part.model_dump(exclude={"arm", "mjcf", "beam", *(n.name for n in fields(Names))})
        named = named_arm(part.arm or "paper")
        usual = vars(named.parameters)
        found |= {name: usual[name] for name in NUMBERS if name not in part.model_fields_set}
        Parameters(**{name: found[name] for name in NUMBERS})
        found["link1"] = _link1(named.link1, part.link1)
        return _plain(found | {"name": part.name or part.arm or "paper"})
    for name in sorted(part.model_fields_set - set(WITH_FILE)):
        raise ParameterError(
            f"{name} has no effect beside mjcf: the file has its own; leave it out"
        )
    path = folder / part.mjcf
    names = Names(**{item.name: getattr(part, item.name) for item in fields(Names)})
    with at("mjcf"):
        text = load_arm(path, None, names).text  # with our names in it
    return {
        "name": part.name or path.stem,
        "mjcf": keep(path.name, text),
        "beam": part.beam,
        **{name: getattr(part, name) for name in ("stiffness", "density", "payload")},
    }


def _link1(usual: FirstLink | None, part: Any) -> dict[str, Any] | None:
    """Return the numbers of link 1's beam, those of an arm of ours unless given, None if rigid."""
    given = {} if part is None else part.model_dump(exclude_none=True)
    if usual is not None:
        return vars(replace(usual, **given))
    if not given:
        return None
    for name in ("EI", "rho"):
        if name not in given:
            with at("link1"):
                raise ParameterError(f"{name} is missing; give it")
    return vars(FirstLink(**given))


def _plant(part: PlantPart) -> dict[str, Any]:
    """Return a plant, its name known."""
    try:
        plant_kind(part.model)
    except ParameterError as error:
        close = difflib.get_close_matches(part.model.partition(":")[0], KINDS, n=1)
        raise ParameterError(
            f"{error}" + (f". Did you mean {close[0]}?" if close else "")
        ) from None
    return _plain(part.model_dump() | {"name": part.name or part.model})


def _controller(
    part: ControllerPart, folder: Path, period: float, code: bool, keep: Callable[[str, str], str]
) -> dict[str, Any]:
    """Return a controller by its numbers, or by the source of its function."""
    ways = [
        way for way, keys in WAYS.items() if any(getattr(part, k) is not None for k in keys[:1])
    ]
    if len(ways) != 1:
        said = f"{' and '.join(ways)} contradict each other" if ways else "says nothing"
        raise ParameterError(f"{said}; give one of {'; '.join(WAYS)}")
    (way,) = ways
    for key in sorted(part.model_fields_set - {*WAYS[way], "name", "v_gain", "trajectories"}):
        raise ParameterError(f"{key} has no effect beside {way}; leave it out")
    common = {"v_gain": part.v_gain, "trajectories": part.trajectories}
    if way in ("use", "run"):
        with at(way):
            own_name = str(getattr(part, way))
            found = controller_of(own_name) if way == "use" else found_in(folder / own_name)
        if "v_gain" not in part.model_fields_set:
            common["v_gain"] = v_gain_of(found)
        own = _of_found(found, period) if isinstance(found, FoundController) else _of_own(found)
        return _plain({"name": part.name or found.name} | own | common)
    if way == "function":
        with at("function"):
            source = function_source(str(part.function), folder, code, keep)
        name = part.name or str(part.function).rpartition(":")[2]
        return _plain({"name": name, "function": source, "options": part.options} | common)
    missing = [key for key in WAYS[way][: 2 if part.joint1 else 4] if getattr(part, key) is None]
    if missing:
        raise ParameterError(f"{', '.join(missing)} is missing; give it")
    usual = "state space" if part.A is not None else "own"
    own = part.model_dump(include=set(WAYS[way]), exclude_none=True)
    return _plain({"name": part.name or usual} | own | common)


def _of_own(controller: Controller | TextbookPid) -> dict[str, Any]:
    """Return one that comes with flexsim, of the paper's structure or textbook PIDs."""
    if isinstance(controller, TextbookPid):
        lag = {"filter_time": controller.filter_time}
        pids = {"joint1": controller.joint1, "joint2": controller.joint2}
        return {
            joint: dict(zip(("kp", "ki", "kd"), gains, strict=True)) | lag
            for joint, gains in pids.items()
        }
    joints = {"joint1": controller.joint1, "joint2": controller.joint2}
    numbers = {joint: _gains(gains) for joint, gains in joints.items()}
    return {**numbers, "realisation": "tustin", "terms": 10}


def _gains(gains: Gains) -> dict[str, float]:
    return {k: v for k, v in vars(gains).items() if v is not None}


def _of_found(found: FoundController, period: float) -> dict[str, Any]:
    """Return what a run of flexsim tune found, in SI units."""
    found.filters(period)  # refuses another period
    tuning = found.tuning
    k1, nu1, k2, nu2, k3, k4, nu4, k5, nu5, k6 = map(float, in_si(found.parameters[None])[0])
    if tuning.realisation == TEXTBOOK:
        lag = {"filter_time": tuning.filter_time}
        return {
            "joint1": {"kp": k3, "ki": k2, "kd": k1} | lag,
            "joint2": {"kp": k6, "ki": k5, "kd": k4} | lag,
        }
    return {
        "joint1": _gains(Gains(k1, nu1, k2, nu2, k3)),
        "joint2": _gains(Gains(k4, nu4, k5, nu5, k6)),
        "realisation": tuning.realisation,
        "terms": tuning.terms,
    }


def _trajectory(part: TrajectoryPart, folder: Path) -> dict[str, Any]:
    """Return a trajectory by its shape's numbers, or by its points."""
    ways = [key for key in ("use", "shape", "points", "file") if getattr(part, key) is not None]
    if len(ways) != 1:
        said = f"{' and '.join(ways)} contradict each other" if ways else "says nothing"
        raise ParameterError(f"{said}; give one of use, shape, points or file")
    given = part.model_fields_set - {"name", "use", "file", *HELPED}
    helped = {key: getattr(part, key) for key in HELPED}
    if part.aid not in AIDS:
        raise ParameterError(f"aid is {part.aid!r}; {choice(part.aid, list(AIDS))}")
    if ways[0] in ("use", "shape"):
        wanted = part.use if part.use is not None else part.shape
        known = PATHS if part.use is not None else dict.fromkeys((*SHAPES, TURN.name))
        if wanted not in known:
            raise ParameterError(f"use is {wanted!r}; {choice(str(wanted), list(known))}")
        for key in sorted(given & set(WAY_KEYS)):
            raise ParameterError(f"{key} is of waypoints, not of a {wanted}; leave it out")
        base = PATHS[str(wanted)]
        own = {key: getattr(part, key) for key in given} | {"name": part.name or wanted}
        if isinstance(base, Turn):
            for key in sorted(given - {"shape", *vars(base)}):
                raise ParameterError(f"{key} is not of a turn of the joints; leave it out")
            own["shape"] = TURN.name
        return _plain(vars(base) | own | helped)
    for key in sorted(given & set(SHAPE_KEYS)):
        raise ParameterError(f"{key} is of a shape, not of waypoints; leave it out")
    points, times = part.points, part.times
    if part.file is not None:
        with at("file"):
            points, own_times = read_points(folder / part.file)
        if times and own_times:
            raise ParameterError(f"times stand in {part.file}, too; leave them out")
        times = times or own_times
    duration = part.duration
    if duration is None:
        duration = times[-1] if times else 4.0
    return _plain(
        {
            "name": part.name or "waypoints",
            "points": points,
            "times": times or None,
            "time_law": part.time_law or "minimum-jerk",
            "duration": duration,
            "lead": part.lead or 0.0,
            "hold": 1.0 if part.hold is None else part.hold,
            **helped,
        }
    )


def _setting(part: SettingPart) -> dict[str, Any]:
    """Return friction, limits and motors by their numbers."""
    name = "none" if part.use is None else part.use
    if name not in SETTINGS:
        raise ParameterError(f"use is {name!r}; {choice(name, list(SETTINGS))}")
    base: Setting = SETTINGS[name]
    own = part.model_dump(exclude={"name", "use"}, exclude_none=True)
    motors = {"I_m1": base.I_m1, "I_m2": base.I_m2}
    usual = part.name or (name if part.use is not None else part.law or name)
    return _plain({"name": usual, **vars(base.friction), **motors, **own})


def _hardware(part: HardwarePart) -> dict[str, Any]:
    """Return sensors, computer and motors by their numbers."""
    name = "ideal" if part.use is None else part.use
    if name not in HARDWARE:
        raise ParameterError(f"use is {name!r}; {choice(name, list(HARDWARE))}")
    base: Hardware = HARDWARE[name]
    own = part.model_dump(exclude={"name", "use"}, exclude_none=True)
    found = {key: each for key, each in vars(base).items() if key not in PARTED}
    found |= vars(base.sensing) | vars(base.effects)
    return _plain({"name": part.name or name, **found, **own})
