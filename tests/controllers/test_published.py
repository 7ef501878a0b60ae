"""The controllers of Table 2 against the paper's tables, and our own tuned ones."""

import dataclasses

import numpy as np
import pytest

from controllers import REALISATIONS, TABLE_2, TUNED, Controller, ControllerError

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


@pytest.mark.parametrize("controller", [*TABLE_2.values(), *TUNED.values()], ids=lambda c: c.name)
@pytest.mark.parametrize("realisation", REALISATIONS)
def test_every_controller_builds_in_every_realisation(
    controller: Controller, realisation: str
) -> None:
    for b, a in controller.filters(T, realisation, terms=3):
        assert np.isfinite(b).all()
        assert np.isfinite(a).all()
        assert a[0] == 1.0


def test_tuned_controllers_use_both_operators() -> None:
    for controller in TUNED.values():
        for gains in (controller.joint1, controller.joint2):
            assert gains.k1 != 0.0
            assert gains.k2 != 0.0
        assert (
            controller.source
            == f"flexsim tune --trajectory {controller.name} --plant both --setting jump --seed 2"
        )


def test_names_are_the_keys_and_nothing_can_be_changed() -> None:
    assert list(TABLE_2) == ["figure-3", "figure-4", "figure-5"]
    assert list(TUNED) == ["line", "two-loop", "circle"]
    for table in (TABLE_2, TUNED):
        assert all(controller.name == name for name, controller in table.items())
        with pytest.raises(TypeError):
            table["mine"] = TABLE_2["figure-3"]  # type: ignore[index]
    with pytest.raises(dataclasses.FrozenInstanceError):
        TABLE_2["figure-3"].name = "other"  # type: ignore[misc]


def test_unknown_realisation_is_an_error() -> None:
    with pytest.raises(ControllerError, match="unknown realisation"):
        TABLE_2["figure-3"].filters(T, "none")
