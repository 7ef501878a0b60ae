"""Under which heading does an option stand in a command's help?

>>> panel_of(CompareConfig, "hardware_delay")                      # doctest: +SKIP
'Sensors, computer, motors'

A class of options has a `PANEL`, in which all its options are, whatever a command makes of their
defaults. What a command has of its own is what is run, but for the names here.
"""

from __future__ import annotations

from studies.core.options import HARDWARE_PANEL, ROBOT_PANEL
from studies.core.study_options import OUTPUT_PANEL, RUNNING_PANEL, SIZES_PANEL

MAIN_PANEL = "What is run"
SEARCH_PANEL = "Search"
FILE_PANEL = "The file read"
NUMBERS_PANEL = "The robot by its numbers"
TRAJECTORY_PANEL = "Trajectory {}"

OWN = {
    ROBOT_PANEL: "mjcf beam",
    HARDWARE_PANEL: "hardware",
    SIZES_PANEL: """modes segments step chain_step period timestep perturbations terms map_points
        zero_draws filter_time seconds""",
    SEARCH_PANEL: """distribution tuner population generations chain_generations patience
        survivors screen seeds individuals weights effort residual perturb perturb_spread
        perturb_payload payloads long_hold exact exact_spread exact_payload""",
    RUNNING_PANEL: "quick seed threads rounds resume workers batch_seconds cluster code once",
    FILE_PANEL: "columns time_unit gap",
    OUTPUT_PANEL: "out force json format traces rrd viewer connect export web",
}
OF_NAME = {name: panel for panel, names in OWN.items() for name in names.split()}
PANELS = (
    MAIN_PANEL,
    SEARCH_PANEL,
    FILE_PANEL,
    SIZES_PANEL,
    HARDWARE_PANEL,
    ROBOT_PANEL,
    NUMBERS_PANEL,
    *(TRAJECTORY_PANEL.format(name) for name in ("line", "two-loop", "circle")),
    RUNNING_PANEL,
    OUTPUT_PANEL,
)


def panel_of(config: type, name: str) -> str:
    """Return the heading of an option of a configuration's class.

    Args:
        config: the class. name: of the field, dotted within another.
    """
    outer, _, inner = name.partition(".")
    if inner:
        if outer == "robot":
            return NUMBERS_PANEL
        return TRAJECTORY_PANEL.format(outer.replace("_", "-"))
    if name in OF_NAME:
        return OF_NAME[name]
    for each in reversed(config.__mro__):
        if name in vars(each).get("__annotations__", {}):
            return str(vars(each).get("PANEL", MAIN_PANEL))
    return MAIN_PANEL
