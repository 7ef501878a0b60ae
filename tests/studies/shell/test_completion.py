"""`flexsim completion`: what bash, zsh and fish themselves offer with the scripts."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from programs import required

from controllers import REALISATIONS
from flexsim.loop.hardware import HARDWARE
from flexsim.robot.plant_names import plant_kind
from studies.commands import COMMANDS
from studies.main import main
from studies.shell.choices import VALUES, named
from studies.shell.scripts import SCRIPTS
from studies.shell.words import Words, words_of_all
from studies.tuning.found import OWN

PATIENCE = 60.0  # [s]
BASH = r"""
source ./script
COMP_WORDS=("$@") COMP_CWORD=$(($# - 1))
_flexsim flexsim "${COMP_WORDS[COMP_CWORD]}"
printf '%s\n' "${COMPREPLY[@]}"
"""
ZSH = r"""
compdef() { :; }
source ./script
compadd() { [[ $1 == -a ]] && print -l -- ${(P)2}; }
_describe() { print -l -- ${${(P)@[-1]}%%:*}; }
_files() { if [[ $1 == -/ ]]; then print -l -- *(/); else print -l -- ${~2}(N) *(/); fi; }
compset() { current=${current#*=}; }
words=("$@") CURRENT=$#
_flexsim
"""
FISH = """
source ./script
complete -C "$argv"
"""


@pytest.fixture(scope="module")
def words() -> list[Words]:
    return words_of_all()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a robot, a study, a log and a run."""
    made = tmp_path_factory.mktemp("typed")
    for name in ("arm.xml", "mine.toml", "log.csv", "seen.rrd", "done.json", "old.html"):
        (made / name).write_text("")
    (made / "runs").mkdir()
    return made


@pytest.fixture(scope="module", params=sorted(SCRIPTS))
def complete(
    request: pytest.FixtureRequest, words: list[Words], folder: Path
) -> Callable[[str], set[str]]:
    """Return what a shell offers for the last of some typed words, those that begin like it."""
    shell = request.param
    program = required(shell)

    def offered(typed: str) -> set[str]:
        (folder / "script").write_text(SCRIPTS[shell](words), encoding="utf-8")
        line = ["flexsim", *typed.split(" ")]
        if shell == "fish":
            call = [program, "-N", "-c", FISH, " ".join(line)]
        elif shell == "zsh":
            call = [program, "-f", "-c", ZSH, "zsh", *line]
        else:
            call = [program, "--norc", "-c", BASH, "bash", *parted(line)]
        done = subprocess.run(
            call, capture_output=True, text=True, cwd=folder, timeout=PATIENCE, check=False
        )
        assert done.stderr == "", done.stderr
        found = {each.split("\t")[0].rpartition("=")[2].rstrip("/") for each in lines(done.stdout)}
        start = line[-1].rpartition("=")[2]
        return {each for each in found if each.startswith(start)}

    return offered


def lines(text: str) -> list[str]:
    return [line for line in text.splitlines() if line]


def parted(line: list[str]) -> list[str]:
    """Return words as bash has them: = and : are words of their own."""
    spaced = [each.replace("=", " = ").replace(":", " : ") for each in line]
    return [part for each in spaced for part in (each.split(" ") if each.strip() else [""])]


@pytest.mark.parametrize("shell", SCRIPTS)
def test_it_prints_the_script(
    shell: str, words: list[Words], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["completion", shell]) == 0
    shown = capsys.readouterr()
    assert shown.err == "" and shown.out == SCRIPTS[shell](words)
    assert shown.out.endswith("\n") and all(command in shown.out for command in COMMANDS)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [("tcsh", "'tcsh'"), ("", "{bash,zsh,fish}"), ("bash zsh", "zsh"), ("bash --json", "--json")],
)
def test_another_shell_is_refused(
    arguments: str, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["completion", *arguments.split()]) == 2
    shown = capsys.readouterr()
    assert shown.out == "" and shown.err.count("\n") == 1 and said in shown.err


def test_commands(complete: Callable[[str], set[str]]) -> None:
    assert complete("") - {"help"} == set(COMMANDS)
    assert complete("com") == {"compare", "completion"}
    assert complete("help st") == {"stability", "structures"}
    assert complete("nothing --") == set()


def test_options(complete: Callable[[str], set[str]]) -> None:
    assert complete("compare --hardware-t") == {"--hardware-torque-limit"}
    assert complete("view --") == {
        *("--web", "--case", "--save", "--force", "--code", "--no-code", "--help"),
    }
    assert complete("watch my.xml --v") | {"--no-viewer"} == {"--viewer", "--no-viewer"}
    assert complete("compare --robot.pay") == {"--robot.payload", "--robot.payload-inertia"}
    assert "--no-viewer" in complete("watch my.xml --no-")


def test_values(complete: Callable[[str], set[str]]) -> None:
    assert complete("stability --controllers line figure-") == {"figure-3", "figure-4", "figure-5"}
    assert complete("compare --hardware ") == {*HARDWARE, "own"}
    assert complete("compare --hardware=be") == {"bench"}
    assert complete("compare --json --plants chain cl") == {"closed-chain"}
    assert complete("compare --plants chain:5 cl") == {"closed-chain"}
    assert "closed-chain" not in complete("compare --plants chain rod cl")
    assert complete("export run --case 1 --format m") == {"mat"}
    assert complete("tune --controller f") == {"fractional"}
    assert complete("completion ") & {*SCRIPTS} == {*SCRIPTS}
    assert complete("compare --period ") == set()
    assert complete("play --plant ") == {"chain", "untuned", "rule-of-thumb", "rod"}


def test_files(complete: Callable[[str], set[str]], folder: Path) -> None:
    everything = {each.name for each in folder.iterdir()} | {"script"}
    for typed, ending in (
        ("compare --mjcf ", "arm.xml"),
        ("watch ", "arm.xml"),
        ("run ", "mine.toml"),
        ("drive --torque ", "log.csv"),
        ("view ", "seen.rrd"),
        ("follow --controller ", "runs"),
        ("compare --out ", "runs"),
        ("play ", "arm.xml"),
        ("play --record ", "seen.rrd"),
        ("play --replay ", "done.json"),
        ("view --save ", "seen.rrd"),
        ("report --out ", "old.html"),
    ):
        found = complete(typed) & everything
        assert found == {ending, "runs"}, typed
    assert {"script", "runs"} <= complete("filter --export ")


def test_names_are_those_of_their_homes() -> None:
    assert set(named("follow", "controller")) == set(OWN)
    assert named("filter", "realisation") == tuple(REALISATIONS)
    assert all(plant_kind(name) for name in named("drive", "plant"))
    for key in VALUES:  # an exception for a command that there is not
        assert " " not in key or key.split(" ")[0] in COMMANDS
