"""Digital filters that are kept as sections: sums of cascades of low-order `(b, a)`.

    filter = Sections((cascade, other))      # their sum
    filter.response(omega, period=1e-3)

A polynomial of many poles near z = 1 is rounded out of shape; a section keeps its poles.
"""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from controllers.response import frequency_response
from controllers.series import Filter

Cascade: TypeAlias = tuple[Filter, ...]


@dataclass(frozen=True, eq=False)
class Sections:
    """A filter as the sum of cascades, each one section or more in series."""

    cascades: tuple[Cascade, ...]

    def response(self, omega: ArrayLike, period: float) -> NDArray[np.complex128]:
        """Return the response at angular frequencies [rad/s] (n,), infinite at a pole.

        Raises:
            ControllerError: the period is not above zero.
        """
        total = np.zeros(np.atleast_1d(np.asarray(omega, float)).shape, dtype=np.complex128)
        for cascade in self.cascades:
            passed = np.ones_like(total)
            for b, a in cascade:
                passed = passed * frequency_response(b, a, omega, period)
            total += passed
        return total
