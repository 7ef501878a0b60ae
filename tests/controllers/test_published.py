"""The controllers of Table 2 against the paper's tables, and our own tuned ones."""

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest

from controllers import REALISATIONS, TABLE_2, TUNED_IDEAL, Controller, ControllerError
from studies.tuning.distributions import NAMES, TABLE_1

T = 1e-3
"""The paper's sampling period [s]."""
HALF_DIGIT = 0.5
"""The numbers quoted are rounded to whole ones."""
TWO_DIGITS = 0.03
"""The dc gains are quoted to two digits: 2.3e6 and 3.2e6."""

K1_MEAN, K1_SD = 1e4, 2000.0
"""Table 1, k_1."""
K4_MEAN, K4_SD = 100.0, 20.0
"""Table 1, k_4."""


DEVIATIONS = {
    "figure-3": dict(k1=-1.90, nu1=-1.815, k2=-10, k3=0.17, k4=-0.38, nu4=0.15, k5=-10, k6=0.83),
    "figure-4": dict(
        k1=-0.33, nu1=-1.77, k2=-10, k3=3.08, k4=1.27, nu4=-0.25, k5=7.27, nu5=0.10, k6=3.90
    ),
    "figure-5": dict(k1=-0.85, nu1=0.36, k2=-10, k3=1.07, k4=1.92, nu4=-0.06, k5=-10, k6=0.02),
}
"""Every number of Table 2, in milliseconds, in standard deviations from Table 1's mean."""
OUTSIDE = {  # by more than three; all others lie within two
    *((figure, "k2") for figure in DEVIATIONS),
    ("figure-3", "k5"),
    ("figure-5", "k5"),
    *(("figure-4", name) for name in ("k3", "k5", "k6")),
}
AT_REST = {  # gain of C_1 at rest with 9 to 13 taps [N m/rad]
    "figure-3": (1.09e6, 1.61e6, 2.31e6, 3.20e6, 4.32e6),
    "figure-4": (1.53e6, 2.25e6, 3.19e6, 4.39e6, 5.88e6),
    "figure-5": (5329, -4088, 4972, -3911, 4698),
}
THREE_DIGITS = 0.005
HUNDREDTH = 0.0051
"""Deviations are rounded to hundredths, some from just between two."""
README = (Path(__file__).parents[2] / "controllers" / "README.md").read_text(encoding="utf-8")


def numbers(controller: Controller) -> dict[str, float]:
    """Return a controller's numbers by Table 1's names, in milliseconds; none where a dash is."""
    found: dict[str, float] = {}
    rows = dict(zip(NAMES[::5], (controller.joint1, controller.joint2), strict=True))
    for first, gains in rows.items():
        k1, nu1, k2, nu2, k3 = NAMES[NAMES.index(first) :][:5]
        for k, nu, gain, order in ((k1, nu1, gains.k1, gains.nu1), (k2, nu2, gains.k2, gains.nu2)):
            found[k] = gain * 1000.0 ** (order or 0.0)
            if order is not None:
                found[nu] = order
        found[k3] = gains.k3
    return found


def leading(controller: Controller, time_unit: float) -> tuple[float, float]:
    """Return k_1 and k_4 with time counted in `time_unit` seconds."""
    one, two = controller.joint1, controller.joint2
    assert one.nu1 is not None
    assert two.nu1 is not None
    return one.k1 * time_unit**-one.nu1, two.k1 * time_unit**-two.nu1


@pytest.mark.parametrize(
    ("figure", "first", "second"),
    [("figure-3", 6196, 92), ("figure-4", 9331, 125), ("figure-5", 8294, 138)],
)
def test_leading_gains_in_milliseconds_lie_within_table_1(
    figure: str, first: float, second: float
) -> None:
    k1, k4 = leading(TABLE_2[figure], 1e-3)
    assert k1 == pytest.approx(first, abs=HALF_DIGIT)
    assert k4 == pytest.approx(second, abs=HALF_DIGIT)
    assert abs(k1 - K1_MEAN) < 2.0 * K1_SD
    assert abs(k4 - K4_MEAN) < 2.0 * K4_SD


def test_leading_gains_in_seconds_do_not() -> None:
    """Negative control: as printed, all six lie more than four deviations off."""
    for controller in TABLE_2.values():
        k1, k4 = leading(controller, 1.0)
        assert abs(k1 - K1_MEAN) > 4.0 * K1_SD
        assert abs(k4 - K4_MEAN) > 4.0 * K4_SD


def test_which_numbers_of_table_2_are_table_1s_and_which_are_not() -> None:
    """25 numbers, 17 within two deviations, 8 beyond three: the zeros and Figure 4's k3, k5, k6."""
    table_1 = dict(zip(NAMES, TABLE_1.draws, strict=True))
    outside, count = set(), 0
    for figure, controller in TABLE_2.items():
        found = numbers(controller)
        assert found.keys() == DEVIATIONS[figure].keys()
        for name, number in found.items():
            mean, deviation = table_1[name].numbers
            apart = (number - mean) / deviation
            assert apart == pytest.approx(DEVIATIONS[figure][name], abs=HUNDREDTH), name
            assert abs(apart) < 2.0 or abs(apart) > 3.0
            count += 1
            if abs(apart) > 3.0:
                outside.add((figure, name))
    assert outside == OUTSIDE and (count, len(outside)) == (25, 8)


def test_zeros_are_exact_and_no_draw_or_mutation_gives_one() -> None:
    """Their terms are absent from the filters; Table 1's mean would be ten deviations away."""
    for figure, name in OUTSIDE:
        if (figure, name) != ("figure-4", "k5") and name in ("k2", "k5"):
            assert numbers(TABLE_2[figure])[name] == 0.0
            assert dict(zip(NAMES, TABLE_1.draws, strict=True))[name].numbers == (1.0, 0.1)


@pytest.mark.parametrize("figure", AT_REST)
def test_number_of_taps_decides_the_gain_at_rest(figure: str) -> None:
    """p = 10 of (2) is eleven taps; with ten, C_1 of Figure 5 has the wrong sign at rest."""
    (longest, _), _ = TABLE_2[figure].filters(T, terms=12)
    for p, gain in zip(range(8, 13), AT_REST[figure], strict=True):
        (b, _), _ = TABLE_2[figure].filters(T, terms=p)
        np.testing.assert_array_equal(b, longest[: p + 1])
        assert b.sum() == pytest.approx(gain, rel=THREE_DIGITS)
        shown = f"{gain:.2e}".replace("e+06", "e6") if abs(gain) > 1e5 else f"{gain:.0f}"
        assert shown in README
    assert TABLE_2[figure].filters(T)[0][0].size == 11


@pytest.mark.parametrize(
    ("symbol", "name", "rows"), [("k", "k", 6), ("\N{GREEK SMALL LETTER NU}", "nu", 3)]
)
def test_the_readme_has_the_table_of_deviations(symbol: str, name: str, rows: int) -> None:
    found = re.findall(rf"^\| {symbol}_(\d) \|(.*)\|$", README, re.MULTILINE)
    assert len(found) == rows
    for number, cells in found:
        shown = [cell.strip().strip("*").split(" ")[0].strip("*") for cell in cells.split("|")]
        for figure, text in zip(DEVIATIONS, shown[1::2], strict=True):
            expected = DEVIATIONS[figure].get(f"{name}{number}")
            assert (float(text) if text else None) == expected, (figure, number)


@pytest.mark.parametrize(("figure", "dc_gain"), [("figure-3", 2.3e6), ("figure-4", 3.2e6)])
def test_first_controllers_are_eleven_growing_positive_taps(figure: str, dc_gain: float) -> None:
    (b, a), _ = TABLE_2[figure].filters(T)
    assert b.shape == (11,)
    assert np.array_equal(a, [1.0])
    assert (b > 0.0).all()
    assert (np.diff(b) > 0.0).all()
    assert b.sum() == pytest.approx(dc_gain, rel=TWO_DIGITS)
    mean_delay = b @ np.arange(11) / b.sum()  # [samples]
    assert mean_delay == pytest.approx(8.0, abs=HALF_DIGIT)


def test_figure_5_is_no_such_thing() -> None:
    """Its order is positive: alternating taps."""
    (b, _), _ = TABLE_2["figure-5"].filters(T)
    assert np.array_equal(np.sign(b), (-1.0) ** np.arange(11))


def test_the_second_nu_4_is_nu_5() -> None:
    gains = TABLE_2["figure-4"].joint2
    assert (gains.k2, gains.nu2) == (1.6106, 0.0101)


@pytest.mark.parametrize(
    "controller", [*TABLE_2.values(), *TUNED_IDEAL.values()], ids=lambda c: c.name
)
@pytest.mark.parametrize("realisation", REALISATIONS)
def test_every_controller_builds_in_every_realisation(
    controller: Controller, realisation: str
) -> None:
    for b, a in controller.filters(T, realisation, terms=3):
        assert np.isfinite(b).all()
        assert np.isfinite(a).all()
        assert a[0] == 1.0


def test_tuned_controllers_use_both_operators() -> None:
    for shape, controller in TUNED_IDEAL.items():
        for gains in (controller.joint1, controller.joint2):
            assert gains.k1 != 0.0
            assert gains.k2 != 0.0
        assert (
            controller.source
            == f"flexsim tune --trajectory {shape} --plant both --setting jump --seed 2"
        )


def test_names_are_the_keys_and_nothing_can_be_changed() -> None:
    assert list(TABLE_2) == ["figure-3", "figure-4", "figure-5"]
    assert list(TUNED_IDEAL) == ["line", "two-loop", "circle"]
    for table in (TABLE_2, TUNED_IDEAL):
        prefix = "ideal-" if table is TUNED_IDEAL else ""
        assert all(controller.name == prefix + name for name, controller in table.items())
        with pytest.raises(TypeError):
            table["mine"] = TABLE_2["figure-3"]  # type: ignore[index]
    with pytest.raises(dataclasses.FrozenInstanceError):
        TABLE_2["figure-3"].name = "other"  # type: ignore[misc]


def test_unknown_realisation_is_an_error() -> None:
    with pytest.raises(ControllerError, match="unknown realisation"):
        TABLE_2["figure-3"].filters(T, "none")
