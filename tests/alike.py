"""Texts with numbers, held against one another as numbers: the last digit is the machine's."""

from __future__ import annotations

import math
import re

NUMBER = re.compile(r"(?<![\w.])[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?(?![\w.])")
ROUNDING = 1e-11  # relative: files have 12 digits, of which the last may be rounded either way
NOTHING = 1e-15  # what is left where a number should be zero


def require_alike(found: str, wanted: str) -> None:
    """Hold two texts against one another: the same words, and numbers the same to 11 digits."""
    assert NUMBER.sub("#", found) == NUMBER.sub("#", wanted)
    for one, two in zip(NUMBER.findall(found), NUMBER.findall(wanted), strict=True):
        assert math.isclose(float(one), float(two), rel_tol=ROUNDING, abs_tol=NOTHING), (one, two)
