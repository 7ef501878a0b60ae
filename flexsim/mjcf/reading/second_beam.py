"""Does link 1 of an MJCF file bend as well? What its text says, before it is compiled.

>>> bends_twice(text)
True
"""

from __future__ import annotations

from flexsim.mjcf.reading.elements import elements


def bends_twice(text: str) -> bool:
    """Return whether MJCF has joints between joint1 and joint2: link 1 bends."""
    names = [
        each.attributes.get("name")
        for each in elements(text)
        if each.tag == "joint" and "joint" not in each.attributes
    ]
    if not {"joint1", "joint2"} <= set(names):
        return False
    return names.index("joint2") > names.index("joint1") + 1
