"""The commands of `flexsim`, as its help names them; what is behind one loads when it is called.

>>> COMMANDS["compare"].module
'compare.compare'
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

COMPARING = "Compare the models"
STUDYING = "Your own study"
CONTROLLING = "Controllers"
PAPER = "What the paper leaves open"
MODELLING = "Models and files"
LOOKING = "Look, and set up"


class Command(NamedTuple):
    """A command: module in `studies`, class of its configuration, what it does, group of help."""

    module: str
    config: str
    text: str
    group: str


COMMANDS = {  # by name, groups together
    "compare": Command(
        "compare.compare",
        "CompareConfig",
        "run the controllers on both plants: table, figures",
        COMPARING,
    ),
    "modes": Command(
        "parity.modes",
        "ModesConfig",
        "frequencies and mode shapes: exact, assumed modes, chain",
        COMPARING,
    ),
    "crosscheck": Command(
        "parity.crosscheck",
        "CrosscheckConfig",
        "hold the plants against each other",
        COMPARING,
    ),
    "ladder": Command(
        "ladder.ladder",
        "LadderConfig",
        "error against cost: rigid, modes, chains, rod; integrators",
        COMPARING,
    ),
    "converge": Command(
        "converge.converge",
        "ConvergeConfig",
        "how many modes, segments, which step: down to the exact beam",
        COMPARING,
    ),
    "benchmark": Command(
        "tools.benchmark",
        "BenchmarkConfig",
        "cost of the loops, side by side",
        COMPARING,
    ),
    "run": Command(
        "run.run",
        "RunConfig",
        "carry out a study file of your own: one machine or a cluster",
        STUDYING,
    ),
    "check": Command(
        "run.check",
        "CheckConfig",
        "what a study file means: mistakes, how many runs, at what cost",
        STUDYING,
    ),
    "export": Command(
        "run.export",
        "ExportConfig",
        "one run's time series out of a study: CSV, Parquet, MATLAB",
        STUDYING,
    ),
    "tune": Command(
        "tuning.tune",
        "TuneConfig",
        "tune controllers: the paper's genetic algorithm, or a peer",
        CONTROLLING,
    ),
    "follow": Command(
        "tools.follow",
        "FollowConfig",
        "close one loop: a controller follows a trajectory on a plant",
        CONTROLLING,
    ),
    "filter": Command(
        "tools.filter",
        "FilterConfig",
        "coefficients and response of an operator or a controller",
        CONTROLLING,
    ),
    "stability": Command(
        "stability.stability",
        "StabilityConfig",
        "poles, margins, maps of stable gains near rest",
        CONTROLLING,
    ),
    "realisations": Command(
        "realisations.realisations",
        "RealisationsConfig",
        "which fractional filter serves best",
        CONTROLLING,
    ),
    "arena": Command(
        "arena.arena",
        "ArenaConfig",
        "the best class of controllers, at equal effort",
        CONTROLLING,
    ),
    "rules": Command(
        "rules.rules",
        "RulesConfig",
        "fractional designs by rule: gains, margins, bode, steps",
        CONTROLLING,
    ),
    "screening": Command(
        "screening.screening",
        "ScreeningConfig",
        "what screening by stability saves the tuner",
        CONTROLLING,
    ),
    "structures": Command(
        "pid_question.structures",
        "StructuresConfig",
        "fractional, PID or PD, v mirrored or ignored, at equal effort",
        CONTROLLING,
    ),
    "tables": Command(
        "tables.tables",
        "TablesConfig",
        "Tables 2, 3, Figure 6 anew; every controller everywhere",
        PAPER,
    ),
    "pid-question": Command(
        "pid_question.pid_question",
        "PidQuestionConfig",
        "why integer PIDs failed in the paper",
        PAPER,
    ),
    "misprints": Command(
        "misprints.misprints",
        "MisprintsConfig",
        "what each misprint of the paper costs",
        PAPER,
    ),
    "reconstruct": Command(
        "reconstruct.reconstruct",
        "ReconstructConfig",
        "what it takes for Table 2 to be bounded",
        PAPER,
    ),
    "laboratory": Command(
        "laboratory.laboratory",
        "LaboratoryConfig",
        "what made the paper's laboratory worse than its simulation",
        PAPER,
    ),
    "watch": Command(
        "watch.watch",
        "WatchConfig",
        "follow an MJCF file: modes and cross-check at every save",
        MODELLING,
    ),
    "chain": Command(
        "tools.chain",
        "ChainConfig",
        "tune a chain of segments and write its MJCF",
        MODELLING,
    ),
    "beam": Command(
        "beam.beam",
        "BeamConfig",
        "put a flexible beam, as a tuned chain, on a body of any MJCF file",
        MODELLING,
    ),
    "drive": Command(
        "tools.drive",
        "DriveConfig",
        "drive a plant open loop with a recorded torque",
        MODELLING,
    ),
    "identify": Command(
        "identify.identify",
        "IdentifyConfig",
        "the robot's numbers from logs of torques and what they moved",
        MODELLING,
    ),
    "experiment": Command(
        "experiment.experiment",
        "ExperimentConfig",
        "torques that tell the robot's numbers, and how well they will",
        MODELLING,
    ),
    "play": Command(
        "play.play",
        "PlayConfig",
        "the closed loop live in MuJoCo's viewer: push it, turn its gains",
        LOOKING,
    ),
    "view": Command(
        "view.view",
        "ViewConfig",
        "look at runs in the rerun viewer, side by side if several",
        LOOKING,
    ),
    "report": Command(
        "report.report",
        "ReportConfig",
        "runs as one HTML file: answers, tables, figures, differences",
        LOOKING,
    ),
    "animate": Command(
        "animate.animate",
        "AnimateConfig",
        "both arms over the reference, moving or still: GIF, WebP, PNG",
        LOOKING,
    ),
    "completion": Command(
        "shell.completion",
        "CompletionConfig",
        "a script by which bash, zsh or fish complete commands and options",
        LOOKING,
    ),
}


def usage() -> str:
    """Return the overview that `flexsim --help` prints."""
    lines = ["usage: flexsim COMMAND [OPTIONS]   (flexsim COMMAND --help for its options)"]
    for group, members in itertools.groupby(COMMANDS.items(), lambda item: item[1].group):
        lines += ["", f"{group}:"]
        lines += [f"  {name:<12} {command.text}" for name, command in members]
    lines += ["", "flexsim help COMMAND is the same; flexsim --version says which version this is"]
    return "\n".join(lines)


def unknown(name: str) -> str:
    """Return what to say of a command that there is not, with the one that was likely meant."""
    import difflib

    close = difflib.get_close_matches(name.lower(), COMMANDS, n=1)
    hint = f". Did you mean {close[0]}?" if close else ""
    return f"command {name!r} is unknown; choose one of {', '.join(COMMANDS)}{hint}"
