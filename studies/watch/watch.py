"""What does this edit do? Modes and a quick cross-check of an MJCF file at every save.

`flexsim watch my.xml` prints them, and shows them in the rerun viewer (`.recording`), until
Ctrl-C. A file that cannot be used is said so in one line, and watched on.
"""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Literal, Protocol

import tyro

from flexsim.errors import FlexsimError, ParameterError, RunError
from flexsim.loop.settings import DEFAULT_SETTING
from studies.core.options import HardwareOptions, NameOptions
from studies.core.study_options import SeedOptions, SettingName, check
from studies.core.text import one_line, spelled
from studies.watch.closed_loop import LoopAsked, asked_of
from studies.watch.files import Sleep, lasts, snapshots
from studies.watch.report import json_line, show_save
from studies.watch.save import Save, answered

BROKEN = 2  # the shell's status of --once with a file that cannot be used


@dataclass(frozen=True)
class WatchConfig(HardwareOptions, SeedOptions, NameOptions):
    """Follow an MJCF file until Ctrl-C: modes, a cross-check and a closed loop at every save."""

    file: tyro.conf.Positional[Path]
    """The MJCF file; files that it includes are watched too."""
    beam: Literal["file", "analytic"] = "file"
    """Modes of the assumed-modes plant: the file's own chain's, or the paper's beam's on the
    file's rigid bodies."""
    loop: bool = True
    """Close a loop around both plants, too: envelopes, growth and poles."""
    controller: str = "circle"
    """Of our own line, two-loop, circle; tuned in the ideal loop ideal-line, ideal-two-loop,
    ideal-circle; of Table 2 figure-3, figure-4, figure-5; or the folder of a run of flexsim tune.
    A name comes before a folder; ./line is the folder."""
    trajectory: str | None = None
    """line, two-loop or circle; the controller's own unless given."""
    setting: SettingName = DEFAULT_SETTING
    hardware: str = field(default="bench", kw_only=True)
    """Sensors, computer and motors: ideal, delayed (a sample of delay) or bench (assumed: that
    delay, 10 and 5 N m, 8192 counts a turn, 0.1 mm of noise on v), for which ours are."""
    connect: str | None = None
    """Viewer to send to, as rerun+http://127.0.0.1:9876/proxy. Without it, the one running on this
    machine, or else a new one."""
    viewer: bool = True
    """Show it in the rerun viewer."""
    rrd: Path | None = None
    """Write a recording of the last save to this file, instead of showing it."""
    once: bool = False
    """Answer once and end."""
    json: bool = False
    """Print one JSON object per save, a line each."""


class Display(Protocol):
    """Where saves are shown."""

    def show(self, saves: list[Save], error: str | None = None) -> None:
        """Show the last of the good saves, the history, and what is wrong with the file now.

        Raises:
            FlexsimError: it cannot be shown.
        """


@dataclass
class Watch:
    """A file being watched, and what it answered so far.

    Attributes:
        config: what to do. display: where to show it, if anywhere. sleep, now: the clock.
        saves: the good ones so far. asked: the loop to close, if any.
    """

    config: WatchConfig
    display: Display | None = None
    sleep: Sleep = time.sleep
    now: Callable[[], datetime] = datetime.now
    saves: list[Save] = field(default_factory=list)
    asked: LoopAsked | None = None

    def run(self) -> None:
        """Answer every save of the file, or the file as it is if only once.

        Raises:
            SystemExit: the file cannot be used, and was to be answered once.
        """
        path, once = self.config.file, self.config.once
        told = None  # contents that were spoken of
        for snapshot in snapshots(path, self.sleep):
            if snapshot.contents == told:
                continue
            try:
                save = self._answer()
            except FlexsimError as error:
                if not once and not lasts(snapshot, self.sleep):
                    continue  # it was half written
                self._refuse(str(error))
            else:
                self.saves.append(save)
                self._report(save)
            told = snapshot.contents
            if once:
                return

    def _answer(self) -> Save:
        path = self.config.file
        if not path.exists():
            raise RunError(f"{path}: the file is gone; waiting for it to return")
        number, names = len(self.saves) + 1, self.config.names
        return answered(path, self.config.beam, number, self.now(), names, self.asked)

    def _refuse(self, message: str) -> None:
        """Say what is wrong with the file."""
        if self.config.json:
            print(json_line(self.now(), error=message), flush=True)
        complain(message)
        self._show(message)
        if self.config.once:
            raise SystemExit(BROKEN)

    def _report(self, save: Save) -> None:
        """Say what a good save brought."""
        if self.config.json:
            print(json_line(save.when, save), flush=True)
        else:
            show_save(save, self.saves[-2] if len(self.saves) > 1 else None)
        self._show()

    def _show(self, error: str | None = None) -> None:
        if self.display is None:
            return
        try:
            self.display.show(self.saves, error)
        except FlexsimError as problem:
            if self.config.once:
                raise
            complain(" ".join(str(problem).split()))


def complain(message: str) -> None:
    """Say in one line what is wrong."""
    print(f"flexsim: {one_line(message)}", file=sys.stderr, flush=True)


def loop_of(config: WatchConfig) -> LoopAsked | None:
    """Return the loop that a configuration wants closed at every save, if any.

    Raises:
        ParameterError, RunError: an option of the loop cannot be used.
    """
    check(config)
    if not config.loop:
        return None
    return asked_of(config.controller, config.trajectory, config.setting, config.built)


def display_of(config: WatchConfig) -> Display | None:
    """Return where a configuration wants its saves shown.

    Raises:
        ParameterError: two places at once.
        RunError: the viewer to connect to does not answer, or the recording cannot be written.
    """
    chosen = [config.connect is not None, not config.viewer, config.rrd is not None]
    if sum(chosen) > 1:
        raise ParameterError("--connect, --no-viewer and --rrd exclude each other; give one")
    if not config.viewer:
        return None
    from studies.watch import recording as watch_recording

    if config.rrd is not None:
        return watch_recording.RecordingFile(config.rrd)
    if config.connect is not None:
        return watch_recording.Viewer(config.connect)
    try:
        return watch_recording.Viewer.running_or_new()
    except RunError as error:
        complain(f"{error}; printing only")
        return None


def command(config: WatchConfig) -> None:
    """Watch the file until Ctrl-C.

    Raises:
        RunError: there is no such file.
        ParameterError: more than one place to show it.
    """
    if not config.file.is_file():
        raise RunError(f"there is no file {config.file}; give an MJCF file that exists")
    with contextlib.suppress(KeyboardInterrupt):
        asked = loop_of(config)
        watch = Watch(config, display_of(config), asked=asked)
        if not (config.once or config.json):
            print(f"watching {spelled(config.file)} (Ctrl-C ends it)", flush=True)
        watch.run()
