"""Controllers from a Python function that a study file names: `file.py:function`.

>>> source = function_source("lead.py:design", Path("."), code=True, keep=keep)
>>> call("inputs/lead.py:design", inputs, period=1e-3, parameters=Parameters(), options={"kp": 3.0})

The function gets `period` [s], `parameters` of the first robot, and the file's options by name; it
returns what the loop takes: two filters (b, a), sections, a state space, a `Controller`.
A file's text is kept in the run. A module that is installed is imported as it is.
"""

from __future__ import annotations

import copy
import hashlib
import importlib
import importlib.util
import os
import sys
import types
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, redirect_stdout
from functools import lru_cache
from pathlib import Path
from typing import Any

from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.files.reading import MIB, read_text

SOURCE_MOST = MIB
FAILED = (Exception, SystemExit, GeneratorExit)  # what a function may end with


def function_source(name: str, folder: Path, code: bool, keep: Callable[[str, str], str]) -> str:
    """Return the name of a function whose source, if it is a file's, is kept.

    Args:
        name: as the file has it. folder: that it is relative to. code: whether it may be run.
        keep: keeps a text under a name and returns its path.

    Raises:
        ParameterError: it is no such name, it may not be run, or there is no such module.
        RunError: its file cannot be read.
    """
    module, colon, function = name.rpartition(":")
    if not (colon and module and function.isidentifier()):
        raise ParameterError(f"function is {name!r}; give file.py:function or module:function")
    if not code:
        raise ParameterError(f"function {name!r} is code, which --no-code refuses; leave it out")
    path = folder / (module if module.endswith(".py") else module.replace(".", "/") + ".py")
    if module.endswith(".py") or path.is_file():
        return f"{keep(path.name, read_text(path, SOURCE_MOST, 'function'))}:{function}"
    try:
        found = importlib.util.find_spec(module)
    except (ImportError, ValueError):
        found = None
    if found is None:
        raise ParameterError(f"function {name!r}: there is neither {path} nor a module {module}")
    return name


@contextmanager
def _apart() -> Iterator[None]:
    """Keep what a function prints from standard output, and where it goes from where we are."""
    here = os.getcwd()
    try:
        with redirect_stdout(sys.stderr):
            yield
    finally:
        os.chdir(here)


@lru_cache(maxsize=16)
def _module(name: str, text: str) -> types.ModuleType:
    """Return a module of a source text, executed once."""
    own = f"flexsim_study_{hashlib.sha256(text.encode()).hexdigest()[:16]}"
    module = types.ModuleType(own)
    module.__file__ = name
    sys.modules[own] = module  # where dataclasses look for it
    try:
        with _apart():
            exec(compile(text, name, "exec"), module.__dict__)
    except FAILED as error:
        line = _line_of(error, name)
        raise ParameterError(f"{name} failed{line}: {type(error).__name__}: {error}") from error
    return module


def call(
    source: str,
    inputs: Mapping[str, str],
    period: float,
    parameters: Parameters,
    options: Mapping[str, Any],
) -> Any:
    """Return the controller that a function designs.

    Args:
        source: as `function_source` returns it. inputs: texts kept beside the study.

    Raises:
        ParameterError: there is no such function, or it fails; with its own words.
    """
    name, _, function = source.rpartition(":")
    if name in inputs:
        module = _module(name, inputs[name])
    else:
        module = importlib.import_module(name)
    design = getattr(module, function, None)
    if not callable(design):
        raise ParameterError(f"{name} has no function {function!r}")
    try:
        with _apart():
            return design(period=period, parameters=parameters, **copy.deepcopy(dict(options)))
    except FAILED as error:
        line = _line_of(error, module.__file__ or name)
        raise ParameterError(f"{source} failed{line}: {type(error).__name__}: {error}") from error


def _line_of(error: BaseException, name: str) -> str:
    """Return at which line of a file an error arose, in words."""
    trace, line = sys.exc_info()[2], None
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == name:
            line = trace.tb_lineno
        trace = trace.tb_next
    return "" if line is None else f" at line {line}"
