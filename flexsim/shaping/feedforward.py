"""What to add to a reference, so that given filters command a given torque through friction.

    >>> errors = errors_for(filters, motor_torque(friction, torque, rates))  # (K, 2) [rad]

Friction's dead zone stands in the way: torques inside it move nothing. A dither takes it away: a
tone at a quarter of the sampling rate, every level of which lies outside the dead zone. The mean
over its four samples then rises with what is added to it, with the slope mu of (47), while the
tone itself is too fast for the arm: it shakes the hub by a milliradian or two and the tip by a
tenth or two of a millimetre. Torque limits are not looked at: what the limits of a setting cut off
is missing from the motion.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexsim.errors import ParameterError
from flexsim.loop.friction import LAWS, RESISTING, Friction, driving
from flexsim.numerics.jit import jit
from flexsim.numerics.types import Array
from flexsim.shaping.spectra import filter_responses, scaled

Filters = Sequence[tuple[Array, Array]]

NOTHING = 1e-9  # relative to its largest: a filter's response that cannot be inverted
TONE = np.array([1.0, -0.5, -1.0, 0.5])  # four samples a turn: no mean, nothing that beats
PEAK = 2.5  # of the dead zone's wider edge, so that the lower levels, 1.25, lie outside too
RAMP = 0.1  # [s] in which the tone grows: the start is at rest on the reference
GRID = 20_001  # torques at which the mean over the tone is tabulated, to be inverted
MARGIN = 1.1  # the table reaches beyond the largest torque by as much


def errors_for(filters: Filters, torque: Array) -> Array:
    """Return the errors (K, 2) [rad] that make two filters give a torque (K, 2), at rest outside.

    Raises:
        ParameterError: a filter lets a frequency through by less than NOTHING of its most.
    """
    errors = np.empty_like(torque)
    for j, (b, a) in enumerate(filters):
        above, below = (
            filter_responses(np.ascontiguousarray(taps, dtype=float), len(torque))
            for taps in (b, a)
        )
        if np.abs(above).min() <= NOTHING * np.abs(above).max():
            raise ParameterError(
                f"the filter of joint {j + 1} passes nothing at some frequency, so it has no "
                "inverse; leave the filters out, or add a proportional part"
            )
        spectrum = scaled(np.fft.rfft(torque[:, j]), below, above)
        errors[:, j] = np.fft.irfft(spectrum, n=len(torque))
    return errors


def motor_torque(friction: Friction, torque: Array, rates: Array) -> Array:
    """Return the commands (K, 2) that bring a torque (K, 2) to the joints, dead zone apart [N m].

    Args:
        rates: (K, 2) of the joints [rad/s]. Laws 'simulink' and 'jump' are left alone: (47) has
            no inverse.
    """
    if friction.law not in RESISTING:
        return torque.copy()
    return torque + friction.coulomb(rates) + np.array(friction.mu) * rates


def dithered_torque(
    friction: Friction, torque: Array, rates: Array, period: float, start: int
) -> Array:
    """Return commands (K, 2) whose means over the tone bring a torque (K, 2) to the joints [N m].

    Args:
        rates: (K, 2) of the joints [rad/s]. period: [s].
        start: sample from which the tone grows, over RAMP.

    Without friction these are the torques themselves. A command of more than a quarter of the
    dead zone takes levels back into it, where the mean jumps: the nearest end of a jump is taken,
    and the loop does the rest.
    """
    commands = motor_torque(friction, torque, rates)
    if friction.law == "none":
        return commands
    since = np.arange(len(torque)) - start
    growth = np.clip(since * period / RAMP, 0, 1)
    for j, (low, high) in enumerate(friction.dead_zone):
        peak, tau_0, mu = PEAK * max(-low, high), friction.tau_0[j], friction.mu[j]
        most = MARGIN * (np.abs(commands[:, j]).max() + peak)
        if friction.law in ("simulink", "jump") and mu > 0:  # the mean's least slope
            most /= min(mu, 1.0)
        table = np.linspace(-most, most, GRID)
        law, levels = LAWS.index(friction.law), peak * TONE
        passed = _mean_over_tone(law, table, levels, low, high, tau_0, mu)
        commands[:, j] = np.interp(commands[:, j], passed, table)
        commands[:, j] += growth * levels[since % len(TONE)]
    return commands


@jit
def _mean_over_tone(law, command, levels, low, high, tau_0, mu):  # type: ignore[no-untyped-def]
    """Return what a joint's dead zone and (47) pass of commands (N,) in the tone's mean (N,)."""
    mean = np.zeros(len(command))
    for k in range(len(command)):
        for level in levels:
            mean[k] += driving(law, command[k] + level, low, high, tau_0, mu)
    return mean / len(levels)


def dead_zone_error(filters: Filters, friction: Friction) -> Array:
    """Return the joint errors (2,) at rest that friction's dead zone hides from the motors [rad].

    The larger end of each dead zone over the filter's gain at zero frequency; 0 with an
    integrator. Times r + L, the second is about what no smooth reference can take off the tip's
    error; one with a dither can.

    Raises:
        ParameterError: a filter passes no constant error.
    """
    hidden = np.zeros(2)
    for j, (b, a) in enumerate(filters):
        if np.sum(b) == 0:
            raise ParameterError(f"the filter of joint {j + 1} passes no constant error")
        if friction.law != "none":
            hidden[j] = max(-friction.dead_zone[j][0], friction.dead_zone[j][1])
            hidden[j] *= abs(np.sum(a) / np.sum(b))
    return hidden
