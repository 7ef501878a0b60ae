"""The command `flexsim`: one study or tool per subcommand, errors as one line with status 2."""

from __future__ import annotations

import importlib
import os
import sys
from typing import Any

from studies.commands import COMMANDS, unknown, usage

HELP = ("-h", "--help", "help")
VERSION = ("-V", "--version", "version")
NEVER_TYPED = (  # of tyro's messages: what stands for an option that is not given, and markup
    r"\{None\}\||'None', |, 'None'| \(default: (?:None)?\)|\[/?bold\]"
    r"|\[[^]]*\] does not match choices \('None',\) - [^:]*: "
)


def main(arguments: list[str] | None = None) -> int:
    """Run one command; return 0, or 2 after one line on stderr.

    Args:
        arguments: words of the command line; without them those of this process, which then ends
            with the command.
    """
    words = sys.argv[1:] if arguments is None else arguments
    if words[:1] == ["help"] and words[1:]:
        words = [words[1], "--help"]
    if not words or words[0] in HELP:
        return _printed(usage())
    if words[0] in VERSION:
        from studies.core.version import about

        return _printed(about())
    if words[0] not in COMMANDS:
        return complain(unknown(words[0]))
    return _carried_out(words[0], words[1:], ends=arguments is None)


def complain(message: object) -> int:
    """Say in one line on stderr what is wrong; return the status of a command that is refused."""
    from studies.core.text import one_line

    print(f"flexsim: {one_line(message)}", file=sys.stderr)
    return 2


def unboxed(message: str) -> str:
    """Return a boxed, many-line message as one line, without its title and its help text."""
    import re

    text = re.split(r"Argument helptext|For full helptext", message)[0]
    text = re.sub(r"(?s)Missing from.*?(?=[─-]{9}|\Z)", _missing, text)
    text = re.sub(r"(?s)no type matching .*<class '\w+'>: ", "", text)  # one of several types
    text = re.sub(r"╭.*╮|\A.*\n *-{9,} *\n", " ", text)  # the title: in a box, or over a rule
    line = " ".join(re.sub(r"[╰╯│─]+|-{9,}", " ", text).split())
    return re.sub(NEVER_TYPED, "", line).removesuffix(";")


def _missing(found: Any) -> str:
    """Return which options are missing, of a list with their help texts, indented more."""
    import re

    names = re.findall(r"(?m)^(?:│| ) {5}(\S[^│]*?) *│?$", found[0])  # helps stand farther in
    return f"{' and '.join(names)} {'is' if len(names) == 1 else 'are'} missing; "


def _printed(text: str) -> int:
    try:
        print(text, flush=True)
    except BrokenPipeError:
        _close_stdout()
    return 0


def _close_stdout() -> None:
    """Write nothing more to a pipe whose reader has seen enough."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _carried_out(name: str, words: list[str], ends: bool) -> int:
    """Return the status of a command, which signals end at any moment, the process if it `ends`."""
    from flexsim.files.private import private_folder
    from flexsim.numerics.blas import one_thread
    from studies.core import ending

    one_thread()  # before numpy is loaded
    kept = private_folder()
    if kept is not None:  # matplotlib needs a place, also without a home; no user's style is read
        os.environ.setdefault("MPLCONFIGDIR", str(kept / "matplotlib"))
    try:
        with ending.ends_on_signals(ends):
            return _status(name, words)
    except BaseException as error:
        if ending.received() is None and not isinstance(error, KeyboardInterrupt):
            return _refused(name, error)
    status = ending.status()  # whatever a signal has broken is no mistake of ours
    if status == ending.INTERRUPTED:
        complain(ending.farewell())
    if ends:
        ending.leave(status)
    return status


def _status(name: str, words: list[str]) -> int:
    """Return the status of a command that raises nothing."""
    command = COMMANDS[name]
    module = importlib.import_module(f"studies.{command.module}")
    if set(words) & {"-h", "--help"}:
        from studies.shell.help import help_of

        return _printed(help_of(name))
    config = _configuration(getattr(module, command.config), name, words)
    if config is not None:
        if getattr(config, "arm", None) is not None:
            from studies.core.options import require_arm

            require_arm(name, config)
        module.command(config)
        sys.stdout.flush()  # here, where a closed pipe is no error
    return 0


def _configuration(of: type, name: str, words: list[str]) -> Any:
    """Return the configuration that the words of a command give, None if tyro answered them.

    Raises:
        ParameterError: they cannot be understood.
    """
    import contextlib
    import io

    import tyro

    from flexsim.errors import ParameterError

    complaint = io.StringIO()
    try:
        with contextlib.redirect_stderr(complaint):
            return tyro.cli(of, args=words, prog=f"flexsim {name}")
    except SystemExit as stop:
        if not stop.code:
            return None
        said = unboxed(complaint.getvalue())
    raise ParameterError(f"{name}: {said}; see flexsim {name} --help")


def _refused(name: str, error: BaseException) -> int:
    """Return the status of a command that an error ends, after one line about it.

    Raises:
        BaseException: the error, if it is a mistake of ours.
    """
    from controllers.errors import ControllerError
    from flexsim.errors import FlexsimError

    if isinstance(error, FlexsimError | ControllerError):
        return complain(error)
    if isinstance(error, BrokenPipeError):
        _close_stdout()
        return 0
    if isinstance(error, OSError):  # a full disk, a name too long
        return complain(f"{name}: {error.filename or 'writing'}: {error.strerror or error}")
    if isinstance(error, MemoryError):
        return complain(f"{name}: not enough memory; use fewer samples, runs or segments")
    raise error


if __name__ == "__main__":
    sys.exit(main())
