"""The script by which a shell completes commands, options and their values.

    flexsim completion bash > ~/.local/share/bash-completion/completions/flexsim

Making it loads every command; in use it loads none: all that it offers stands in it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import tyro

from studies.shell.bash import bash_script
from studies.shell.fish import fish_script
from studies.shell.words import Words, words_of_all
from studies.shell.zsh import zsh_script

SCRIPTS: dict[str, Callable[[Sequence[Words]], str]] = {
    "bash": bash_script,
    "zsh": zsh_script,
    "fish": fish_script,
}


@dataclass(frozen=True)
class CompletionConfig:
    """Print a script by which a shell completes commands, options, names and files."""

    shell: tyro.conf.Positional[Literal["bash", "zsh", "fish"]]
    """The shell that it is for."""


def command(config: CompletionConfig) -> None:
    """Print the script."""
    print(SCRIPTS[config.shell](words_of_all()), end="")
