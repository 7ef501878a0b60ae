"""PDs on both joints, and the beam's deflection v fed back to the torques, with its rate.

    A, B, C, D = design([60.0, 60.0, 0.3, 0.3, 500.0, 0.0, 0.3, 0.0], model)

With s = v/(r+L) and D the filtered derivative, tau_1 and tau_2 are

    J_11 (w_1^2 + 2 z_1 w_1 D) e_1 - J_22 share_1 (position w_2^2 + rate 2 z_2 w_2 D) s
    J_22 (w_2^2 + 2 z_2 w_2 D) e_2 - J_22 (position w_2^2 + rate 2 z_2 w_2 D) s

so that the PD of joint 2 is on the joint with position and rate 0, on the tip with 1, and on the
mirrored tip of the paper with -1. Strain feedback proper is in it: a joint whose *rate* follows the
strain damps the beam, and behind a joint's D that is a torque in proportion to v.

Assumed: v stands for the strain at the clamp, to which it is in proportion in the first mode and
under a force at the tip; the paper measures no strain. Only J, r + L and the period are read of the
model: neither modes nor delay, so that nothing says that the loop is stable.

Source: Z.-H. Luo, Direct strain feedback control of flexible robot arms: new theoretical and
experimental results, IEEE Trans. Automatic Control 38 (1993) 1610-1622, where the motor's rate
follows the strain; title and pages from memory, not checked against the print. That bending strain
fed back damps the arm is restated in Z.-H. Luo and B.-Z. Guo, Shear force feedback control of a
single-link flexible robot with a revolute joint, IEEE Trans. Automatic Control 42 (1997) 53.
"""

from collections.abc import Sequence

import numpy as np

from controllers.knobs import Knob
from controllers.model_based.model import LinearModel, Space, read_knobs, shortened
from controllers.series import Array

KNOBS = (
    Knob("bandwidth_1", "rad/s", 15.0, 250.0, True),
    Knob("bandwidth_2", "rad/s", 15.0, 250.0, True),
    Knob("damping_1", "-", 0.05, 1.0, True),
    Knob("damping_2", "-", 0.05, 1.0, True),
    Knob("filter", "rad/s", 150.0, 1500.0, True),
    Knob("position", "-", -1.0, 1.0, False),
    Knob("rate", "-", -1.0, 1.0, False),
    Knob("share_1", "-", -1.0, 1.0, False),
)
"""Both joints' bandwidths and damping ratios, the arm taken as rigid; the corner of all filters of
derivatives; shares of v and of its rate in joint 2's error, and of joint 1 in that torque."""


def design(knobs: Sequence[float], model: LinearModel) -> Space:
    """Return (A, B, C, D) from (e1, e2, v) to two torques: A (3, 3), B (3, 3), C (2, 3), D (2, 3).

    The states are filtered measurements, one each.

    Args:
        knobs: in the order of `KNOBS`. model: whose J, reach and period count.

    Raises:
        ControllerError: a knob is missing or out of its range.
    """
    w1, w2, zeta1, zeta2, corner, position, rate, share = read_knobs(knobs, KNOBS)
    J1, J2 = float(model.J[0, 0]), float(model.J[1, 1])
    s = J2 / model.reach  # of v, to an angle
    P = np.array(
        [
            [J1 * w1**2, 0.0, -share * position * s * w2**2],
            [0.0, J2 * w2**2, -position * s * w2**2],
        ]
    )
    R = np.array(
        [
            [J1 * 2 * zeta1 * w1, 0.0, -share * rate * s * 2 * zeta2 * w2],
            [0.0, J2 * 2 * zeta2 * w2, -rate * s * 2 * zeta2 * w2],
        ]
    )
    A, B, C, D = with_rates(P, R, model.period, 1.0 / corner)
    return shortened(A), shortened(B), shortened(C), shortened(D)


def with_rates(P: Array, R: Array, period: float, filter_time: float) -> Space:
    """Return P y + R y', the rate by a filtered backward difference as `controllers.textbook_pid`.

    Args:
        P, R: (m, p), gains of p measurements and of their rates.
        period, filter_time: [s].
    """
    p = P.shape[1]
    pole = filter_time / (period + filter_time)
    slope = 1.0 / (period + filter_time)
    # rate of y by (1 - 1/z) slope / (1 - pole/z): the state is z1' = (pole - 1) slope y + pole z1
    A = pole * np.eye(p)
    B = (pole - 1.0) * slope * np.eye(p)
    return A, B, R.copy(), P + slope * R
