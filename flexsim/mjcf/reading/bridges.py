"""Where does a file have strain bridges? Its sites strain1 and strain2, on the beam's bodies.

>>> bridge_sites(model, "arm.xml", root=0.395, length=0.5)
(0.025, 0.25)
"""

from __future__ import annotations

import mujoco
import numpy as np

from flexsim.errors import ModelError
from flexsim.mjcf.reading.geometry import PLANE_TOLERANCE, straight

BRIDGES = ("strain1", "strain2")  # names of the sites


def bridge_sites(
    model: mujoco.MjModel, source: str, root: float, length: float
) -> tuple[float, float] | None:
    """Return the places of the two sites from the clamp [m], None where there is neither.

    Args:
        source: name of the file. root: of the beam on the x-axis, arm straight [m]; length: [m].

    Raises:
        ModelError: there is one only, or one is off the beam or does not move with it.
    """
    there = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, name) for name in BRIDGES]
    if max(there) < 0:
        return None
    if min(there) < 0:
        have, lack = BRIDGES if there[0] >= 0 else BRIDGES[::-1]
        raise ModelError(f"{source}: has the site {have!r} but no {lack!r}; give both or neither")
    data, places = straight(model), []
    beam = {int(model.body_weldid[body]) for body in model.jnt_bodyid[1:]}  # the hub's root, too
    for name, site in zip(BRIDGES, there, strict=True):
        x, y, _ = data.site_xpos[site]
        place = float(x) - root
        on = int(model.body_weldid[model.site_bodyid[site]]) in beam
        if not (on and -PLANE_TOLERANCE <= place <= length + PLANE_TOLERANCE and abs(y) < length):
            raise ModelError(
                f"{source}: site {name!r} is {place:g} m from the clamp, on body "
                f"{model.body(model.site_bodyid[site]).name!r}, off the beam; put it on one of the "
                f"beam's bodies, 0 to {length:g} m from the clamp"
            )
        places.append(float(np.clip(place, 0.0, length)))
    return places[0], places[1]
