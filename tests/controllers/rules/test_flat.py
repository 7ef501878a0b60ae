"""Flat phase: conditions met exactly, the published example, iso-damping, refusals."""

import math

import numpy as np
import pytest

from controllers import ControllerError
from controllers.rules.flat import design, flat_phase, joint_gains
from controllers.rules.joint import ideal, rigid_joint

PERIOD = 1e-3
EXACT = 1e-8
FLAT = 1e-4  # [rad] by which the phase changes 1 % beside the crossing, in second order
NEAR_PRINT = 0.015  # relative: the published numbers are read off a figure


def motor(omega, time=0.4):
    """1 / (s (0.4 s + 1))."""
    s = 1j * np.asarray(omega)
    return 1 / (s * (time * s + 1))


def of_motor(omega_c, phi_m, time=0.4):
    lag = omega_c * time
    slope = -time / (1 + lag**2)
    return flat_phase(
        -math.pi / 2 - math.atan(lag), slope, abs(motor(omega_c, time)), omega_c, phi_m
    )


def test_the_published_example():
    """10 rad/s and 70 degrees: mu 0.844, Kd 0.369, Kp 13.86 in the paper's digits."""
    found = of_motor(10.0, math.radians(70))
    numbers = found.nu1, found.k1 / found.k3, found.k3
    np.testing.assert_allclose(numbers, (0.844, 0.369, 13.86), rtol=NEAR_PRINT)


@pytest.mark.parametrize("omega_c", [5.0, 10.0, 30.0])
@pytest.mark.parametrize("degrees", [45, 60, 70])
def test_crossing_margin_and_flatness_are_exact(omega_c, degrees):
    found = of_motor(omega_c, math.radians(degrees))
    loop = ideal(found, omega_c) * motor(omega_c)
    assert abs(loop) == pytest.approx(1.0, rel=EXACT)
    assert math.degrees(np.angle(-loop)) == pytest.approx(degrees, abs=1e-6)
    near = [np.angle(ideal(found, w) * motor(w) / loop) for w in (0.999 * omega_c, 1.001 * omega_c)]
    assert abs(near[1] - near[0]) < 1e-8  # a phase not flat changes by 1e-3 and more


def test_a_joint_keeps_its_margin_under_a_payload_and_an_ordinary_lead_does_not():
    omega_c, phi_m, inertia = 40.0, 0.8, 0.3
    plant = rigid_joint(inertia, PERIOD, None)
    found = joint_gains((omega_c, phi_m), inertia, PERIOD)
    lead = (omega_c * plant.delay + phi_m, 1.0)  # of 1 + Kd s, which leads as much
    slope = math.tan(lead[0]) / omega_c
    spreads = []
    for controller in (lambda w: ideal(found, w), lambda w: 1 + 1j * w * slope):
        omega = np.geomspace(1 / 1.15, 1.15, 31) * omega_c  # where a payload moves the crossing to
        margins = [np.angle(-controller(w) * complex(plant.response(w))) for w in omega]
        assert margins[15] == pytest.approx(phi_m, abs=2e-3)
        spreads.append(np.ptp(margins))
    assert spreads[0] < 0.01 and spreads[1] > 4 * spreads[0]


@pytest.mark.parametrize("omega_c, phi_m", [(15.0, 0.5), (40.0, 0.8), (80.0, 1.0)])
def test_digital_controllers_have_crossing_and_margin(omega_c, phi_m):
    """Half a sample of the hold, and one of computing, are the dead time of the rule."""
    for built, inertia in zip(
        design([omega_c, phi_m] * 2, (0.3, 0.01), PERIOD), (0.3, 0.01), strict=True
    ):
        plant = rigid_joint(inertia, PERIOD, None)
        loop = built.response(omega_c, PERIOD)[0] * complex(plant.response(omega_c))
        assert abs(loop) == pytest.approx(1.0, rel=EXACT)
        assert np.angle(-loop) == pytest.approx(phi_m, abs=0.03)


@pytest.mark.parametrize(
    ("call", "named"),
    [
        (lambda: flat_phase(-math.pi, 0.0, 1.0, 10.0, 0.8), "no order"),  # without a lag
        (lambda: flat_phase(-0.5, -0.1, 1.0, 10.0, 0.8), "of lead"),  # needs a lag
        (lambda: flat_phase(-2 * math.pi, -0.1, 1.0, 10.0, 0.8), "of lead"),
        (lambda: flat_phase(-math.pi, -50.0, 1.0, 10.0, 0.8), "no order"),
        (lambda: flat_phase(-math.pi, -0.1, 0.0, 10.0, 0.8), "magnitude"),
        (lambda: joint_gains((40.0,), 0.3, PERIOD), "give omega_c, phi_m"),
        (lambda: joint_gains((-4.0, 0.8), 0.3, PERIOD), "omega_c must be above zero"),
        (lambda: design([3000.0, 0.8] * 2, (0.3, 0.01), PERIOD), "of lead|no order|omega_c"),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(call, named):
    with pytest.raises(ControllerError, match=named) as caught:
        call()
    assert "\n" not in str(caught.value)
