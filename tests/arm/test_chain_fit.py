"""The tuning checks what it found, starts again elsewhere, and otherwise refuses in one line."""

from collections.abc import Iterator

import numpy as np
import pytest

from flexsim import ParameterError
from flexsim.arm import chain_fit
from flexsim.arm.chain_fit import (
    FREQUENCY_MOST,
    exact_frequencies,
    fitted_chain,
    flaw,
    frequencies_aimed_at,
)

pytestmark = pytest.mark.kernels  # run once more under another BLAS kernel


@pytest.fixture(autouse=True)
def fresh() -> Iterator[None]:
    fitted_chain.cache_clear()
    yield
    fitted_chain.cache_clear()


def test_a_fitted_chain_has_no_flaw() -> None:
    a, k = (np.array(each) for each in fitted_chain(6))
    assert flaw(a, k) == ""
    assert flaw(a, k * (1 + 10 * FREQUENCY_MOST)).startswith("a frequency is off by 9.9e-11")
    assert "follow one another" in flaw(a[::-1], k)
    assert "each with a spring" in flaw(a, -k)


def test_exact_frequencies_do_not_make_the_couplings_right() -> None:
    a, k = (np.array([0.1, 0.3, 0.6, 0.8]), np.full(4, 4.0))
    missed = exact_frequencies(a, k, frequencies_aimed_at(), np.empty(4), np.empty((4, 4)))
    assert missed < FREQUENCY_MOST
    assert flaw(a, k).startswith("a coupling to the joints is off by")


def test_frequencies_out_of_reach_are_reported() -> None:
    """Three hinges by the clamp: no springs give them the beam's frequencies."""
    a, k = np.array([0.01, 0.02, 0.03]), np.full(3, 3.0)
    missed = exact_frequencies(a, k, frequencies_aimed_at(), np.empty(3), np.empty((3, 3)))
    assert not missed < 1e-3


def test_a_poor_first_start_is_followed_by_others(monkeypatch: pytest.MonkeyPatch) -> None:
    expected = fitted_chain(4)
    fitted_chain.cache_clear()
    monkeypatch.setattr(chain_fit, "STARTS", (3.0, 0.0))  # gaps of e^3 to 1, which lead nowhere
    assert fitted_chain(4) == expected


@pytest.mark.parametrize(
    ("constant", "value", "reason"),
    [
        ("COUPLING_MOST", {3: 0.1}, "a coupling to the joints is off by 0."),
        ("FREQUENCY_MOST", 1e-17, "a frequency is off by"),
        ("TRIALS", 3, "the least squares do not converge"),
    ],
)
def test_what_passes_no_check_is_refused(
    monkeypatch: pytest.MonkeyPatch, constant: str, value: object, reason: str
) -> None:
    monkeypatch.setattr(chain_fit, constant, value)
    with pytest.raises(ParameterError, match=f"no chain of 3 segments was found.*{reason}"):
        fitted_chain(3)
