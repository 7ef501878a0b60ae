"""PDs with the deflection fed back: known cases, closed forms, and that the rate damps the beam."""

import numpy as np
import pytest
from designs import PERIOD, arm_model, circle, response, rigid_model, same_set
from scipy import signal

from controllers import textbook_pid
from controllers.model_based import middle, pd_strain
from controllers.model_based.model import closed_loop, spectral_radius

NAMES = [knob.name for knob in pd_strain.KNOBS]
DIGITS = 1e-8  # relative: coefficients are shortened
FINE = 1e-5  # [s]


def knobs(**changed: float) -> list[float]:
    given = dict(zip(NAMES, middle(pd_strain.KNOBS), strict=True)) | changed
    return list(given.values())


def test_without_v_it_is_the_textbooks_pds() -> None:
    given, model = knobs(position=0.0, rate=0.0, damping_2=0.7), arm_model()
    z = circle()
    found = response(pd_strain.design(given, model), z)
    for j in (0, 1):
        w, zeta, inertia = given[j], given[2 + j], model.J[j, j]
        b, a = textbook_pid(inertia * w**2, 0.0, 2 * zeta * w * inertia, PERIOD, 1 / given[4])
        wanted = signal.freqz(b, a, np.angle(z))[1]
        assert found[:, j, j] == pytest.approx(wanted, rel=DIGITS)
        found[:, j, j] = 0.0
    assert not found.any()


@pytest.mark.parametrize("share", [1.0, -1.0, 0.5], ids=["tip", "mirrored", "between"])
def test_v_enters_the_error_of_joint_2(share: float) -> None:
    model, z = arm_model(), circle()
    given = knobs(position=share, rate=share, share_1=0.25)
    found = response(pd_strain.design(given, model), z)
    assert found[:, 1, 2] == pytest.approx(-share / model.reach * found[:, 1, 1], rel=DIGITS)
    assert found[:, 0, 2] == pytest.approx(0.25 * found[:, 1, 2], rel=DIGITS)


def test_a_rigid_joint_gets_its_bandwidth_and_damping() -> None:
    """The filter far beyond, the period short: s^2 + 2 zeta w s + w^2, each joint by itself."""
    model = rigid_model(FINE, np.diag([0.3, 0.01]))
    (w1, w2), (z1, z2) = (25.0, 20.0), (0.9, 0.3)
    given = knobs(bandwidth_1=w1, bandwidth_2=w2, damping_1=z1, damping_2=z2, filter=1500.0)
    controller = pd_strain.with_rates(
        np.diag([0.3 * w1**2, 0.01 * w2**2, 0.0])[:2],
        np.diag([0.6 * z1 * w1, 0.02 * z2 * w2, 0.0])[:2],
        FINE,
        1e-6,
    )
    poles = np.log(np.linalg.eigvals(closed_loop(controller, model)).astype(complex)) / FINE
    slow = poles[np.abs(poles) < 100.0]
    wanted = np.concatenate([np.roots([1.0, 2 * z * w, w**2]) for w, z in ((w1, z1), (w2, z2))])
    assert same_set(slow, wanted) < 0.05
    # and a filter at its highest is a little off, in the same place
    poles = np.log(np.linalg.eigvals(closed_loop(pd_strain.design(given, model), model))) / FINE
    assert same_set(poles[np.abs(poles) < 100.0], wanted) < 1.0


def test_the_rate_of_v_damps_the_beam_and_its_opposite_drives_it() -> None:
    model = arm_model()

    def growth(rate: float) -> float:
        controller = pd_strain.design(knobs(rate=rate), model)
        return float(np.log(spectral_radius(closed_loop(controller, model))) / PERIOD)

    without = growth(0.0)
    assert without < 0.0 and growth(0.2) < 2.5 * without
    assert growth(-0.2) > 0.1
