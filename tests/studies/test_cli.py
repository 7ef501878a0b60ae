"""The command line itself: help, one line for every failure, clean exits, the README's promises."""

from __future__ import annotations

import importlib
import json
import re
import signal
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from processes import PATIENCE, flexsim, process, wait_for

from controllers import operator
from flexsim import ParameterError
from flexsim.mjcf.chain_file import load_chain
from studies import main as command_line
from studies.commands import COMMANDS
from studies.core.ending import INTERRUPTED
from studies.main import main, unboxed
from studies.tools import filter as filter_study

ROUNDS = 3
TERMINAL = 80  # [columns]
ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text()


def said(capsys: pytest.CaptureFixture[str], arguments: list[str], status: int = 2) -> str:
    """Return the one line of a command that fails, after checking that it is one."""
    assert main(arguments) == status
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err.startswith("flexsim: ") and shown.err.count("\n") == 1, shown.err
    return shown.err


@pytest.mark.parametrize("arguments", [[], ["-h"], ["--help"], ["help"]])
def test_overview_names_every_command(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == 0
    shown = capsys.readouterr()
    assert shown.err == ""
    assert re.findall(r"^  (\S+) ", shown.out, re.MULTILINE) == list(COMMANDS)
    assert re.findall(r"^([A-Z].*):$", shown.out, re.MULTILINE) == list(
        dict.fromkeys(command.group for command in COMMANDS.values())
    )
    assert max(map(len, shown.out.splitlines())) <= TERMINAL
    needed = "compare modes crosscheck drive chain filter benchmark view"
    assert set(needed.split()) <= set(COMMANDS)


def test_the_overview_is_of_the_commands_that_there_are() -> None:
    """The list is written out, so that help loads none of them."""
    for name, command in COMMANDS.items():
        module = importlib.import_module(f"studies.{command.module}")
        assert callable(module.command) and getattr(module, command.config).__doc__, name
        assert command.text and "\n" not in command.text


def test_help_of_a_command_is_its_options(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["help", "drive"]) == main(["drive", "--help"]) == 0
    first, second = capsys.readouterr().out.split("usage: flexsim drive")[1:]
    assert first.strip() == second.strip() and "--torque" in first
    assert "'drove' is unknown" in said(capsys, ["help", "drove"])


@pytest.mark.parametrize("word", ["--version", "-V", "version"])
def test_version_names_the_commit_and_where_the_models_are(
    word: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([word]) == 0
    version, models = capsys.readouterr().out.splitlines()
    assert re.fullmatch(r"flexsim \d+\.\d+\.\d+( \(commit [0-9a-f]{12}(-dirty)?\))?", version)
    assert (Path(models.removeprefix("models: ")) / "chain6.xml").is_file()


@pytest.mark.parametrize(
    ("word", "meant"),
    [("compere", "compare"), ("Modes", "modes"), ("cross-check", "crosscheck"), ("tuen", "tune")],
)
def test_a_mistyped_command_is_answered_by_the_likely_one(
    word: str, meant: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert said(capsys, [word]).endswith(f"completion. Did you mean {meant}?\n")
    assert "mean" not in said(capsys, ["xyzzy"])


@pytest.mark.slow  # processes of the command are everywhere
def test_python_dash_m_is_the_command() -> None:
    for module in ("flexsim", "studies.main"):
        with process([sys.executable, "-m", module, "filter", "--order", "half"]) as started:
            out, err = started.communicate(timeout=PATIENCE)
            assert (started.returncode, out) == (2, "")
            assert err.startswith("flexsim: filter: ") and err.count("\n") == 1


def test_help_starts_in_a_quarter_of_the_time_of_what_it_does_not_load() -> None:
    """The fastest of a few, side by side: the machine may be busy."""
    heavy = [sys.executable, "-c", "import mujoco, numba, scipy.linalg"]
    help_ = [sys.executable, "-m", "flexsim", "--help"]
    took: dict[int, list[float]] = {0: [], 1: []}
    for _ in range(ROUNDS):
        for i, words in enumerate((heavy, help_)):
            start = time.perf_counter()
            with process(words) as started:
                assert started.wait(PATIENCE) == 0
            took[i].append(time.perf_counter() - start)
    assert min(took[1]) < min(took[0]) / 4


@pytest.mark.parametrize("command", COMMANDS)
def test_an_unknown_option_is_named(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    line = said(capsys, [command, "--nonsense"])
    assert line.startswith(f"flexsim: {command}: ")
    assert line.endswith(f"; see flexsim {command} --help\n")
    assert "----" not in line and "│" not in line


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("Compare", "'Compare' is unknown; choose one of compare, modes"),
        ("drive --out x.csv", "drive: --torque PATH is missing; see flexsim drive --help"),
        ("beam --nonsense", "--mjcf PATH and --parent STR are missing; Unrecognized options: --no"),
        ("compare --perturbation 2", "--perturbation, 2 Perhaps you meant: --perturbations"),
        ("compare --out", "'--out'. Expected 1 values"),
        ("compare --json maybe", "maybe"),
        ("chain --segments six --out c.xml", "--segments: invalid literal for int"),
        ("filter --order half", "could not convert string to float: 'half'"),
        (
            "drive --theta1 half --torque t.csv --out o.csv",
            "--theta1: could not convert string to float: 'half'",
        ),
        ("filter", "--order"),
        ("benchmark --rounds 1.5", "--rounds"),
        ("benchmark --seconds nan", "seconds is nan; give 0.01 to 5"),
        ("modes one.xml two.xml", "two.xml"),
        ("view", "no run is named; give the folder of a run or an .rrd file"),
        ("view nothing", "there is no nothing; give the folder of a run or an .rrd file"),
        ("compare --robot.m-b 1", "--robot.m-b"),
        ("compare --robot.rho 0", "rho (linear density of the flexible link) is 0.0"),
        ("compare --circle.half-width -1", "half width"),
        ("compare --circle.duration inf", "inf"),
    ],
)
def test_what_does_not_parse_is_one_line(
    arguments: str, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert words in said(capsys, arguments.split())


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("compare --perturbation 2", "Perhaps you meant: --perturbations INT Runs behind"),
        ("compare --hardware-torque-limit 1", "--hardware-torque-limit: input length 1"),
        ("filter --format pdf", "invalid choice 'pdf' for argument '--format'"),
        ("tune --payload x", "--exact-payload FLOAT Payload"),
    ],
)
def test_messages_speak_of_what_can_be_typed(
    arguments: str, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    line = said(capsys, arguments.split())
    assert words in line and "None" not in line and "[bold]" not in line


BOXED = """\
╭─ Value error ──────────────────╮
│ Error parsing --n: no          │
│ number                         │
│ ────────────────────────────── │
│ Argument helptext:             │
│     --n INT                    │
╰────────────────────────────────╯
"""
RULED = """\
 Value error
 --------------------------------
  Error parsing --n: no
  number
  -------------------------------
  For full helptext, see flexsim x --help
"""  # where the terminal has no such characters


@pytest.mark.parametrize("message", [BOXED, RULED])
def test_messages_lose_their_frame(message: str) -> None:
    assert unboxed(message) == "Error parsing --n: no number"


@pytest.mark.parametrize(
    ("error", "status", "words"),
    [
        (ParameterError("order is\n 7"), 2, "flexsim: order is 7\n"),
        (OSError(28, "No space left on device", "run.rrd"), 2, "run.rrd: No space left on device"),
        (MemoryError(), 2, "not enough memory"),
        (KeyboardInterrupt(), INTERRUPTED, "interrupted; nothing was kept"),
    ],
)
def test_failures_within_a_command_are_one_line(
    error: BaseException,
    status: int,
    words: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fail(config: object) -> None:
        raise error

    monkeypatch.setattr(filter_study, "command", fail)
    assert words in said(capsys, ["filter", "--order", "0.5"], status)


def test_a_mistake_of_ours_is_not_hidden(monkeypatch: pytest.MonkeyPatch) -> None:
    """Only errors of input are one line: a defect shows its traceback."""

    def fail(config: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(filter_study, "command", fail)
    with pytest.raises(ZeroDivisionError):
        main(["filter", "--order", "0.5"])


def test_ctrl_c_while_loading_is_one_line(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupt(name: str) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(command_line, "importlib", SimpleNamespace(import_module=interrupt))
    assert "interrupted" in said(capsys, ["modes"], INTERRUPTED)


def test_filter_prints_coefficients(capsys: pytest.CaptureFixture[str]) -> None:
    words = "filter --order -3.63 --gain 4.81e14 --realisation tustin --terms 10 --json"
    assert main(words.split()) == 0
    shown = json.loads(capsys.readouterr().out)
    b, a = operator("tustin", -3.63, 1e-3, 10)
    np.testing.assert_allclose(shown["b"], 4.81e14 * np.asarray(b), rtol=1e-15)  # one product
    assert shown["a"] == np.asarray(a).tolist()
    assert b[0] == pytest.approx((2 / 1e-3) ** -3.63, rel=1e-12)  # at z^-1 = 0, in closed form


def test_chain_writes_what_can_be_read(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "chain5.xml"
    assert main(["chain", "--segments", "5", "--out", str(out), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["segments"] == 5
    assert load_chain(out).model.nv == 7
    before = out.read_bytes()
    for wrong in (["--segments", "3"], ["--timestep", "0.01"], []):
        assert str(out) in said(capsys, ["chain", "--out", str(out), *wrong]) or wrong
        assert out.read_bytes() == before and list(tmp_path.iterdir()) == [out]


@pytest.mark.parametrize(
    ("name", "words"),
    [("empty", "is no run of flexsim"), ("table.csv", "no recording"), ("gone.rrd", "there is no")],
)
def test_view_says_what_it_can_open(
    name: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "table.csv").write_text("")
    assert words in said(capsys, ["view", str(tmp_path / name)])


def test_a_closed_pipe_is_no_error() -> None:
    """As with `flexsim filter ... | head -1`."""
    with flexsim("filter", "--order", "0.5", "--json") as process:
        assert process.stdout
        process.stdout.close()
        assert process.wait(PATIENCE) == 0
        process.stdout = None
        assert process.communicate() == (None, "")


def test_ctrl_c_leaves_nothing(tmp_path: Path) -> None:
    """One line, the shell's status, no folder: neither the run's, nor its parent's, nor a log."""
    words = ("compare", "--out", "new/run", "--perturbations", "2000")
    with flexsim(*words, cwd=tmp_path) as process:
        wait_for((tmp_path / "new").exists, process)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=PATIENCE)
        assert (process.returncode, out) == (INTERRUPTED, "")
    assert err == "flexsim: interrupted; nothing was kept\n"
    assert list(tmp_path.iterdir()) == []


def test_readme_names_commands_and_options_that_exist(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Every `flexsim COMMAND --option` of both READMEs is known, every command is in the table."""
    text = README + (ROOT / "models" / "README.md").read_text()
    calls = re.findall(rf"flexsim ((?:{'|'.join(COMMANDS)})\b[^`\n(]*)", text)
    assert {call.split()[0] for call in calls} == set(COMMANDS)
    help_of = {}
    for command in COMMANDS:
        assert main([command, "--help"]) == 0
        help_of[command] = capsys.readouterr().out
    checked = 0
    for call in calls:
        command, *words = call.split("  #")[0].split()
        for word in words:
            if word.lstrip("[").startswith("--"):
                option = re.match(r"\[?(--[\w-]+)", word)
                assert option and re.search(rf"{option[1]}\b", help_of[command]), call
                checked += 1
    assert checked >= 8
    table = re.findall(r"^\| `flexsim ([\w-]+)", README, re.MULTILINE)
    assert sorted(table) == sorted(COMMANDS)


def test_python_of_the_readme_runs(capsys: pytest.CaptureFixture[str]) -> None:
    """And prints what its last lines say."""
    (code,) = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    exec(compile(code, "README.md", "exec"), {})
    printed = capsys.readouterr().out.splitlines()
    stated = [line.removeprefix("# ") for line in code.splitlines() if line.startswith("# ")]
    assert len(stated) == 2 and printed == stated
