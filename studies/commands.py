"""The commands of `flexsim`, as its help names them; what is behind one loads when it is called.

>>> module, configuration, text = COMMANDS["compare"]
"""

from __future__ import annotations

COMMANDS = {  # name: (module, class of its configuration, what it does)
    "compare": (
        "compare.compare",
        "CompareConfig",
        "run the controllers on both plants: table, figures",
    ),
    "run": (
        "run.run",
        "RunConfig",
        "carry out a study file of your own: one machine or a cluster",
    ),
    "check": (
        "run.check",
        "CheckConfig",
        "what a study file means: mistakes, how many runs, at what cost",
    ),
    "export": (
        "run.export",
        "ExportConfig",
        "one run's time series out of a study: CSV, Parquet, MATLAB",
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
    "follow": (
        "tools.follow",
        "FollowConfig",
        "close one loop: a controller follows a trajectory on a plant",
    ),
    "chain": (
        "tools.chain",
        "ChainConfig",
        "tune a chain of segments and write its MJCF",
    ),
    "filter": (
        "tools.filter",
        "FilterConfig",
        "coefficients and response of an operator or a controller; C, MATLAB",
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
    "structures": (
        "pid_question.structures",
        "StructuresConfig",
        "fractional, PID or PD, v mirrored or ignored, at equal effort",
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
    "play": (
        "play.play",
        "PlayConfig",
        "play with the closed loop, live, in MuJoCo's viewer: push, load, retune",
    ),
    "ladder": (
        "ladder.ladder",
        "LadderConfig",
        "fidelity against cost: rigid, modes, chains, rod; steps, integrators",
    ),
    "converge": (
        "converge.converge",
        "ConvergeConfig",
        "how many modes, segments, which step: down to the exact beam",
    ),
    "view": (
        "tools.view",
        "ViewConfig",
        "open a run's recording in the rerun viewer",
    ),
}


def usage() -> str:
    """Return the overview that `flexsim --help` prints."""
    lines = ["usage: flexsim COMMAND [OPTIONS]   (flexsim COMMAND --help for its options)", ""]
    lines += [f"  {name:<12} {text}" for name, (_, _, text) in COMMANDS.items()]
    lines += ["", "flexsim help COMMAND is the same; flexsim --version says which version this is"]
    return "\n".join(lines)


def unknown(name: str) -> str:
    """Return what to say of a command that there is not, with the one that was likely meant."""
    import difflib

    close = difflib.get_close_matches(name.lower(), COMMANDS, n=1)
    hint = f". Did you mean {close[0]}?" if close else ""
    return f"command {name!r} is unknown; choose one of {', '.join(COMMANDS)}{hint}"
