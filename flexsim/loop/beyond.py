"""Was a model used beyond itself? What a motion's deflection says, in words.

>>> beyond("assumed-modes", v=0.0155, L=0.5)
('assumed-modes: v/L reaches 3.1 %, above 2 %, to which its equations of second order in v/L hold',)
"""

from __future__ import annotations

ASSUMED = ("assumed-modes", "printed")  # kinds of plants whose equations end with second order
V_MOST = 0.02  # of the length: up to here two tips stay within micrometres under the same torques;
# at four times as much within tenths of a millimetre


def beyond(plant: str, v: float | None, L: float) -> tuple[str, ...]:
    """Return a note if a plant bent further than its equations hold, else nothing.

    Args:
        plant: its name, a size after a colon. v: largest |v| [m], None if it is not known.
        L: length of the beam [m].
    """
    if v is None or plant.split(":")[0] not in ASSUMED or not v > V_MOST * L:
        return ()
    return (
        f"{plant}: v/L reaches {100 * v / L:.2g} %, above {100 * V_MOST:g} %, to which its "
        "equations of second order in v/L hold",
    )
