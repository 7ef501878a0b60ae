"""What a recording says in words: about a case, the robot, the run, and all cases at once.

Markdown, as the viewer shows it; what comes from outside is escaped.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from flexsim.arm.parameters import Parameters, describe
from flexsim.loop.motion import Motion
from flexsim.recording.case import Case
from flexsim.recording.traces import spoken

MARKDOWN = "\\`*_[]<>|#~&"


def escaped(text: str) -> str:
    """Return a text in which nothing is markdown."""
    return "".join(f"\\{each}" if each in MARKDOWN else each for each in text)


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a markdown table of cells that are markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def outcome(motion: Motion) -> str:
    """Return in words how a motion ended."""
    if motion.diverged is not None:
        return f"**diverged at t = {motion.diverged:.3f} s**"
    return f"ran to its end, t = {motion.time[-1]:.3f} s" if motion.time.size else "no samples"


def _told(case: Case, plant: str) -> str:
    """Return in words which run of a plant is shown, and how it ended."""
    which = case.shown.get(plant)
    return (f"{which}: " if which else "") + outcome(case.motions[plant])


def notes(case: Case, remarks: Sequence[str]) -> str:
    """Return what is to be known about a case, its figures of merit and how it is drawn.

    Args:
        remarks: how it is drawn, sentences.
    """
    head = ("case", escaped(case.name))
    rows = [
        ("trajectory", escaped(case.trajectory)),
        ("controllers", escaped(case.controllers)),
        ("setting", escaped(case.setting)),
        ("hardware", escaped(case.hardware)),
        *((spoken(plant), _told(case, plant)) for plant in case.motions),
    ]
    parts = [merit_table(case)] if case.merit else []
    parts.append(table(head, rows))
    parts.append("\n".join(f"- {each}" for each in remarks))
    return "\n\n".join(parts)


def merit_table(case: Case) -> str:
    """Return the figures of merit of a case, a column for each plant."""
    plants = [plant for plant in case.motions if plant in case.merit]
    names = dict.fromkeys(name for plant in plants for name in case.merit[plant])
    rows = [[name, *(case.merit[plant].get(name, "-") for plant in plants)] for name in names]
    return table(["figure of merit", *(spoken(plant) for plant in plants)], rows)


def overview(cases: Sequence[Case]) -> str:
    """Return one table of all cases."""
    names = dict.fromkeys(name for case in cases for each in case.merit.values() for name in each)
    head = ["case", "plant", *names, "shown"]
    rows = []
    for case in cases:
        for i, plant in enumerate(case.motions):
            merit = case.merit.get(plant, {})
            figures = [merit.get(name, "-") for name in names]
            first = escaped(case.name) if not i else ""
            rows.append([first, spoken(plant), *figures, _told(case, plant)])
    about = dict.fromkeys(
        f"- {escaped(case.name)}: {escaped(case.trajectory)}, {escaped(case.controllers)}, "
        f"setting {escaped(case.setting)}, hardware: {escaped(case.hardware)}"
        for case in cases
    )
    title = "# All cases\n\nThe maps have a grid of 0.1 m."
    return "\n\n".join([title, table(head, rows), "\n".join(about)])


def robot(parameters: Parameters) -> str:
    """Return the robot's parameters."""
    rows = [
        (
            row["name"],
            f"{row['value']:g} {row['unit']}".removesuffix(" -"),
            row["meaning"] + (" (*assumed*)" if row["assumed"] else ""),
            row["source"],
        )
        for row in describe(parameters)
    ]
    note = "A case's setting may put other motor inertias in place of these."
    return f"# Robot\n\n{table(('', 'value', 'meaning', 'source'), rows)}\n\n{note}"


def run(about: Mapping[str, str]) -> str:
    """Return what else explains a run."""
    rows = [(escaped(name), escaped(text)) for name, text in about.items()]
    return f"# Run\n\n{table(('', ''), rows)}"
