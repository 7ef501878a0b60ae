"""Which robot, and which model of it: `Robot`, and plants by their names."""

from flexsim.robot.plant_names import plant_kind
from flexsim.robot.robot import Robot

__all__ = ["Robot", "plant_kind"]
