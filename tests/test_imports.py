"""The house: imports go one way, in a stated order, and heavy packages stay in their rooms."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

import studies
from studies.laboratory import laboratory
from studies.tuning.record import DECIDES

ROOT = Path(__file__).parents[1]
PACKAGES = ("flexsim", "studies", "controllers")
FLEXSIM = (  # a room imports only those before it
    *("errors", "files", "numerics", "arm", "mjcf", "plants", "loop", "linear", "robot", "shaping"),
    "recording",
)
ROOM_MOST = 14  # files of a room, `__init__` not counted: about a dozen
MUJOCO = {  # the rooms, and where else MuJoCo is at work
    "flexsim/mjcf/": "reads and writes its files",
    "flexsim/plants/": "steps its models",
    "flexsim/numerics/mujoco_c.py": "its C functions for compiled code",
    "flexsim/recording/": "draws its geometry",
    "studies/compare/compare.py": "the type of the model that recordings draw",
    "studies/parity/motion_checks.py": "takes its accelerations apart",
    "studies/ladder/integrators.py": "is about its integrators",
    "studies/play/": "is played in its viewer",
    "studies/tools/timed_loops.py": "times its bare steps",
}
RERUN = ("flexsim/recording/", "studies/watch/")


@cache
def modules() -> dict[str, Path]:
    """Return the files of all modules by their dotted names."""
    found = {}
    for package in PACKAGES:
        for path in (ROOT / package).rglob("*.py"):
            parts = path.relative_to(ROOT).with_suffix("").parts
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


@cache
def imported(name: str) -> tuple[str, ...]:
    """Return what a module imports, wherever in it, for type checkers only too."""
    return tuple(_imported(name))


def _imported(name: str) -> Iterator[str]:
    path = modules()[name]
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                above = package.split(".")[: len(package.split(".")) - node.level + 1]
                base = ".".join([*above, *([node.module] if node.module else [])])
            for alias in node.names:
                whole = f"{base}.{alias.name}"
                yield whole if whole in modules() else base


@cache
def graph() -> dict[str, set[str]]:
    """Return the modules of ours that each imports, but for what `__init__` gives names to."""
    inner = {n: p for n, p in modules().items() if n not in PACKAGES}
    return {
        name: {to for to in imported(name) if to in inner} - {name}
        for name in inner
        if not name.endswith("__main__")  # `python -m flexsim` is the command
    }


def rooms_of(package: str) -> dict[str, set[str]]:
    """Return which rooms (or lone modules) of a package each imports."""
    found: dict[str, set[str]] = {}
    for name, others in graph().items():
        if name.startswith(f"{package}."):
            room = name.split(".")[1]
            mine = found.setdefault(room, set())
            mine |= {other.split(".")[1] for other in others if other.startswith(f"{package}.")}
            mine.discard(room)
    return found


def cycle(links: dict[str, set[str]]) -> list[str]:
    """Return one circle of a graph, none if there is none."""
    done: set[str] = set()

    def walk(node: str, path: list[str]) -> list[str]:
        if node in path:
            return [*path[path.index(node) :], node]
        if node in done:
            return []
        for other in sorted(links.get(node, ())):
            if found := walk(other, [*path, node]):
                return found
        done.add(node)
        return []

    return next((found for node in sorted(links) if (found := walk(node, []))), [])


def test_a_circle_would_be_found() -> None:
    assert cycle({"a": {"b"}, "b": {"c"}, "c": {"b"}}) == ["b", "c", "b"]
    assert cycle({"a": {"b", "c"}, "b": {"c"}, "c": set()}) == []


def test_no_circle_among_modules() -> None:
    assert cycle(graph()) == []


@pytest.mark.parametrize(("package", "order"), [("flexsim", FLEXSIM), ("studies", studies.ROOMS)])
def test_rooms_import_only_those_before_them(package: str, order: tuple[str, ...]) -> None:
    links = rooms_of(package)
    assert set(links) <= set(order), set(links) - set(order)
    wrong = [
        f"{room} imports {other}"
        for room, others in links.items()
        for other in others
        if order.index(other) > order.index(room)
    ]
    assert wrong == []


def test_packages_import_one_way() -> None:
    for name, others in graph().items():
        used = {other.split(".")[0] for other in others}
        allowed = {"flexsim": {"flexsim"}, "controllers": {"controllers"}}
        assert used <= allowed.get(name.split(".")[0], set(PACKAGES)), name
    for name in modules():
        if name.startswith("controllers"):
            assert {each.split(".")[0] for each in imported(name)}.isdisjoint(
                {"flexsim", "studies"}
            )


@cache
def users_of(library: str) -> set[str]:
    """Return the files that import a library, by their paths."""
    return {
        modules()[name].relative_to(ROOT).as_posix()
        for name in modules()
        if any(each.split(".")[0] == library for each in imported(name))
    }


def test_mujoco_stays_where_it_is_needed() -> None:
    assert {path for path in users_of("mujoco") if not path.startswith(tuple(MUJOCO))} == set()
    for place in MUJOCO:  # an exception that is none any more
        assert any(path.startswith(place) for path in users_of("mujoco")), place


def test_rerun_stays_in_recording_and_watch() -> None:
    assert {path for path in users_of("rerun") if not path.startswith(RERUN)} == set()


def test_exudyn_stays_in_its_room() -> None:
    assert users_of("exudyn") == {"flexsim/plants/exudyn_beam/system.py"}


def test_rooms_have_about_a_dozen_files() -> None:
    for package in PACKAGES:
        for folder in [ROOT / package, *(ROOT / package).rglob("*/")]:
            files = [path for path in folder.glob("*.py") if path.name != "__init__.py"]
            assert len(files) <= ROOM_MOST, folder


def all_imported(left: list[str], but: frozenset[str] = frozenset()) -> set[Path]:
    """Return the files of modules and of all that these import, but for some and what they do."""
    seen: set[str] = set()
    while left:
        name = left.pop()
        if name not in seen | but:
            seen.add(name)
            left += graph()[name]
    return {modules()[name] for name in seen}


def test_a_tunings_digest_has_all_that_its_result_depends_on() -> None:
    """Whatever the search imports, so that a run is not resumed with other code."""
    named = {path for pattern in DECIDES for path in ROOT.glob(pattern)}
    assert all_imported(["studies.tuning.problem", "studies.tuning.screened_draws"]) <= named
    assert ROOT / "flexsim/loop/control/compiled.py" in named


def test_kept_runs_digest_has_all_that_they_depend_on() -> None:
    """Whatever runs the laboratory's loops, but for what keeps them."""
    named = {path for pattern in laboratory.DECIDES for path in ROOT.glob(pattern)}
    found = all_imported(["studies.laboratory.loops"], frozenset({"studies.core.evidence.kept"}))
    assert found <= named and ROOT / "studies/laboratory/place.py" in found
