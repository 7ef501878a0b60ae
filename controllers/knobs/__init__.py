"""What a search may turn in a design: its knobs, each with its unit and its range.

Knob("omega_c_1", "rad/s", 5.0, 150.0, log=True)
"""

from typing import NamedTuple


class Knob(NamedTuple):
    """A number that a design is made of.

    Attributes:
        name: in the field's symbols. unit: '-' of what has none.
        low, high: the range to search. log: whether it is searched by its logarithm.
    """

    name: str
    unit: str
    low: float
    high: float
    log: bool
