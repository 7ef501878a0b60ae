"""Open a run's recording in the rerun viewer: `flexsim view RUN`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import tyro

from flexsim.errors import RunError

RECORDING = "run.rrd"


@dataclass(frozen=True)
class ViewConfig:
    """Open a recorded run in the rerun viewer."""

    run: tyro.conf.Positional[Path]
    """Folder of the run, or an .rrd file."""
    web: bool = False
    """Show it in a browser on this machine instead of in a window."""


def recording_of(run: Path) -> Path:
    """Return the recording of a run folder, or the .rrd file itself.

    Raises:
        RunError: the path does not exist, or is no recording and holds none.
    """
    if not run.exists():
        raise RunError(f"there is no {run}; give the folder of a run or an .rrd file")
    recording = run / RECORDING if run.is_dir() else run
    if run.is_dir() and not recording.is_file():
        raise RunError(f"{run} holds no {RECORDING}; give the folder of a run or an .rrd file")
    if recording.suffix != ".rrd":
        raise RunError(f"{run} is no recording; give the folder of a run or an .rrd file")
    return recording


def command(config: ViewConfig) -> None:
    """Open the recording, and return when the viewer is closed.

    Raises:
        RunError: there is no recording there, or the viewer cannot start.
    """
    recording = recording_of(config.run)
    from flexsim.recording.rerun_file import open_recording

    open_recording(recording, config.web)
