"""What lies beside the studies: every room says what it answers, with commands that exist."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import studies
from studies.main import COMMANDS, main

ROOT = Path(__file__).parents[2] / "studies"
ROOMS = tuple(room for room in studies.ROOMS if (ROOT / room).is_dir() and room != "core")


def text_of(room: str) -> str:
    return (ROOT / room / "README.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_says_what_it_answers(room: str) -> None:
    text = text_of(room)
    assert text.startswith("# ")
    commands = {name for name, each in COMMANDS.items() if each.module.startswith(f"{room}.")}
    assert commands <= set(re.findall(r"flexsim ([\w-]+)", text))


def test_commands_and_options_exist(capsys: pytest.CaptureFixture[str]) -> None:
    help_of: dict[str, str] = {}
    checked = 0
    for room in ROOMS:
        for call in re.findall(r"flexsim ((?:[\w-]+)[^`\n(]*)", text_of(room)):
            command, *words = call.split("  #")[0].split()
            assert command in COMMANDS, call
            if command not in help_of:
                assert main([command, "--help"]) == 0
                help_of[command] = capsys.readouterr().out
            for option in (word for word in words if word.startswith("--")):
                assert re.search(rf"{option}\b", help_of[command]), call
                checked += 1
    assert checked >= 8
