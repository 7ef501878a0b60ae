"""Fixtures of the whole suite, and one profile of hypothesis: same draws every run, no clock."""

# ruff: noqa: E402

import signal
from collections.abc import Iterator

import pytest
from hypothesis import settings

from flexsim.numerics.blas import one_thread  # isort: skip

one_thread()  # before numpy is loaded

from compiled_loops import compile_together

from flexsim import Parameters
from flexsim.plants.chain_plant import ChainPlant
from flexsim.plants.modes_plant import AssumedModesPlant

# numba compiles inside the first example, so a deadline per example would measure the compiler
settings.register_profile(
    "flexsim", deadline=None, derandomize=True, database=None, max_examples=50
)
settings.load_profile("flexsim")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put the longest file first, so that no process ends with it while the other one waits."""
    items.sort(key=lambda item: item.path.name != "test_wheel.py")


@pytest.fixture(scope="session", autouse=True)
def compiled(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> None:
    """Have the loops compiled once, where several processes run the tests."""
    if hasattr(request.config, "workerinput"):
        compile_together(tmp_path_factory.getbasetemp().parent / "compiled_loops")


@pytest.fixture(scope="session")
def chain_plant() -> ChainPlant:
    return ChainPlant.designed(Parameters())


@pytest.fixture(scope="session")
def modes_plant() -> AssumedModesPlant:
    return AssumedModesPlant(Parameters())


@pytest.fixture(scope="session", params=["assumed-modes", "chain"])
def plant(request: pytest.FixtureRequest) -> AssumedModesPlant | ChainPlant:
    name = "modes_plant" if request.param == "assumed-modes" else "chain_plant"
    chosen: AssumedModesPlant | ChainPlant = request.getfixturevalue(name)
    return chosen


@pytest.fixture
def interruptible() -> Iterator[None]:
    """Have Ctrl-C heard by this process, also where it was started with SIGINT ignored (nohup)."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)
