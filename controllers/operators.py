"""The realisations of a fractional operator D^order, by name.

    b, a = operator("tustin", order=-0.5, period=1e-3, terms=10)

Source: section 3.1 names the first five and keeps the first, (2).
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TypeAlias

from controllers.errors import ControllerError
from controllers.fractions import backward_fraction, tustin_fraction
from controllers.oustaloup import oustaloup
from controllers.series import Filter, gruenwald_letnikov, impulse_response, tustin

Realisation: TypeAlias = Callable[[float, float, int], Filter]

REALISATIONS: Mapping[str, Realisation] = MappingProxyType(
    {
        "tustin": tustin,
        "gruenwald-letnikov": gruenwald_letnikov,
        "impulse-response": impulse_response,
        "tustin-fraction": tustin_fraction,
        "backward-fraction": backward_fraction,
        "oustaloup": oustaloup,
    }
)
"""Name -> function of (order, period [s], terms) that returns `(b, a)`."""


def operator(name: str, order: float, period: float, terms: int) -> Filter:
    """Return D^order as a digital filter.

    Args:
        name: a key of `REALISATIONS`.
        order: nu, any real number; negative integrates.
        period: sampling period [s].
        terms: length of the filter, see the realisation.

    Returns:
        b and a in powers of z^-1, a[0] = 1.

    Raises:
        ControllerError: the name is unknown or an argument is out of range.
    """
    if name not in REALISATIONS:
        raise ControllerError(f"unknown realisation {name!r}; available: {', '.join(REALISATIONS)}")
    return REALISATIONS[name](order, period, terms)
