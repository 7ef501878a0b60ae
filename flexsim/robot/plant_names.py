"""Plants by their names: a kind, and a size after a colon where there is one.

>>> plant_kind("assumed-modes:5")
('assumed-modes', 5)
"""

from __future__ import annotations

import re

from flexsim.errors import ParameterError

KINDS = (
    *("rigid", "assumed-modes", "printed", "chain", "closed-chain"),
    *("untuned", "rule-of-thumb", "rod", "exudyn"),
)
PLANT_HELP = (
    "rigid, assumed-modes[:n], printed[:n], chain[:N], closed-chain[:N], untuned[:N], "
    "rule-of-thumb[:N], rod[:N] or exudyn[:N]"
)


def plant_kind(name: str) -> tuple[str, int | None]:
    """Return kind and size (None without one) of a plant's name.

    Raises:
        ParameterError: there is no such plant.
    """
    match = re.fullmatch(rf"({'|'.join(KINDS)})(?::([1-9][0-9]{{0,3}}))?", name)
    if not match or (match[2] and match[1] == "rigid"):
        raise ParameterError(f"plant {name!r} is unknown; choose {PLANT_HELP}")
    return match[1], int(match[2]) if match[2] else None
