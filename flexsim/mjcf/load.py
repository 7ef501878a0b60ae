"""The one loader of a robot's MJCF file, whichever kind its beam is.

>>> load_arm("models/rod.xml").kind
'rod'
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from flexsim.mjcf.arm_file import Given, given_text
from flexsim.mjcf.chain_file import ChainModel, chain_of
from flexsim.mjcf.edits import with_locked
from flexsim.mjcf.reading.held_joint import has_no_joint1, with_joint1
from flexsim.mjcf.reading.names import Names
from flexsim.mjcf.reading.text import is_rod
from flexsim.mjcf.rod_file import RodModel, rod_of


def load_arm(
    path: str | Path | None = None, text: str | None = None, names: Names | None = None
) -> ChainModel | RodModel:
    """Return the arm of an MJCF file, or of its text: a rod's where it has a flex, else a chain's.

    A file whose hub is on a body without a joint is an arm of one link, its joint 1 locked; one
    with hinges between joint 1 and joint 2 is an arm of two chains.

    Raises:
        ModelError: as `flexsim.mjcf.chain_file.load_chain`.
    """
    given = given_text(path, text, names)
    if is_rod(given.text):
        return rod_of(given)
    if not has_no_joint1(given.text):
        return chain_of(given)
    free = chain_of(Given(given.source, with_joint1(given.text)))
    return replace(with_locked(free, ["joint1"]), text=given.text)
