"""An arm of one link: an MJCF file without joint 1, whose link 1 is a stand that does not move.

>>> has_no_joint1(text)
True

Every model of ours has two joints. So the stand is read as a link 1 on a joint 1, and the joint is
locked: `flexsim.arm.locked` says why that is the same motion, to rounding.
"""

from __future__ import annotations

from flexsim.mjcf.reading.elements import ROOT, Element, elements

JOINT = '<joint name="joint1" type="hinge" axis="0 0 1"/>'
MOTOR = '<motor name="motor1" joint="joint1"/>'


def has_no_joint1(text: str) -> bool:
    """Return whether MJCF has a joint2 on a body, and no joint on what carries that body."""
    return _stand(elements(text)) is not None


def with_joint1(text: str) -> str:
    """Return MJCF of an arm of one link with a joint 1 on its stand, and the motor of that."""
    found = elements(text)
    stand = _stand(found)
    if stand is None:
        return text
    places = [(stand.inner, JOINT)]
    motor = next(
        (each for each in found if each.tag == "motor" and each.attributes.get("name") == "motor2"),
        None,
    )
    if motor is not None:  # without, it is said that there is none
        places.append((motor.start, MOTOR))
    for place, more in sorted(places, reverse=True):
        text = text[:place] + more + text[place:]
    return text


def _stand(found: list[Element]) -> Element | None:
    """Return the body without a joint that carries the body of joint2, if there is one."""
    joints = [each for each in found if each.tag == "joint" and each.parent != ROOT]
    joints = [each for each in joints if found[each.parent].tag == "body"]
    names = {each.attributes.get("name") for each in joints}
    hub = next((each.parent for each in joints if each.attributes.get("name") == "joint2"), None)
    if hub is None or "joint1" in names:
        return None
    stand = found[hub].parent
    if stand == ROOT or found[stand].tag != "body" or any(each.parent == stand for each in joints):
        return None
    return found[stand]
