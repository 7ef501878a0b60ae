"""The command `flexsim`: one study or tool per subcommand, errors as one line with status 2."""

from __future__ import annotations

import contextlib
import importlib
import io
import os
import re
import signal
import sys
import threading

import tyro

from controllers.errors import ControllerError
from flexsim.errors import FlexsimError

COMMANDS = {  # name: (module, class of its configuration, what it does)
    "compare": (
        "compare.compare",
        "CompareConfig",
        "run the controllers on both plants: table, figures",
    ),
    "modes": (
        "parity.modes",
        "ModesConfig",
        "frequencies and mode shapes: exact, assumed modes, chain",
    ),
    "crosscheck": (
        "parity.crosscheck",
        "CrosscheckConfig",
        "hold the plants against each other",
    ),
    "drive": (
        "tools.drive",
        "DriveConfig",
        "drive a plant open loop with a recorded torque",
    ),
    "chain": (
        "tools.chain",
        "ChainConfig",
        "tune a chain of segments and write its MJCF",
    ),
    "filter": (
        "tools.filter",
        "FilterConfig",
        "coefficients and response of a fractional operator",
    ),
    "benchmark": (
        "tools.benchmark",
        "BenchmarkConfig",
        "cost of the loops, side by side",
    ),
    "stability": (
        "stability.stability",
        "StabilityConfig",
        "poles, margins, maps of stable gains near rest",
    ),
    "misprints": (
        "misprints.misprints",
        "MisprintsConfig",
        "what each misprint of the paper costs",
    ),
    "reconstruct": (
        "reconstruct.reconstruct",
        "ReconstructConfig",
        "what it takes for Table 2 to be bounded",
    ),
    "realisations": (
        "realisations.realisations",
        "RealisationsConfig",
        "which fractional filter serves best",
    ),
    "pid-question": (
        "pid_question.pid_question",
        "PidQuestionConfig",
        "why integer PIDs failed in the paper",
    ),
    "screening": (
        "screening.screening",
        "ScreeningConfig",
        "what screening by stability saves the tuner",
    ),
    "tune": (
        "tuning.tune",
        "TuneConfig",
        "tune controllers: the paper's genetic algorithm, or a peer",
    ),
    "tables": (
        "tables.tables",
        "TablesConfig",
        "Tables 2, 3, Figure 6 anew; every controller everywhere",
    ),
    "watch": (
        "watch.watch",
        "WatchConfig",
        "follow an MJCF file: modes and cross-check at every save",
    ),
    "ladder": (
        "ladder.ladder",
        "LadderConfig",
        "fidelity against cost: rigid, modes, chains, rod; steps, integrators",
    ),
    "view": (
        "tools.view",
        "ViewConfig",
        "open a run's recording in the rerun viewer",
    ),
}
INTERRUPTED, TERMINATED = 130, 143  # the shell's status for Ctrl-C and SIGTERM


def usage() -> str:
    """Return the overview that `flexsim --help` prints."""
    lines = ["usage: flexsim COMMAND [OPTIONS]   (flexsim COMMAND --help for its options)", ""]
    lines += [f"  {name:<12} {text}" for name, (_, _, text) in COMMANDS.items()]
    return "\n".join(lines)


def one_line(message: str) -> str:
    """Return a boxed, many-line message as one line, without its title and its help text."""
    text = re.split(r"Argument helptext|For full helptext", message)[0]
    text = re.sub(r"╭.*╮|\A.*\n *-{9,} *\n", " ", text)  # the title: in a box, or over a rule
    return " ".join(re.sub(r"[╰╯│─]+|-{9,}", " ", text).split())


def _complain(message: str) -> int:
    print(f"flexsim: {message}", file=sys.stderr)
    return 2


def _interrupted() -> int:
    _complain("interrupted; nothing was kept")
    return INTERRUPTED


def _terminated(*_: object) -> None:
    raise SystemExit(TERMINATED)


def main(arguments: list[str] | None = None) -> int:
    """Run one command; return 0, or 2 after one line on stderr."""
    words = sys.argv[1:] if arguments is None else arguments
    if not words or words[0] in ("-h", "--help"):
        print(usage())
        return 0
    name, rest = words[0], words[1:]
    if name not in COMMANDS:
        return _complain(f"command {name!r} is unknown; choose one of {', '.join(COMMANDS)}")
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, _terminated)  # so that half a run's folder is cleared away
    module_name, class_name, _ = COMMANDS[name]
    complaint = io.StringIO()
    try:
        module = importlib.import_module(f"studies.{module_name}")
        with contextlib.redirect_stderr(complaint):
            config = tyro.cli(getattr(module, class_name), args=rest, prog=f"flexsim {name}")
    except SystemExit as stop:
        if not stop.code:
            return 0
        return _complain(f"{name}: {one_line(complaint.getvalue())}; see flexsim {name} --help")
    except KeyboardInterrupt:
        return _interrupted()
    try:
        module.command(config)
        sys.stdout.flush()  # here, where a closed pipe is no error
    except (FlexsimError, ControllerError) as error:
        return _complain(" ".join(str(error).split()))
    except KeyboardInterrupt:
        return _interrupted()
    except BrokenPipeError:  # the reader of a pipe has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except OSError as error:  # a full disk, a name too long
        return _complain(f"{name}: {error.filename or 'writing'}: {error.strerror}")
    except MemoryError:
        return _complain(f"{name}: not enough memory; use fewer samples, runs or segments")
    return 0


if __name__ == "__main__":
    sys.exit(main())
