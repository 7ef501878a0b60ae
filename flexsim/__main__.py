"""`python -m flexsim`, the same as the command `flexsim`."""

import signal
import sys


def run() -> None:
    """Run the command that the words of the command line name, and exit with its status."""
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.SIG_DFL)  # quietly, until there is more to end
    from studies.main import main

    sys.exit(main())


if __name__ == "__main__":
    run()
