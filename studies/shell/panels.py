"""Under which heading does an option stand in a command's help?

>>> panel_of(CompareConfig, "hardware_delay")                      # doctest: +SKIP
'Sensors, computer, motors'

A class of options has a `PANEL`, in which all its options are, whatever a command makes of their
defaults. What a command has of its own is what is run, but for the names here.
"""

from __future__ import annotations

from studies.headings import (
    FILE,
    HARDWARE,
    MAIN,
    NUMBERS,
    OUTPUT,
    ROBOT,
    RUNNING,
    SEARCH,
    SIZES,
    TRAJECTORIES,
)

OWN = {
    ROBOT: "arm mjcf beam",
    HARDWARE: "hardware",
    SIZES: """modes segments step chain_step period timestep perturbations terms map_points
        zero_draws filter_time seconds""",
    SEARCH: """distribution tuner population generations chain_generations patience survivors
        screen seeds individuals weights effort residual perturb perturb_spread perturb_payload
        payloads long_hold exact exact_spread exact_payload""",
    FILE: "columns time_unit gap",
    RUNNING: "quick seed threads rounds resume workers batch_seconds cluster code once",
    OUTPUT: "out force json format traces rrd viewer connect export web save live",
}
OF_NAME = {name: panel for panel, names in OWN.items() for name in names.split()}
WITHIN = {  # by the option that others are within
    "robot": NUMBERS,
    **dict(zip(("line", "two_loop", "circle"), TRAJECTORIES, strict=True)),
}


def panel_of(config: type, name: str) -> str:
    """Return the heading of an option of a configuration's class.

    Args:
        config: the class. name: of the field, dotted within another.
    """
    outer, _, inner = name.partition(".")
    if inner:
        return WITHIN.get(outer, MAIN)
    if name in OF_NAME:
        return OF_NAME[name]
    for each in reversed(config.__mro__):
        if name in vars(each).get("__annotations__", {}):
            return str(vars(each).get("PANEL", MAIN))
    return MAIN
