"""A keyframe of a compiled MJCF file, by its name: positions and rates.

>>> keyframe(chain.model, "bent", chain.source).qpos[:2]
array([0.3, 1.2])
"""

from __future__ import annotations

import difflib
from typing import NamedTuple

import mujoco
import numpy as np

from flexsim.errors import ParameterError
from flexsim.numerics.types import Array

SHOWN = 12  # names in a message


class Keyframe(NamedTuple):
    """Positions (nq,) and rates (nv,) of a keyframe [SI]."""

    qpos: Array
    qvel: Array


def keyframe(model: mujoco.MjModel, name: str, source: str) -> Keyframe:
    """Return a model's keyframe.

    Args:
        model: compiled. name: of the keyframe. source: the model's name, for messages.

    Raises:
        ParameterError: there is none of that name, or it has numbers that are not finite.
    """
    names = [model.key(i).name for i in range(model.nkey)]
    named = [each for each in names if each]
    if name not in named:
        raise ParameterError(f"{source} has no keyframe {name!r}; {_instead(name, named)}")
    i = names.index(name)
    found = Keyframe(model.key_qpos[i].copy(), model.key_qvel[i].copy())
    if not (np.isfinite(found.qpos).all() and np.isfinite(found.qvel).all()):
        raise ParameterError(
            f"{source}: keyframe {name!r} has a number that is not finite; edit the file"
        )
    return found


def _instead(name: str, named: list[str]) -> str:
    """Return what would do: the names that there are, and the one that was likely meant."""
    if not named:
        return "it has none with a name; give the joint angles instead"
    more = f" and {len(named) - SHOWN} more" if len(named) > SHOWN else ""
    close = difflib.get_close_matches(name.lower(), named, n=1)
    hint = f". Did you mean {close[0]}?" if close else ""
    return f"choose {', '.join(named[:SHOWN])}{more}{hint}"
