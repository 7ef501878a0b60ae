"""The script of each shell.

>>> script_of("bash").splitlines()[-1]
'complete -F _flexsim flexsim'
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from studies.shell.bash import bash_script
from studies.shell.fish import fish_script
from studies.shell.words import Words, words_of_all
from studies.shell.zsh import zsh_script

SCRIPTS: dict[str, Callable[[Sequence[Words]], str]] = {
    "bash": bash_script,
    "zsh": zsh_script,
    "fish": fish_script,
}


def script_of(shell: str) -> str:
    """Return the script by which a shell, a key of `SCRIPTS`, completes all commands."""
    return SCRIPTS[shell](words_of_all())
