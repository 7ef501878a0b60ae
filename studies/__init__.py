"""One folder per question: configuration, run, tables, figures, and a command.

A room imports only `core` and the rooms before it in `ROOMS`; a test holds that.
"""

ROOMS = (
    *(
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
    *("misprints", "tables", "pid_question", "realisations", "screening", "watch", "play", "tools"),
    *("commands", "main"),
)
