"""The robot's numbers: what the paper prints against what follows, and what is refused."""

import math
from dataclasses import fields, replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexsim import FlexsimError, ParameterError, Parameters
from flexsim.arm.beam import beta_lengths
from flexsim.arm.parameters import PRINTED_BETA_L, PRINTED_I_b, describe

ROUNDING = 1e-15  # relative, one or two operations on doubles
HALF_DIGIT_BETA = 0.5e-4  # (28)-(30) are printed with four decimals
HALF_DIGIT_I_b = 0.5e-4  # (23) is printed as 99e-4
STRIP = 0.005  # relative: steel's modulus and density are known to half a percent

PAPER = {  # (17)-(31) as printed
    "L_R": 0.32,
    "I_R0": 0.25,
    "I_H": 13.22e-4,
    "m_H": 0.47,
    "r": 0.075,
    "L": 0.5,
    "rho": 0.157,
    "EI": 0.349,
    "F_1": 2.0e-4,
    "F_2": 2.3e-4,
}
NAMES = [item.name for item in fields(Parameters)]
MAY_BE_ZERO = {"r", "F_1", "F_2", "I_m1", "I_m2", "zeta", "payload", "payload_inertia"}
FRACTIONS = {"zeta"}
NEGATIVE = st.floats(max_value=0.0, exclude_max=True, allow_nan=False)
NOT_NUMBERS = st.sampled_from([math.nan, math.inf, -math.inf, None, "0.3", [0.3], 1j])


def test_defaults_are_the_papers_numbers() -> None:
    assert {name: getattr(Parameters(), name) for name in PAPER} == PAPER


def test_mass_of_the_flexible_link_is_25() -> None:
    assert Parameters().m_b == pytest.approx(0.0785, rel=ROUNDING)  # (25), exact in its digits


def test_inertia_of_the_flexible_link_rounds_to_23() -> None:
    I_b = Parameters().I_b
    assert abs(I_b - PRINTED_I_b) < HALF_DIGIT_I_b
    by_parallel_axes = 0.0785 * 0.5**2 / 12 + 0.0785 * (0.075 + 0.25) ** 2
    assert I_b == pytest.approx(by_parallel_axes, rel=4 * ROUNDING)


@pytest.mark.parametrize("i", range(3))
def test_roots_round_to_28_to_30(i: int) -> None:
    assert abs(beta_lengths(3)[i] - PRINTED_BETA_L[i]) <= HALF_DIGIT_BETA


def test_flexible_link_is_a_steel_strip_of_20_by_1_mm() -> None:
    width, thickness = 0.020, 0.001
    assert Parameters().rho == pytest.approx(7850 * width * thickness, rel=STRIP)
    assert Parameters().EI == pytest.approx(210e9 * width * thickness**3 / 12, rel=STRIP)


@given(
    rho=st.floats(0.01, 10.0),
    r=st.floats(1e-3, 1.0),
    L=st.floats(0.01, 3.0),
    EI=st.floats(0.01, 1e3),
)
def test_derived_numbers_follow_the_parameters(rho: float, r: float, L: float, EI: float) -> None:
    p = Parameters(rho=rho, r=r, L=L, EI=EI)
    assert p.m_b == pytest.approx(rho * L, rel=ROUNDING)
    assert p.reach == pytest.approx(r + L, rel=ROUNDING)
    cancellation = 1e-12  # (r+L)^3 - r^3 at the widest r/L drawn loses up to three digits
    assert p.I_b == pytest.approx(p.m_b * (L**2 / 12 + (r + L / 2) ** 2), rel=cancellation)
    assert p.static_compliance == pytest.approx(L**3 / 3 / EI, rel=4 * ROUNDING)


@given(name=st.sampled_from(NAMES), value=st.one_of(NEGATIVE, NOT_NUMBERS))
def test_every_number_that_cannot_be_used_is_an_error_naming_it(name: str, value: Any) -> None:
    with pytest.raises(ParameterError) as error:
        replace(Parameters(), **{name: value})
    message = str(error.value)
    assert message.startswith(f"parameter {name} (")
    assert repr(value) in message and "finite" in message
    assert isinstance(error.value, ValueError) and isinstance(error.value, FlexsimError)


@pytest.mark.parametrize("name", NAMES)
def test_zero_is_legal_only_where_physics_allows_it(name: str) -> None:
    if name in MAY_BE_ZERO:
        assert getattr(replace(Parameters(), **{name: 0.0}), name) == 0.0
    else:
        with pytest.raises(ParameterError, match=f"parameter {name} .*more than 0"):
            replace(Parameters(), **{name: 0.0})


@given(name=st.sampled_from([n for n in NAMES if n not in FRACTIONS]), value=st.floats(1e-6, 1e6))
def test_every_positive_number_is_taken_as_given(name: str, value: float) -> None:
    assert getattr(replace(Parameters(), **{name: value}), name) == value


@given(zeta=st.floats(0.0, 0.4), EI=st.floats(0.01, 10.0))
def test_kelvin_voigt_time_gives_mode_1_its_ratio(zeta: float, EI: float) -> None:
    p = Parameters(zeta=zeta, EI=EI)
    omega_1 = (beta_lengths(1)[0] / p.L) ** 2 * math.sqrt(p.EI / p.rho)
    assert p.eta * omega_1 / 2 == pytest.approx(zeta, rel=1e-14)


def test_describe_has_a_row_per_parameter_with_its_value_and_source() -> None:
    rows = describe(Parameters(EI=0.5))
    assert [row["name"] for row in rows] == NAMES
    by_name = {row["name"]: row for row in rows}
    assert by_name["EI"]["value"] == 0.5 and by_name["EI"]["source"] == "(26)"
    assert by_name["L_R"]["unit"] == "m"
    assert all(row["unit"] and row["meaning"] and row["source"] for row in rows)


def test_describe_says_which_numbers_the_paper_does_not_print() -> None:
    assumed = {row["name"] for row in describe(Parameters()) if row["assumed"]}
    assert assumed == set(NAMES) - set(PAPER)
