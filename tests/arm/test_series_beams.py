"""Two beams in series: published frequencies, and the paper's arm where link 1 is stiff."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flexsim.arm.arms import ARMS, MOTOR_2, PUBLISHED_HZ, Arm, FirstLink, named_arm
from flexsim.arm.beam import beta_lengths, load_of
from flexsim.arm.free_arm import joint_free_frequencies
from flexsim.arm.parameters import Parameters
from flexsim.arm.series_beams import series_frequencies
from flexsim.errors import ParameterError

HERTZ = 1 / (2 * np.pi)
LAST_DIGIT = 0.005 + 1e-9  # of what is published with two decimals
STIFF = 2e5  # [N m2] of link 1: its own modes are far above, its bending 1e-6 of the beam's
AS_STIFF = 2e-5  # relative, what is left of it in the third frequency


def test_each_links_frequencies_are_those_published() -> None:
    """With locked joints, what is carried rigid: De Luca and Siciliano (1991)."""
    arm = named_arm("two-flexible")
    p = arm.parameters
    for own, load, published in (
        (arm.beam1, arm.load1, PUBLISHED_HZ[0]),
        (p, load_of(p), PUBLISHED_HZ[1]),
    ):
        unit = np.sqrt(own.EI / own.rho) / own.L**2 * HERTZ
        found = np.array(beta_lengths(2, load)) ** 2 * unit
        assert found == pytest.approx(published, abs=LAST_DIGIT)


def test_link_1_alone_where_link_2_is_stiff() -> None:
    """Joints locked at a right angle: the published boundary conditions of link 1, another way."""
    arm = named_arm("two-flexible")
    stiff = replace(arm, parameters=replace(arm.parameters, EI=STIFF))
    found = series_frequencies(stiff.locked(["joint1", "joint2"]), 2, np.pi / 2) * HERTZ
    assert found == pytest.approx(PUBLISHED_HZ[0], abs=LAST_DIGIT)
    straight = series_frequencies(stiff.locked(["joint1", "joint2"]), 2, 0.0) * HERTZ
    assert abs(straight[1] - PUBLISHED_HZ[0][1]) > 10 * LAST_DIGIT  # what it carries is off-centre


@pytest.mark.parametrize("theta2", [0.0, 1.2])
def test_a_stiff_link_1_is_the_papers(theta2: float) -> None:
    p = Parameters()
    arm = Arm(p, FirstLink(EI=STIFF, rho=0.1, r=0.02))
    found, exact = series_frequencies(arm, 3, theta2), joint_free_frequencies(p, 3, theta2)
    assert found == pytest.approx(exact, rel=AS_STIFF)
    softer = Arm(p, FirstLink(EI=0.5, rho=0.1, r=0.02))
    assert series_frequencies(softer, 1, theta2)[0] < 0.99 * exact[0]


def test_one_link_is_the_second_of_the_two() -> None:
    two, one = named_arm("two-flexible").parameters, named_arm("one-link").parameters
    assert replace(one, I_m1=two.I_m1, I_m2=MOTOR_2) == two


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (lambda: named_arm("three-link"), "choose one of paper, one-link, two-flexible"),
        (lambda: named_arm("paper").beam1, "link 1 is rigid"),
        (lambda: FirstLink(EI=0.0, rho=0.1), "EI 0.0; give a finite number, more than 0"),
        (lambda: FirstLink(EI=1.0, rho=0.1, r=-1.0), "r -1.0; give"),
        (lambda: FirstLink(EI=1.0, rho=0.1, zeta=2.0), "zeta 2.0; give a fraction"),
        (lambda: Arm(Parameters(), FirstLink(1.0, 0.1, r=0.4)), "less than its length"),
        (lambda: Arm(Parameters(), FirstLink(1.0, 1e3)), "give 22.9 kg/m at most"),
        (lambda: series_frequencies(ARMS["two-flexible"], 0), "1 or more"),
    ],
)
def test_what_cannot_be_is_one_line(wrong, said: str) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(ParameterError, match=said):
        wrong()
