"""A rod's file as the robot: its rigid bodies, and the uniform beam that the rod stands for.

>>> rod = load_rod("models/rod.xml")
>>> parameters_of_rod(rod).EI        # [N m2]
"""

from __future__ import annotations

import re

import numpy as np

from flexsim.chain_bodies import parted, require_linear, robot_of_bodies
from flexsim.errors import ModelError
from flexsim.parameters import Parameters
from flexsim.rod_mjcf import rod_layout
from flexsim.rod_model import RodModel

COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
UNIFORM = 1e-6  # relative, of masses and places: files have 12 digits


def is_rod(text: str) -> bool:
    """Return whether MJCF has a flex, which no chain has."""
    return re.search(r"<flex(comp)?\b", COMMENT.sub("", text)) is not None


def parameters_of_rod(rod: RodModel) -> Parameters:
    """Return the robot of a rod's file: its rigid bodies, and its beam's length, mass and EI.

    Raises:
        ModelError: a quantity is zero that must not be.
    """
    model = rod.model
    heads = [int(model.body("root").id), *(int(i) for i in model.jnt_bodyid[2::2])]
    spans = np.diff(rod.vertices)
    EI = float(rod.bending[0] * (spans[0] + spans[1]))
    bodies = parted(model, rod.L_R, heads)
    L = rod.reach - rod.clamp
    return robot_of_bodies(bodies, model, rod.source, rod.L_R, rod.clamp, L, EI)


def require_uniform(rod: RodModel) -> None:
    """Raise a ModelError naming what of a rod is not a uniform, undamped beam in free space."""
    require_linear(rod)
    if rod.model.flex_damping.any():
        raise ModelError(
            f"{rod.source}: the elasticity of the flex has damping, which only --plant rod can take"
        )
    layout = rod_layout(parameters_of_rod(rod), len(rod.vertices) - 2)
    bodies = [rod.model.body(int(i)) for i in rod.model.jnt_bodyid[2::2]]
    for quantity, unit, found, wanted in (
        ("mass", "kg", np.array([body.mass[0] for body in bodies]), layout.masses),
        ("place", "m from joint 2", rod.vertices[2:], rod.clamp + layout.vertices[1:]),
    ):
        ratio = found / wanted
        ratio /= np.median(ratio)  # so that one that is odd does not make all the others so
        odd = int(np.argmax(np.abs(ratio - 1)))
        if abs(ratio[odd] - 1) > UNIFORM:
            raise ModelError(
                f"{rod.source}: body {bodies[odd].name!r} has the {quantity} {found[odd]:g} "
                f"{unit}, a uniform beam's would be {found[odd] / ratio[odd]:g}; only --plant rod "
                "can take it"
            )
