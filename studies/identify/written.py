"""The identified robot as files that every command takes: a study file and an MJCF.

>>> study_file(model, values)                 # TOML: flexsim run, flexsim check
>>> mjcf_of(model, values)                    # flexsim compare --mjcf, drive --mjcf, ...
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import tomli_w

from flexsim.arm.parameters import Parameters
from flexsim.loop.settings import SETTINGS, Setting
from flexsim.mjcf.designed import designed_chain
from flexsim.robot import Robot
from flexsim.robot.plant_names import plant_kind
from studies.identify.names import robot_with, setting_with
from studies.identify.simulated import Model

STUDY, MJCF = "identified.toml", "identified.xml"
FOLLOWED = "line"  # controller and trajectory that the study file has, to be changed


def mjcf_of(model: Model, values: Mapping[str, float]) -> str:
    """Return the MJCF of the identified robot: its file changed, or a chain of its own.

    Friction's law is no part of it: that is the study file's setting.
    """
    robot = robot_with(model.robot, values)
    if robot.file is not None:
        return robot.file.text
    kind, size = plant_kind(model.plant)
    chained = size if kind in ("chain", "closed-chain") and size else 6
    own = setting_with(model.setting, values).applied(robot.parameters)
    return designed_chain(own, chained).text


def study_file(model: Model, values: Mapping[str, float], plant: str) -> str:
    """Return a study file of the identified robot in its setting, on both models."""
    robot, chosen = robot_with(model.robot, values), setting_with(model.setting, values)
    content: dict[str, Any] = {
        "title": "The identified robot",
        "plants": list(dict.fromkeys([plant, "assumed-modes", "closed-chain"])),
        "controllers": [FOLLOWED],
        "trajectories": [FOLLOWED],
        "hardware": ["bench"],
        "robots": [_robot(robot)],
        "settings": [_setting(chosen)],
    }
    return tomli_w.dumps(content)


def _robot(robot: Robot) -> dict[str, Any]:
    if robot.given is not None:
        return {"name": "identified", "mjcf": MJCF}
    own = {item.name: getattr(robot.parameters, item.name) for item in fields(Parameters)}
    damping = {"modal_damping": list(robot.modal_damping)} if robot.modal_damping else {}
    return {"name": "identified", **own, **damping}


def _setting(chosen: Setting) -> dict[str, Any]:
    law, usual = chosen.friction, SETTINGS[chosen.name].friction
    found: dict[str, Any] = {"use": chosen.name}
    if law != usual:
        found["name"] = "identified"
        found["dead_zone"] = [list(each) for each in law.dead_zone]
        found |= {"tau_0": list(law.tau_0), "mu": list(law.mu), "speed": law.speed}
    for name in ("I_m1", "I_m2"):
        if getattr(chosen, name) is not None:
            found[name] = getattr(chosen, name)
    return found
