"""MuJoCo's own viewer over a live loop: keys, sliders and the mouse in; arms and numbers out.

    >>> play_in_window(live, pace, watcher, deeds)      # returns when the window is closed

`mujoco.viewer.launch_passive`, not the new `mujoco.studio`: it shows a scene and texts of ours over
MuJoCo's arm, has sliders (those of the controls, which are the knobs here), hands the mouse's
perturbation over, and draws by plain OpenGL, so that it runs on machines without a graphics card,
under a virtual display, too.
"""

from __future__ import annotations

import contextlib
import queue
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from types import FrameType
from typing import Any

import mujoco
import numpy as np

from controllers import ControllerError
from flexsim.errors import FlexsimError, ParameterError, RunError
from flexsim.numerics.dense import product
from studies.play.drawing import Trails, draw, shown_model
from studies.play.knobs import KNOBS, LAW, told
from studies.play.live import Live
from studies.play.pace import FASTEST, SLOWEST, Pace
from studies.play.pushes import Point
from studies.play.reserves import Answer, Watcher

FRAME = 1 / 60  # [s]
SWITCHED = 5e-4  # [s] after which Python's threads change, so that margins need not wait
JOINED = 5.0  # [s] for the viewer's thread to end
SPRING, FORCE_MOST = 5.0, 5.0  # [N/m] between mouse and point; [N]
TWIST, TORQUE_MOST = 0.2, 1.0  # [N m/rad]; [N m]
SLIDER_DIGITS = 3
SPEED_STEP = 1.25
KEYS = {  # GLFW's numbers
    "space": 32,
    **{letter: ord(letter) for letter in "89HPRV"},
    **{"right": 262, "left": 263, "down": 264, "up": 265},
}
HELP = (
    ("space", "pause, go on"),
    ("up, down", "choose a knob"),
    ("left, right", "turn it; or by the sliders under Control, on the right"),
    ("8, 9", "slower, faster up to real time"),
    ("P", "pick up a payload, let it go"),
    ("R", "restart from rest"),
    ("V", "record what was seen since the start"),
    ("double click", "choose a body; then drag with ctrl: right pushes, left turns"),
    ("H", "this help"),
)
VIEWERS = tuple("HPV")  # keys that switch something of the viewer's, too: switched back
Deed = Callable[[], str]


def require_display() -> None:
    """Refuse to open a window where none can be.

    Raises:
        RunError: there is no display, or none that draws.
    """
    try:
        import glfw
    except ImportError as error:
        raise RunError(f"no window can be opened: {error}; use --headless") from None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if not glfw.init():
            raise RunError("there is no display to open a window on; use --headless without one")
        glfw.window_hint(glfw.VISIBLE, glfw.FALSE)
        probe = glfw.create_window(64, 64, "flexsim", None, None)
        glfw.default_window_hints()
        if not probe:
            raise RunError("the display cannot draw by OpenGL; use --headless, without a window")
        glfw.destroy_window(probe)


@contextlib.contextmanager
def _viewer(model: mujoco.MjModel, data: mujoco.MjData, keys: Any) -> Iterator[Any]:
    """Give MuJoCo's passive viewer, closed with its thread at the end of the block."""
    import mujoco.viewer

    before = set(threading.enumerate())
    try:
        viewer = mujoco.viewer.launch_passive(
            model, data, key_callback=keys.put, show_left_ui=False
        )
    except RuntimeError as error:  # macOS wants mjpython
        raise RunError(f"the viewer cannot start: {error}; use --headless") from None
    mine = set(threading.enumerate()) - before
    try:
        yield viewer
    finally:
        viewer.close()
        for thread in mine:
            thread.join(JOINED)


@contextlib.contextmanager
def interrupt_closes() -> Iterator[threading.Event]:
    """Have the first Ctrl-C set an event, as a window is closed; threads change often meanwhile."""
    asked = threading.Event()
    heard = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(heard):
        yield asked
        return

    def once(number: int, frame: FrameType | None) -> None:
        if asked.is_set():
            heard(number, frame)
        asked.set()

    signal.signal(signal.SIGINT, once)
    wakeup = signal.set_wakeup_fd(-1)  # `studies.core.ending` would end the process
    often = sys.getswitchinterval()
    sys.setswitchinterval(SWITCHED)
    try:
        yield asked
    finally:
        sys.setswitchinterval(often)
        signal.set_wakeup_fd(wakeup)
        signal.signal(signal.SIGINT, heard)


def play_in_window(
    live: Live,
    pace: Pace,
    watcher: Watcher,
    record: Deed,
    payload_step: float,
    seconds: float | None = None,
) -> float:
    """Play until the window is closed, or for so much simulated time [s]; return the wall time.

    Args:
        live, pace, watcher: the loop, its clock, its margins. record: what key V does; says so.
        payload_step: what key P picks up [kg].

    Raises:
        RunError: there is no display.
    """
    require_display()
    model = shown_model(live.stage.mujoco)
    data = mujoco.MjData(model)
    keys: queue.SimpleQueue[int] = queue.SimpleQueue()
    table = _Table(live, pace, watcher, record, payload_step, model, data)
    with interrupt_closes() as closed, _viewer(model, data, keys) as viewer:
        table.open(viewer)
        pace.reset()
        begun = time.monotonic()
        while viewer.is_running() and not closed.is_set():
            start = time.monotonic()
            while not keys.empty():
                table.key(keys.get())
            due = pace.due()
            if seconds is not None:
                due = min(due, round(seconds / live.length) - live.period)
            table.frame(viewer, due)
            if seconds is not None and live.period >= round(seconds / live.length):
                break
            time.sleep(max(0.0, FRAME - (time.monotonic() - start)))
        return time.monotonic() - begun


class _Table:
    """What the window's keys, sliders and mouse act on, and what it shows."""

    def __init__(
        self,
        live: Live,
        pace: Pace,
        watcher: Watcher,
        record: Deed,
        payload_step: float,
        model: mujoco.MjModel,
        data: mujoco.MjData,
    ) -> None:
        self.live, self.pace, self.watcher, self.record = live, pace, watcher, record
        self.payload_step, self.model, self.data = payload_step, model, data
        self.chosen, self.help, self.said = 0, False, "H: help"
        self.asked: object = None
        self.trails = Trails(live.stage.reference.tip)
        self.flags: np.ndarray[Any, Any] | None = None

    def open(self, viewer: Any) -> None:
        """Arrange what the viewer shows at first."""
        with viewer.lock():
            viewer.cam.lookat[:] = self.model.stat.center
            viewer.cam.distance = 1.7 * self.model.stat.extent
            viewer.cam.azimuth, viewer.cam.elevation = 90.0, -65.0
            shadow = mujoco.mjtRndFlag.mjRND_SHADOW  # ten times a frame's cost by software
            viewer.user_scn.flags[shadow] = 0
            self.flags = np.array(viewer.opt.flags)
        self._write_sliders()

    def key(self, code: int) -> None:
        """Do what a key is for."""
        names = list(KNOBS)
        live = self.live
        if code == KEYS["space"]:
            self.pace.pause(not self.pace.paused)
        elif code in (KEYS["up"], KEYS["down"]):
            self.chosen = (self.chosen + (1 if code == KEYS["down"] else -1)) % len(names)
        elif code in (KEYS["left"], KEYS["right"]):
            name = names[self.chosen]
            value = KNOBS[name].stepped(getattr(live.knobs, name), code == KEYS["right"])
            self._turn(name, value)
        elif code in (KEYS["8"], KEYS["9"]):
            factor = SPEED_STEP if code == KEYS["9"] else 1 / SPEED_STEP
            self.pace.set_speed(min(max(self.pace.speed * factor, SLOWEST), FASTEST))
        elif code == KEYS["P"]:
            self._turn("payload", 0.0 if live.knobs.payload else self.payload_step)
        elif code == KEYS["R"]:
            live.restart()
            self.trails.clear()
            self.pace.reset()
        elif code == KEYS["V"]:
            self._try(self.record)
            self.pace.reset()
        elif code == KEYS["H"]:
            self.help = not self.help

    def _turn(self, name: str, value: float) -> None:
        def deed() -> str:
            if value != getattr(self.live.knobs, name):
                self.live.turn(name, value)
            return f"{name} {told(name, value)}"

        self._try(deed)

    def _try(self, deed: Deed) -> None:
        """Do something; say what came of it, or why it cannot be."""
        try:
            self.said = deed()
        except (FlexsimError, ControllerError) as error:
            self.said = " ".join(str(error).split())

    def frame(self, viewer: Any, due: int) -> None:
        """Take what sliders and mouse say, advance by periods, and show it."""
        self._read_sliders()
        self._read_mouse(viewer)
        self.live.advance(due)
        for first, *tips in self.live.tips:
            self.trails.add(first, tips)
        self.live.tips.clear()
        self._ask()
        with viewer.lock():
            self._show(viewer)
        viewer.set_texts(self._texts())
        viewer.sync()

    def _read_sliders(self) -> None:
        cleared = not self.data.ctrl.any()  # by the button over the sliders: as at the start
        for i, name in enumerate(KNOBS):
            if cleared:
                self._turn(name, getattr(self.live.stage.knobs, name))
            elif self.data.ctrl[i] != self.sliders[i]:
                digits = 0 if name in (LAW, "delay") else SLIDER_DIGITS
                knob = KNOBS[name]
                value = round(float(self.data.ctrl[i]), digits)
                self._turn(name, min(max(value, knob.low), knob.high))
        self._write_sliders()

    def _write_sliders(self) -> None:
        self.data.ctrl[:] = [getattr(self.live.knobs, name) for name in KNOBS]
        self.sliders = self.data.ctrl.copy()

    def _read_mouse(self, viewer: Any) -> None:
        """Push where the mouse pulls, by a spring; held until the next frame."""
        pert, live = viewer.perturb, self.live
        force, torque, point = (0.0, 0.0), 0.0, None
        body = int(pert.select)
        if pert.active and 0 < body < self.model.nbody:
            point = Point(self.model.body(body).name or body, _triple(pert.localpos))
            turned = self.data.xmat[body].reshape(3, 3)
            if pert.active & int(mujoco.mjtPertBit.mjPERT_TRANSLATE):
                pull = pert.refselpos - (self.data.xpos[body] + product(turned, pert.localpos))
                pull *= SPRING / max(1.0, SPRING * float(np.hypot(*pull[:2])) / FORCE_MOST)
                force = (float(pull[0]), float(pull[1]))
            if pert.active & int(mujoco.mjtPertBit.mjPERT_ROTATE):
                wanted = np.empty(9)
                mujoco.mju_quat2Mat(wanted, pert.refquat)
                off = product(wanted.reshape(3, 3), turned.T)
                angle = float(np.arctan2(off[1, 0], off[0, 0]))
                torque = float(np.clip(TWIST * angle, -TORQUE_MOST, TORQUE_MOST))
        mine = live.shoved is not None and live.shoved.point is not None
        if point is not None and (force != (0.0, 0.0) or torque != 0.0):
            with contextlib.suppress(ParameterError):  # what does not move is not pushed
                live.shove(force, torque, point)
        elif mine:
            live.shove((0.0, 0.0))

    def _ask(self) -> None:
        """Have poles and margins anew where a knob was turned, or the arm is elsewhere."""
        question = self.live.question()
        key = (self.live.knobs, question.theta2)
        if key != self.asked:
            self.asked = key
            self.watcher.ask(question)

    def _show(self, viewer: Any) -> None:
        state, nq = self.live.arms[1].state, self.model.nq
        self.data.qpos[:], self.data.qvel[:] = state[:nq], state[nq:]
        mujoco.mj_fwdPosition(self.model, self.data)
        mujoco.mj_fwdVelocity(self.model, self.data)
        draw(viewer.user_scn, self.live, self.trails, float(self.data.site("tip").xpos[2]))
        if self.flags is not None:
            for i, (_, _, key) in enumerate(mujoco.mjVISSTRING):
                if key in VIEWERS:
                    viewer.opt.flags[i] = self.flags[i]

    def _texts(self) -> list[tuple[Any, Any, str, str]]:
        live, pace = self.live, self.pace
        state = "paused" if pace.paused else f"{pace.speed:g}"
        rows = [("time", f"{live.time:.2f} s"), ("speed", state)]
        rows.append(("behind the clock", f"{pace.late:.1f} s"))
        for arm, error in zip(live.arms, live.tally.last, strict=False):
            where = "diverged" if arm.diverged is not None else f"{1e3 * error:.2f} mm"
            rows.append((f"tip error, {arm.body.plant.name}", where))
        rows.append(("difference", f"{1e3 * live.tally.last[2]:.3f} mm"))
        rows += _told_reserves(self.watcher.answer)
        small = mujoco.mjtFontScale.mjFONTSCALE_100
        left, bottom = mujoco.mjtGridPos.mjGRID_TOPLEFT, mujoco.mjtGridPos.mjGRID_BOTTOMLEFT
        right = mujoco.mjtGridPos.mjGRID_TOPRIGHT
        knobs = [
            ("> " * (i == self.chosen) + name, told(name, getattr(live.knobs, name)))
            for i, name in enumerate(KNOBS)
        ]
        below = HELP if self.help else ((self.said[:120], ""),)
        return [
            (small, place, *("\n".join(column) for column in zip(*each, strict=True)))
            for place, each in ((left, rows), (right, knobs), (bottom, below))
        ]


def _triple(values: Any) -> tuple[float, float, float]:
    x, y, z = (float(each) for each in values)
    return x, y, z


def _told_reserves(answer: Answer | None) -> list[tuple[str, str]]:
    """Return poles and margins in words, a row each."""
    if answer is None:
        return [("growth", "...")]
    if answer.why_not:
        return [("growth", "no linear loop")]
    return [
        (f"growth at {answer.theta2:.1f} rad", f"{answer.growth:.3f} 1/s, {answer.hz:.1f} Hz"),
        ("gain margin", f"{answer.gain_low:.2f} to {answer.gain_high:.2f}"),
        ("delay margin", f"{1e3 * answer.delay:.2f} ms"),
    ]
