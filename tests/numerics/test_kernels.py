"""The same digits under every BLAS kernel and with numpy's AVX-512 disabled, in processes of ours.

A kernel that this processor lacks is skipped by name. Older processors, without AVX2 and FMA, are
not claimed: there the C library's own sines have other last bits.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from kernels import KERNELS, chosen, environment, other, runs, wide_features

from flexsim.arm.chain_design import ChainDesign
from flexsim.numerics.machine import blas_kernels

VALUES = Path(__file__).parents[1] / "kernel_values.py"
LEAST = 900  # values compared: two designs' worth of numbers more than rows of compare alone


@cache
def values(kernel: str | None, narrow: bool) -> dict[str, Any]:
    """Return what a process finds under a kernel; see `kernel_values`."""
    done = subprocess.run(
        [sys.executable, "-P", str(VALUES)],
        env=environment(kernel, narrow),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return dict(json.loads(done.stdout))


def leaves(value: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    """Give every number and text with its path."""
    if isinstance(value, dict | list):
        items = value.items() if isinstance(value, dict) else enumerate(value)
        for key, item in items:
            yield from leaves(item, f"{name}/{key}")
    else:
        yield name, value


def require_equal(first: dict[str, Any], second: dict[str, Any]) -> int:
    """Return how many values two processes found, all alike to the last digit."""
    one, two = dict(leaves(first["values"])), dict(leaves(second["values"]))
    assert one.keys() == two.keys()
    differing = [f"{name}: {one[name]!r}, {two[name]!r}" for name in one if one[name] != two[name]]
    assert not differing, f"{len(differing)} of {len(one)} differ, {differing[:5]}"
    return len(one)


@pytest.mark.digits
def test_another_kernel_and_narrower_numpy_give_the_same_digits() -> None:
    """The two farthest apart that run here, in every `make test`."""
    kernel = other()
    if kernel is None and not wide_features():
        pytest.skip(f"{blas_kernels()} is the only kernel of {KERNELS} that runs here")
    usual, narrow = values(None, False), values(kernel, True)
    assert (usual["kernels"], usual["machine"]["numpy_simd"]) != (
        narrow["kernels"],
        narrow["machine"]["numpy_simd"],
    )
    assert require_equal(usual, narrow) > LEAST


@pytest.mark.slow
@pytest.mark.parametrize("narrow", [False, True])
@pytest.mark.parametrize("kernel", KERNELS)
def test_every_kernel_gives_the_same_digits(kernel: str, narrow: bool) -> None:
    if not runs(kernel):
        pytest.skip(f"asked for {kernel}, this processor has {chosen(kernel)}")
    found = values(kernel, narrow)
    assert set(found["kernels"].values()) == {f"OpenBLAS {kernel}"}
    assert require_equal(values(None, False), found) > LEAST


def test_a_last_digit_would_be_noticed() -> None:
    """Negative control: what the comparison is for makes it fail."""
    first = {"values": {"a": [1.0, {"b": 0.1 + 0.2}], "c": "text"}}
    second = {"values": {"a": [1.0, {"b": 0.3}], "c": "text"}}
    assert require_equal(first, first) == 3
    with pytest.raises(
        AssertionError, match=r"1 of 3 differ, .*/a/1/b: 0\.30000000000000004, 0\.3"
    ):
        require_equal(first, second)


@pytest.mark.digits
def test_every_number_of_a_design_is_compared() -> None:
    """So that a new figure of a design is in the comparison by itself."""
    found = values(None, False)["values"]["designs"]["6"]
    assert set(found) == set(ChainDesign.__dataclass_fields__)
