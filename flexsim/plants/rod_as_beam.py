"""A rod's file as the robot: its rigid bodies, and the uniform beam that the rod stands for.

>>> rod = load_rod("models/rod.xml")
>>> parameters_of_rod(rod).EI        # [N m2]
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from flexsim.errors import ModelError
from flexsim.mjcf.as_parameters import beam_heads, parameters_of_rod, rod_payload
from flexsim.mjcf.bodies import Bodies, parted
from flexsim.mjcf.reading.linear_checks import linear_reasons, together
from flexsim.mjcf.rod_file import RodModel
from flexsim.mjcf.rod_xml import rod_layout

UNIFORM = 1e-6  # relative, of masses and places: files have 12 digits
ON_AXIS = 1e-9  # [m] how far from where it belongs a centre of mass may be


def require_uniform(rod: RodModel) -> None:
    """Raise a ModelError naming all in a rod that is not a uniform beam in free space."""
    found = [*linear_reasons(rod.model), *_masses(rod), *_beam(rod)]
    if found:
        them = "it" if len(found) == 1 else "them"
        raise ModelError(f"{rod.source}: {'; '.join(found)}; only --plant rod can take {them}")


def _masses(rod: RodModel) -> Iterator[str]:
    """Give centres of mass that are not where the equations have them."""
    _, hub, _ = parted(rod.model, rod.L_R, beam_heads(rod))
    total = float(hub.mass.sum()) or 1.0
    aside = np.hypot(float(hub.mass @ hub.x), float(hub.mass @ hub.y)) / total
    if aside > ON_AXIS:
        yield f"body 'hub' has its centre of mass {aside:g} m beside joint2"
    vertices = rod.model.jnt_bodyid[2::2]
    off = np.linalg.norm(rod.model.body_ipos[vertices], axis=1) > ON_AXIS
    names = [rod.model.body(int(i)).name for i in vertices[off]]
    yield from together("body", names, "a centre of mass beside its vertex")


def _beam(rod: RodModel) -> Iterator[str]:
    """Give what of the beam is otherwise than a uniform one's would be."""
    layout = rod_layout(parameters_of_rod(rod), len(rod.vertices) - 2)
    bodies = [rod.model.body(int(i)) for i in rod.model.jnt_bodyid[2::2]]
    _, _, beam = parted(rod.model, rod.L_R, beam_heads(rod))
    root = _root(rod, beam)
    names = ["root", *(body.name for body in bodies)]
    masses = np.append(root[0], [body.mass[0] for body in bodies])
    masses[-1] -= rod_payload(rod)
    for quantity, unit, found, wanted in (
        ("mass", "kg", masses, np.append(layout.root_mass, layout.masses)),
        (
            "place",
            "m from joint 2",
            np.append(root[1], rod.vertices[2:]),
            rod.clamp + np.append(layout.root_centre, layout.vertices[1:]),
        ),
    ):
        ratio = found / wanted
        usual = np.median(ratio)  # so that one that is odd does not make all the others so
        odd = int(np.argmax(np.abs(ratio / usual - 1)))
        if abs(ratio[odd] / usual - 1) > UNIFORM:
            yield (
                f"body {names[odd]!r} has the {quantity} {found[odd]:g} {unit}, a uniform beam's "
                f"would be {wanted[odd] * usual:g}"
            )
    own = root[2] + sum(float(body.inertia.max()) for body in bodies)
    if abs(own - layout.root_inertia) > UNIFORM * beam.about_axis:
        yield (
            f"the bodies of the beam have inertias of their own of {own:g} kg m2, a uniform beam's "
            f"would be {layout.root_inertia:g}"
        )


def _root(rod: RodModel, beam: Bodies) -> tuple[float, float, float]:
    """Return mass [kg], centre [m, from joint 2] and inertia [kg m2] of what the hub holds."""
    vertices = set(rod.model.jnt_bodyid[2:].tolist())
    fixed = [b for b, body in enumerate(beam.ids) if body not in vertices]
    mass, x = beam.mass[fixed], beam.x[fixed]
    total = float(mass.sum())
    centre = float(mass @ x) / total if total else 0.0
    about = beam.inertia[fixed] + mass * ((x - centre) ** 2 + beam.y[fixed] ** 2)
    return total, centre, float(about.sum())
