"""A robot by its name, on the command line and in a tuning: nothing else may be given beside it.

>>> robot_named("one-link", None, None, "file", (), Names()).parameters.I_m1
1e+30
"""

from __future__ import annotations

from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.mjcf.reading.names import Names
from flexsim.robot.robot import Robot


def robot_named(
    arm: str,
    mjcf: object,
    robot: Parameters | None,
    beam: str,
    modal_damping: tuple[float, ...],
    names: Names,
) -> Robot:
    """Return the robot of a name other than the paper's, nothing else given beside it.

    Raises:
        ParameterError: there is none of that name, or something is given that it has itself.
    """
    given = {
        "--mjcf": mjcf is not None,
        "--robot": robot is not None,
        "--beam": beam != "file",
        "--modal-damping": bool(modal_damping),
        **{f"--{name}": True for name in names.given()},
    }
    for option, there in given.items():
        if there:
            raise ParameterError(
                f"--arm {arm} and {option} contradict each other: that arm has numbers of its own; "
                f"leave one out, or change models/{arm.replace('-', '_')}.xml and give it as --mjcf"
            )
    return Robot.named(arm)
