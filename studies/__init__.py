"""One folder per question: configuration, run, tables, figures, and a command.

A room imports only the rooms before it in `ROOMS`; a test holds that.
"""

ROOMS = (
    *(
        "headings",
        "core",
        "tuning",
        "spec",
        "run",
        "parity",
        "compare",
        "ladder",
        "converge",
        "stability",
        "reconstruct",
    ),
    *("misprints", "tables", "pid_question", "realisations", "rules", "screening", "laboratory"),
    *("report", "view", "watch", "play", "tools", "beam", "identify", "experiment", "animate"),
    "arena",
    *("commands", "shell", "main"),
)
