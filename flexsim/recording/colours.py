"""Colours of plants, differences and states, 0 to 255: Okabe and Ito's, which all can tell apart.

What only colour could tell is also told by width and by marks.
"""

from __future__ import annotations

from flexsim.recording.traces import kind

Colour = tuple[int, int, int]

COLOURS: dict[str, Colour] = {
    "assumed-modes": (230, 159, 0),
    "chain": (86, 180, 233),
    "rigid": (0, 158, 115),
    "printed": (213, 94, 0),
    "reference": (200, 200, 200),
}
OTHER: Colour = (204, 121, 167)
WORDS = {
    "assumed-modes": "orange",
    "chain": "blue",
    "rigid": "green",
    "printed": "red",
    "reference": "grey",
}
OTHER_WORD = "pink"
DIFFERENCE: tuple[Colour, ...] = ((204, 121, 167), (0, 158, 115), (240, 228, 66))
BACKGROUND: Colour = (24, 26, 30)
FAINT: Colour = (90, 94, 100)


def colour(name: str) -> Colour:
    """Return the colour of a plant or of the reference."""
    return COLOURS.get(kind(name), OTHER)


def word(name: str) -> str:
    """Return that colour in words."""
    return WORDS.get(kind(name), OTHER_WORD)


def dimmed(rgb: Colour, brightness: float) -> Colour:
    """Return a colour with a share of its brightness."""
    red, green, blue = (round(brightness * each) for each in rgb)
    return red, green, blue
