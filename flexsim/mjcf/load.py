"""The one loader of a robot's MJCF file, whichever kind its beam is.

>>> load_arm("models/rod.xml").kind
'rod'
"""

from __future__ import annotations

from pathlib import Path

from flexsim.mjcf.arm_file import given_text
from flexsim.mjcf.chain_file import ChainModel, chain_of
from flexsim.mjcf.reading.names import Names
from flexsim.mjcf.reading.text import is_rod
from flexsim.mjcf.rod_file import RodModel, rod_of


def load_arm(
    path: str | Path | None = None, text: str | None = None, names: Names | None = None
) -> ChainModel | RodModel:
    """Return the arm of an MJCF file, or of its text: a rod's where it has a flex, else a chain's.

    Args: as `flexsim.mjcf.arm_file.given_text`.

    Raises:
        ModelError: the file cannot be read, is too large, does not compile, is not the two-link
            arm, or its step is beyond what its integrator can take.
    """
    given = given_text(path, text, names)
    return rod_of(given) if is_rod(given.text) else chain_of(given)
