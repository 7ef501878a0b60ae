"""The script by which a shell completes commands, options and their values.

    flexsim completion bash > ~/.local/share/bash-completion/completions/flexsim

Making it loads every command; in use it loads none: all that it offers stands in it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import tyro


@dataclass(frozen=True)
class CompletionConfig:
    """Print a script by which a shell completes commands, options, names and files."""

    shell: tyro.conf.Positional[Literal["bash", "zsh", "fish"]]
    """The shell that it is for."""


def command(config: CompletionConfig) -> None:
    """Print the script."""
    from studies.shell.scripts import script_of  # with all commands, which help does without

    print(script_of(config.shell), end="")
