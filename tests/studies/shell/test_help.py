"""`flexsim COMMAND --help`: headings, a unit with every number, words for what is not given."""

from __future__ import annotations

import re
import sys
from functools import cache

import pytest
from processes import PATIENCE, process

from studies.commands import COMMANDS
from studies.headings import HEADINGS, MAIN
from studies.main import main
from studies.shell.help import help_of
from studies.shell.parsed import Option, parsed

WIDTHS = (80, 100, 140)  # [columns]
DIMENSIONLESS = {  # numbers without a unit
    *("modal_damping", "torque_gain", "v_gain", "weights", "perturb_spread", "exact_spread"),
    *("speed",),  # of simulated time over the clock's
    *("order", "gain"),  # of an operator D^order, whose unit is the order's
}
WORDS = (
    *("unless given", "[Ww]ithout", "With --mjcf", "[Ii]nstead", "Tune nothing", "Needed but with"),
    "needed without",
)
OTHERWISE = re.compile("|".join(WORDS))  # what says what holds where an option is not given


@cache
def options(command: str) -> tuple[Option, ...]:
    return tuple(parsed(command).options)


@pytest.mark.parametrize("command", COMMANDS)
def test_no_line_is_wider_than_the_terminal(command: str) -> None:
    for width in WIDTHS:
        text = help_of(command, width)
        assert max(map(len, text.splitlines())) <= width
        assert text.startswith(f"usage: flexsim {command} ") and "--help" in text
        assert not re.search(r"\{None|None\}|\|?\bNone\b|\{fixed\}|True\)|False\)", text)


@pytest.mark.parametrize("command", COMMANDS)
def test_every_option_stands_under_its_heading(command: str) -> None:
    text = help_of(command, 100)
    headings = re.findall(r"^(\S.*):$", text, re.MULTILINE)
    panels = {each.panel for each in options(command)} | {HEADINGS[-1]}
    assert headings == [panel for panel in HEADINGS if panel in panels]
    sections = dict(zip(headings, re.split(r"^\S.*:$", text, flags=re.MULTILINE)[1:], strict=True))
    for each in options(command):
        shown = each.flags[0] if each.flags else each.value
        assert re.search(rf"^  {re.escape(shown)}", sections[each.panel], re.MULTILINE), each
        assert each.text, each


@pytest.mark.parametrize("command", COMMANDS)
def test_every_number_has_a_unit(command: str) -> None:
    for each in options(command):
        measured = bool(each.unit) or each.name.rpartition(".")[2] in DIMENSIONLESS
        assert measured == ("FLOAT" in each.value), each


@pytest.mark.parametrize("command", COMMANDS)
def test_what_is_not_given_is_said_in_words(command: str) -> None:
    for each in options(command):
        switch = not each.value
        assert switch or each.default or each.required or OTHERWISE.search(each.text), each


def test_options_of_a_class_stand_together() -> None:
    panel = {each.name: each.panel for each in options("compare")}
    assert panel["hardware"] == panel["hardware_lag"] == "Sensors, computer, motors"
    assert panel["mjcf"] == panel["tip"] == panel["modal_damping"] == "Robot"
    assert panel["robot.EI"] == "The robot by its numbers"
    assert panel["circle.lead"] == "Trajectory circle"
    assert panel["controllers"] == panel["holding"] == MAIN
    assert panel["out"] == "Output" and panel["quick"] == panel["seed"] == "How it runs"
    assert panel["step"] == panel["modes"] == "Sizes, steps, repeats"


def test_an_entry_reads_at_a_glance(capsys: pytest.CaptureFixture[str]) -> None:
    text = " ".join(help_of("compare", 80).split())
    assert "--period FLOAT [s] Control period, the paper's; a whole multiple" in text
    assert "--segments INT Segments of the chain; 6 unless given." in text
    assert "--hardware-torque-limit FLOAT FLOAT [N m] Largest torques" in text
    assert "--holding, --no-holding" in text and "(default: --holding)" in text
    assert "--no-force" not in text
    assert main(["view", "run", "--help"]) == 0  # wherever it is asked for
    shown = capsys.readouterr()
    assert shown.err == "" and shown.out.startswith("usage: flexsim view [OPTIONS] RUN [RUN ...]\n")


@pytest.mark.parametrize("command", ["view", "completion"])
def test_help_loads_no_more_than_its_command(command: str) -> None:
    heavy = "{'numba', 'mujoco', 'scipy', 'matplotlib'}"
    code = f"import sys; from studies.main import main; main([{command!r}, '--help'])"
    with process(
        [sys.executable, "-c", f"{code}; sys.exit(bool({heavy} & set(sys.modules)))"]
    ) as p:
        assert p.wait(PATIENCE) == 0
