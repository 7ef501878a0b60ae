"""A rod's file as the robot: its rigid bodies, and the uniform beam that the rod stands for.

>>> rod = load_rod("models/rod.xml")
>>> parameters_of_rod(rod).EI        # [N m2]
"""

from __future__ import annotations

import numpy as np

from flexsim.errors import ModelError
from flexsim.mjcf.as_parameters import parameters_of_rod
from flexsim.mjcf.linear_checks import require_linear
from flexsim.mjcf.rod_file import RodModel
from flexsim.mjcf.rod_xml import rod_layout

UNIFORM = 1e-6  # relative, of masses and places: files have 12 digits


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
