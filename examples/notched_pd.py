"""A controller of your own: a PD at each joint, with a notch at a vibration of the arm.

    flexsim run examples/notched_pd.toml --out runs/notched

Does the notch help? It takes the loop's gain at that frequency, and phase below it. What a study
file names is a function like `design`: from the period, the robot and the file's own options to
what the loop takes, here a filter (b, a) for each joint.
"""

from __future__ import annotations

from scipy.signal import iirnotch

from controllers.series import Filter, convolve
from controllers.shaped import pd
from flexsim import Parameters, Robot

POSE = 1.5  # [rad] theta2 in the middle of the work
LEAD = 0.9  # [rad] of the derivative at the bandwidth
ROLL_OFF = 10.0  # where the derivative ends, in bandwidths


def design(
    period: float,
    parameters: Parameters,
    bandwidth: float,
    notch_hz: float | None = None,
    quality: float = 2.0,
) -> tuple[Filter, Filter]:
    """Return the controllers of both joints.

    Args:
        period: [s]. parameters: of the robot. bandwidth: of both loops [rad/s].
        notch_hz: where gain is taken away [Hz], nowhere unless given. quality: of the notch.
    """
    linear = Robot(parameters).plant("assumed-modes:3").linearised(POSE)
    inertias = [float(linear.M[joint, joint]) for joint in (0, 1)]
    joint = (bandwidth, LEAD, ROLL_OFF)
    first, second = pd.design((*joint, *joint), inertias, period)
    if notch_hz is None:
        return first, second
    notch = iirnotch(notch_hz, quality, fs=1 / period)
    return in_series(first, notch), in_series(second, notch)


def in_series(one: Filter, other: Filter) -> Filter:
    """Return two filters one behind the other, as one."""
    return convolve(one[0], other[0]), convolve(one[1], other[1])
