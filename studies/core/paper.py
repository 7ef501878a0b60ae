"""What the paper states that studies are held against: Table 3, and the lists of its cases."""

from __future__ import annotations

PLANTS = ("assumed-modes", "chain")  # the two models that are compared throughout
PLANT_KEYS = ("assumed_modes", "chain")  # the same, as keys of JSON objects
CASES = (  # trajectory, what the controllers were devised for
    ("line", "line"),
    ("two-loop", "two-loop"),
    ("circle", "circle"),
    ("line", "two-loop"),  # Figure 6
)
FIGURE_OF = {"line": "figure-3", "two-loop": "figure-4", "circle": "figure-5"}  # in Table 2
PAPER_MARKERS = (("paper, simulation", "|"), ("paper, laboratory", "x"))

# Table 3: envelope half-width [m] in simulation and in the laboratory
PAPER_ENVELOPES = {
    "line": (0.016, 0.053),
    "two-loop": (0.014, 0.021),
    "circle": (0.006, 0.018),
    "transfer": (0.033, 0.042),  # Figure 6: the line, with the controllers of the two-loop
}


def paper_envelopes(trajectory: str, controllers: str) -> tuple[float, float] | None:
    """Return Table 3's half-widths [m], simulation and laboratory, or None where it has none.

    The line with controllers whose name speaks of the two-loop is the transfer of Figure 6.
    """
    trajectory, controllers = trajectory.replace("_", "-"), controllers.replace("_", "-")
    if trajectory == "line" and "two-loop" in controllers:
        return PAPER_ENVELOPES["transfer"]
    return PAPER_ENVELOPES.get(trajectory)


def case_name(trajectory: str, devised: str) -> str:
    """Return 'line', or 'line by two-loop' for controllers devised for another trajectory."""
    return trajectory if trajectory == devised else f"{trajectory} by {devised}"


def case_envelopes(trajectory: str, devised: str) -> tuple[float, float] | None:
    """Return the same of one of the paper's cases, None for any other."""
    return paper_envelopes(trajectory, devised) if (trajectory, devised) in CASES else None
