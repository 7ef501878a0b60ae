"""The table of edits beside the models: its numbers are those of `modes` and `crosscheck`."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from edits import DEFAULT, EDITS

from flexsim.robot import Robot
from studies.parity.beam_checks import DEFAULT_LIMITS
from studies.parity.motion_checks import driven_checks
from studies.parity.side_by_side import compared

README = (Path(__file__).parents[2] / "models" / "README.md").read_text()
WORDS = {  # of the row's first cell
    "none": DEFAULT,
    "50 g at the tip": EDITS["payload"],
    "half the stiffness": EDITS["soft hinge"],
    "1 % damping": EDITS["damped"],
    "20 % longer": EDITS["longer"],
    "`link1` doubled": EDITS["heavy link"],
    "4 segments:": EDITS["4 segments"],
    "16 segments:": EDITS["16 segments"],
}
LAST_DIGIT = 0.6  # of the figures as printed, in units of their last digit


@pytest.mark.parametrize("words", WORDS)
def test_row_is_what_the_commands_give(words: str) -> None:
    (row,) = (
        line
        for line in README.split("| edit of `chain6.xml` |")[1].split("\n\n")[0].splitlines()
        if line.startswith("|") and re.search(rf"(?<!\d){re.escape(words)}", line)
    )
    numbers = [re.findall(r"[\d.]+", cell) for cell in row.split("|")[-4:-1]]
    robot = Robot.of(text=WORDS[words])
    found = compared(robot)
    small, large = (1e6 * check.value for check in driven_checks(*robot.both(), DEFAULT_LIMITS))
    wanted = [
        *found.clamped_hz["chain"],
        found.joint_free_hz["assumed_modes"][0],
        found.joint_free_hz["chain"][0],
        small,
        large,
    ]
    shown = [text for cell in numbers for text in cell]
    assert len(shown) == len(wanted)
    for text, value in zip(shown, wanted, strict=True):
        digit = 10.0 ** -len(text.partition(".")[2])
        assert abs(float(text) - value) < LAST_DIGIT * digit, (text, value)
