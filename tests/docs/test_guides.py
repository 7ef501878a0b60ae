"""What guides and READMEs tell a reader to type: commands that are there, and run as they stand."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from studies.main import COMMANDS, main

ROOT = Path(__file__).parents[2]
PAGES = [
    *(ROOT / "docs").rglob("*.md"),
    *(ROOT / name for name in ("README.md", "models/README.md", "controllers/README.md")),
]
CALL = re.compile(r"(?:^    (?:\.venv/bin/)?|`)flexsim ((?:[\w-]+)[^`\n(]*)", re.M)
FENCE = re.compile(r"```(\w*)\n(.*?)```", re.S)
TYPED = re.compile(r"^    (flexsim .*)$", re.M)
PATIENCE = 300.0  # [s]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_commands_and_options_exist(page: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for call in CALL.findall(page.read_text(encoding="utf-8")):
        command, *words = call.split("  #")[0].split()
        if command.isupper():
            continue
        assert command in COMMANDS, call
        assert main([command, "--help"]) == 0
        said = capsys.readouterr().out
        for option in (word.partition("=")[0] for word in words if word.startswith("--")):
            assert re.search(rf"{re.escape(option)}\b", said), call


def test_the_guide_to_a_question_runs_as_it_stands(tmp_path: Path) -> None:
    """The example, the study of the page, its report and its export."""
    text = (ROOT / "docs" / "guide" / "ask.md").read_text(encoding="utf-8")
    (study,) = (body for language, body in FENCE.findall(text) if language == "toml")
    typed = TYPED.findall(text)
    assert [each.split()[1] for each in typed] == ["run", "check", "run", "report", "export"]
    for i, command in enumerate(typed):
        if i == 2:
            (tmp_path / "study.toml").write_text(study, encoding="utf-8")
        program = shlex.join([sys.executable, "-m", "flexsim"])
        done = subprocess.run(
            command.replace("flexsim", program, 1),
            shell=True,
            capture_output=True,
            text=True,
            cwd=tmp_path,
            env=os.environ | {"PYTHONPATH": str(ROOT)},
            timeout=PATIENCE,
        )
        assert done.returncode == 0, f"{command}: {done.stderr}"
    assert (tmp_path / "payload.html").stat().st_size > 1e6
    assert (tmp_path / "runs" / "payload-case-0.csv").is_file()
