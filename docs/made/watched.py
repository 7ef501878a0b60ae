"""What `flexsim watch` says of a second save: a block of studies/watch.

    python docs/made/watched.py

The default chain, then half the stiffness in hinge 3.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from asked import ROOT

PATIENCE = 300.0  # [s]
STIFF, SOFT = 'stiffness="3.45787937081"', 'stiffness="1.7289396854"'


def main() -> None:
    """Print what is said of the second save."""
    text = (ROOT / "models" / "chain6.xml").read_text(encoding="utf-8")
    if STIFF not in text:
        raise ValueError(f"chain6.xml has no {STIFF}")
    with tempfile.TemporaryDirectory() as folder:
        mine, said = Path(folder, "my.xml"), Path(folder, "said.txt")
        mine.write_text(text, encoding="utf-8")
        command = [sys.executable, "-m", "flexsim", "watch", mine, "--no-viewer"]
        environment = {**os.environ, "COLUMNS": "80", "PYTHONUNBUFFERED": "1"}
        with said.open("w") as out:
            watch = subprocess.Popen(command, stdout=out, env=environment)
            try:
                first = _after(said, 1)
                mine.write_text(text.replace(STIFF, SOFT), encoding="utf-8")
                print(_after(said, 2).removeprefix(first))
            finally:
                watch.terminate()
                watch.wait()


def _after(said: Path, saves: int) -> str:
    """Return what was said up to a save's last line, the slowest pole's."""
    until = time.monotonic() + PATIENCE
    while said.read_text(encoding="utf-8").count("pole 3 [Hz]") < saves:
        if time.monotonic() > until:
            raise TimeoutError(f"nothing is said of save {saves}")
        time.sleep(0.2)
    return said.read_text(encoding="utf-8")


if __name__ == "__main__":
    main()
