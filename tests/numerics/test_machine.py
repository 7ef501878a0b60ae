"""What a run's folder says of the machine: asked of the libraries themselves."""

import os
import platform
from pathlib import Path

import numpy as np
import pytest

from flexsim.numerics import machine as module
from flexsim.numerics.blas import THREADS, one_thread
from flexsim.numerics.machine import blas_kernels, blas_threads, machine, processor


def test_every_fact_is_said() -> None:
    facts = machine()
    assert all(isinstance(text, str) and text for text in facts.values())
    assert set(blas_kernels()) == {"numpy", "scipy"}
    assert all(name in facts["blas"] for name in blas_kernels().values())


def test_the_processor_is_the_systems() -> None:
    listed = Path("/proc/cpuinfo")
    if not listed.exists():
        pytest.skip("no /proc/cpuinfo")
    assert processor() in listed.read_text()


def test_without_the_system_the_processor_is_pythons(monkeypatch: pytest.MonkeyPatch) -> None:
    def unreadable(*_: object, **__: object) -> str:
        raise OSError

    monkeypatch.setattr(Path, "read_text", unreadable)
    assert processor() in (platform.processor(), platform.machine())


def test_blas_of_another_kind_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_libraries", lambda: [("numpy", None, "accelerate")])
    assert blas_kernels() == {"numpy": "accelerate"}
    assert blas_threads() == {"numpy": None}


def test_a_library_that_does_not_answer_is_no_kernel(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    broken = tmp_path / "libopenblas.so"
    broken.write_bytes(b"no library")
    monkeypatch.setattr(module, "_libraries", lambda: [("numpy", broken, "openblas")])
    assert blas_kernels() == {"numpy": "openblas"}


def test_blas_has_one_thread_in_tests() -> None:
    assert {count for count in blas_threads().values() if count is not None} <= {1}


def test_one_thread_is_for_every_blas(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in THREADS:
        monkeypatch.setenv(name, "8")
    one_thread()
    assert {os.environ[name] for name in THREADS} == {"1"}


def test_instruction_sets_are_numpys() -> None:
    features = np.show_config(mode="dicts")["SIMD Extensions"]  # type: ignore[call-overload,index]
    assert set(features["found"]) <= set(machine()["numpy_simd"].split())
