"""Two clocks: a control period is a whole number of physics steps, or refused by name.

>>> whole_substeps(1e-3, 2.5e-4)
4
"""

from __future__ import annotations

import math

from flexsim.errors import ParameterError

PERIOD = 1e-3  # [s] control period of the paper
PERIOD_TOLERANCE = 1e-9  # relative, on period/step being a whole number


def whole_substeps(period: float, step: float) -> int:
    """Return how many physics steps make one control period.

    Raises:
        ParameterError: none or not a whole number do; the message names both.
    """
    if not (0 < period < math.inf and 0 < step < math.inf):
        raise ParameterError(f"control period {period} s and physics step {step} s must be over 0")
    ratio = period / step
    if round(ratio) < 1 or abs(ratio - round(ratio)) > PERIOD_TOLERANCE * ratio:
        raise ParameterError(
            f"control period {period:g} s is not a whole multiple of the physics step {step:g} s; "
            f"choose a step such as {period / max(1, math.ceil(ratio)):g} s"
        )
    return round(ratio)
