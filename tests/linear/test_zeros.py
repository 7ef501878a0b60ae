"""Zeros between torques and errors: closed form, every form of the plant, and poles near them."""

import math
from dataclasses import replace

import numpy as np
import pytest

from controllers import TUNED_IDEAL
from flexsim import ParameterError, Parameters
from flexsim.arm.parameters import paper
from flexsim.linear.exact_loop import exact_plant, exact_sampled
from flexsim.linear.loop_poles import LinearLoop, LoopOptions
from flexsim.linear.zeros import (
    damped_rate,
    error_rows,
    held_equation,
    held_motions,
    mirrored_frequency,
    sampled_zeros,
    transmission_zeros,
)
from flexsim.loop.control.stacking import stack
from flexsim.loop.hardware import Hardware
from flexsim.plants.chain_plant import ChainPlant
from flexsim.plants.modes_plant import AssumedModesPlant

PERIOD = 1e-3
ROBOT = Parameters()
REACH = ROBOT.reach
MODES = 1e-6  # relative: twelve modes against the beam
CHAIN = 2e-5  # relative: six segments, tuned
CLAMPED = (3.33729, 20.91443)  # [Hz]


def of_root(parameters: Parameters, b: complex) -> complex:
    """Return s of a motion with wave number b / L: s^2 = -EI b^4 / (rho L^4)."""
    return 1j * (b / parameters.L) ** 2 * math.sqrt(parameters.EI / parameters.rho)


@pytest.mark.parametrize("theta2", [0.4, 1.5, 2.6])
def test_the_mirrored_tips_zero_is_the_closed_forms(theta2: float) -> None:
    found = held_motions(exact_plant(paper()).linearised(theta2), REACH)
    omega = mirrored_frequency(paper())
    assert omega / (2 * math.pi) == pytest.approx(2.25517, abs=1e-5)
    assert found[0] == pytest.approx(1j * omega, rel=MODES)
    for zero in found[:3]:
        b = ROBOT.L * math.sqrt(zero.imag * math.sqrt(ROBOT.rho / ROBOT.EI))
        sides = [held_equation(complex(b + by), ROBOT.r / ROBOT.L).real for by in (-1e-3, 1e-3)]
        assert sides[0] * sides[1] < 0  # a root of the beam's equation


def test_one_mode_is_nearly_enough() -> None:
    """Its mass is rho L and, since the hub turns by v/(r+L), rho int x chi times chi(tip)/(r+L)."""
    p = AssumedModesPlant(paper(), 1).coefficients
    joined = paper().rho * 0.1715687 * 2 / REACH
    expected = math.sqrt(p.stiffness[0] / (paper().rho * paper().L + joined))
    found = held_motions(AssumedModesPlant(paper(), 1).linearised(1.2), REACH)[0]
    assert found.imag == pytest.approx(expected, rel=1e-6)
    assert expected == pytest.approx(mirrored_frequency(paper()), rel=1e-3)


@pytest.mark.parametrize("zeta", [1e-3, 5e-3, 2e-2])
def test_only_the_beam_damps_it(zeta: float) -> None:
    robot = Parameters(zeta=zeta, F_1=0.5, F_2=0.5, I_H=0.02, I_m2=0.1, L_R=0.5)  # none matters
    omega = mirrored_frequency(robot)
    expected = damped_rate(robot, omega)
    assert expected.real == pytest.approx(-zeta * omega**2 / 20.96880, rel=1e-5)
    found = held_motions(exact_plant(robot).linearised(1.2), robot.reach)[0]
    assert found == pytest.approx(expected, rel=MODES)


def test_ignoring_v_gives_the_clamped_beam() -> None:
    found = held_motions(exact_plant(paper()).linearised(1.2), REACH, v_gain=0.0)
    assert found.imag[:2] / (2 * math.pi) == pytest.approx(CLAMPED, rel=1e-4)
    for zero in found[:2]:
        b = ROBOT.L * math.sqrt(zero.imag * math.sqrt(ROBOT.rho / ROBOT.EI))
        assert abs(held_equation(b, ROBOT.r / ROBOT.L, 0.0)) < 1e-3


def test_the_true_tip_has_zeros_that_grow() -> None:
    """The true tip, v_gain = 1: pairs +-s, which no stable loop of high gain can have."""
    found = transmission_zeros(exact_plant(paper()).linearised(1.2), REACH, v_gain=1.0)
    first = found[:2]
    assert np.abs(first.imag).max() < 1e-6 * np.abs(first).max()
    assert sorted(first.real) == pytest.approx([-abs(first[0]), abs(first[0])], rel=1e-6)
    size = ROBOT.L * math.sqrt(abs(first[0]) * math.sqrt(ROBOT.rho / ROBOT.EI))
    sides = [
        held_equation(x * np.exp(0.25j * np.pi), ROBOT.r / ROBOT.L, 1.0)
        for x in (0.98 * size, size, 1.02 * size)
    ]
    assert abs(sides[1]) < 0.05 * min(abs(sides[0]), abs(sides[2]))
    mirrored = transmission_zeros(exact_plant(paper()).linearised(1.2), REACH)
    assert np.abs(mirrored.real).max() < 1e-6 * np.abs(mirrored).max()  # none of the mirrored tip


def test_the_chain_has_it_too() -> None:
    found = held_motions(ChainPlant.designed(ROBOT).linearised(1.5), REACH)[0]
    assert found.imag == pytest.approx(mirrored_frequency(ROBOT), rel=CHAIN)


def test_errors_stay_zero_in_such_a_motion() -> None:
    linear = exact_plant(ROBOT).linearised(1.5)
    s = held_motions(linear, REACH)[0]
    pencil = np.zeros((len(linear.M) + 2, len(linear.M) + 2), dtype=complex)
    m = len(linear.M)
    pencil[:m, :m] = linear.M * s**2 + linear.D * s + linear.K
    pencil[:m, m:] = -linear.S
    pencil[m:, :m] = error_rows(linear, REACH)
    assert np.linalg.svd(pencil / np.abs(pencil).max(axis=1, keepdims=True))[1][-1] < 1e-9
    nearby = pencil.copy()
    nearby[:m, :m] = linear.M * (1.01 * s) ** 2 + linear.D * 1.01 * s + linear.K
    sizes = np.linalg.svd(nearby / np.abs(nearby).max(axis=1, keepdims=True))[1]
    assert sizes[-1] > 1e-7


def test_sampling_leaves_it_where_it_is() -> None:
    zeros = sampled_zeros(exact_sampled(ROBOT, 1.5, LoopOptions()))
    assert len(zeros) == 26
    s = np.log(zeros[np.argmax(zeros.imag * (np.abs(zeros - 1) < 0.05))]) / PERIOD
    assert s == pytest.approx(damped_rate(ROBOT, mirrored_frequency(ROBOT)), rel=1e-5)


def test_high_gain_drives_a_pole_onto_it() -> None:
    sampled = exact_sampled(ROBOT, 1.5, LoopOptions())
    zero = damped_rate(ROBOT, mirrored_frequency(ROBOT))
    one = stack([TUNED_IDEAL["line"]], PERIOD)
    apart = []
    for factor in (0.3, 1.0, 3.0, 10.0):
        poles = LinearLoop(sampled, one._replace(b=factor * one.b)).poles
        apart.append(float(np.abs(np.log(poles[poles != 0]) / PERIOD - zero).min()))
    order = np.polyfit(np.log([0.3, 1.0, 3.0, 10.0]), np.log(apart), 1)[0]
    assert order == pytest.approx(-1.0, abs=0.05)


def test_what_cannot_be_used_is_refused() -> None:
    with pytest.raises(ParameterError, match="payload"):
        mirrored_frequency(replace(ROBOT, payload=0.05))
    with pytest.raises(ParameterError, match="delay"):
        sampled_zeros(exact_sampled(ROBOT, 1.5, LoopOptions(hardware=Hardware(delay=1))))
