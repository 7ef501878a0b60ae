"""Who competes: classes of controllers, each with its knobs, what it reads, and its reference.

>>> CLASSES["pid"].built([40, 0.6, 0.1, 10, 40, 0.6, 0.1, 10], designer)

A class is a function from a few scaled knobs, bandwidths and phases, to what the loop takes. What
a designer knows is the nominal robot's linear model: inertias of the joints, or all of it, delay
and noise of the hardware included. Bandwidths have one range for all.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from types import ModuleType
from typing import Any

from controllers import ControllerError
from controllers.knobs import Knob
from controllers.model_based import LinearModel, lqg, mixed_sensitivity, pd_strain
from controllers.rules import RULES
from controllers.shaped import FORMS
from flexsim.linear.designed_on import model_of
from flexsim.loop.settings import V_GAIN, Setting
from flexsim.robot import Robot
from flexsim.shaping.aids import PLAIN

BANDWIDTHS = (15.0, 150.0)  # [rad/s] of every class
BANDWIDTH_NAMES = ("omega_c_1", "omega_c_2", "bandwidth_1", "bandwidth_2")
IGNORED = 0.0  # v_gain of loops in which the joints' own angles are controlled
MODEL = "assumed-modes:3"  # that designers know: the paper's number of modes


@dataclass(frozen=True, eq=False)
class Designer:
    """What a designer knows: of the nominal robot, at the pose in the middle of the work.

    Attributes:
        inertias: of the rigid joints, the other one held [kg m2]. model: all of it, sampled.
        period: [s]. delay: from measurement to the middle of the hold [s].
    """

    inertias: tuple[float, float]
    model: LinearModel
    period: float
    delay: float

    @classmethod
    def of(cls, robot: Robot, setting: Setting, theta2: float, period: float) -> Designer:
        """Return what is known of a robot with its setting's motors and hardware."""
        plant = robot.plant(MODEL, setting)
        linear, hardware = plant.linearised(theta2), setting.hardware
        first, second = (float(linear.M[j, j] / linear.S[j, j]) for j in (0, 1))
        model = LinearModel(*model_of(plant, theta2, hardware, period))
        delay = period * (0.5 + hardware.delay) + hardware.lag + hardware.effects.amplifier
        return cls((first, second), model, period, delay)


@dataclass(frozen=True, eq=False)
class Contestant:
    """A class of controllers.

    Attributes:
        name, text: for tables. knobs: that a search turns.
        build: from knobs and what a designer knows to what the loop takes.
        v_gain: factor of atan(v/(r+L)) in its loop. aid: of its reference, of its own.
        order: 'fractional', 'integer' or '-'. structure: what it reads, 'mirrored', 'collocated',
            'with v' (beside the joints' angles).
    """

    name: str
    text: str
    knobs: tuple[Knob, ...]
    build: Callable[[Sequence[float], Designer], Any]
    v_gain: float
    order: str
    structure: str
    aid: str = PLAIN

    def built(self, knobs: Sequence[float], designer: Designer) -> Any:
        """Return the controller of these knobs, None if there is none.

        A class refuses what it cannot design; a search goes elsewhere.
        """
        try:
            return self.build([float(each) for each in knobs], designer)
        except ControllerError:
            return None


def _alike(knobs: Sequence[Knob]) -> tuple[Knob, ...]:
    """Return knobs whose bandwidths have the range of all."""
    low, high = BANDWIDTHS
    return tuple(
        each._replace(low=low, high=high) if each.name in BANDWIDTH_NAMES else each
        for each in knobs
    )


def _shaped(form: str) -> Callable[[Sequence[float], Designer], Any]:
    module = FORMS[form]
    return lambda knobs, known: module.design(knobs, known.inertias, known.period)


def _by_rule(rule: str) -> Callable[[Sequence[float], Designer], Any]:
    design = RULES[rule].design
    return lambda knobs, known: design(knobs, known.inertias, known.period, known.delay)


def _on_model(module: ModuleType) -> Callable[[Sequence[float], Designer], Any]:
    return lambda knobs, known: module.design(knobs, known.model)


def _form(name: str, form: str, text: str, order: str, mirrored: bool) -> Contestant:
    """Return a class of one joint controller each, on the mirrored tip or on its own angle."""
    v_gain, structure = (V_GAIN, "mirrored") if mirrored else (IGNORED, "collocated")
    knobs = _alike(FORMS[form].KNOBS)
    return Contestant(name, text, knobs, _shaped(form), v_gain, order, structure)


def _rule(name: str) -> Contestant:
    knobs, text = _alike(RULES[name].knobs), RULES[name].text
    return Contestant(name, text, knobs, _by_rule(name), IGNORED, "fractional", "collocated")


def _model(name: str, module: ModuleType, text: str) -> Contestant:
    knobs = _alike(module.KNOBS)
    return Contestant(name, text, knobs, _on_model(module), IGNORED, "integer", "with v")


_of = partial(_form, mirrored=True)
_PD = _form("pd", "pd", "PD, v ignored", "integer", mirrored=False)
_LIST = (
    _of("fractional", "fractional", "the paper's fractional PID by (2), mirrored", "fractional"),
    _of("oustaloup", "long", "fractional PID by Oustaloup's sections, mirrored", "fractional"),
    _of("integer", "integer", "integer PID by (2), mirrored", "integer"),
    _of("pid", "textbook", "PID with filtered derivative, mirrored", "integer"),
    _form("collocated", "textbook", "the same, v ignored", "integer", mirrored=False),
    _form("collocated-fractional", "long", "fractional PID, v ignored", "fractional", False),
    replace(_PD, name="zv", text="PD, ZV shaper at the joint-free mode", aid="zv-free"),
    replace(_PD, name="zvd", text="PD, ZVD shaper at the joint-free mode", aid="zvd-free"),
    replace(_PD, name="zvd-held", text="PD, ZVD shaper at the held joints' mode", aid="zvd-held"),
    _model("strain", pd_strain, "PD and feedback of v"),
    _model("lqg", lqg, "LQG with integral action"),
    _model("h-infinity", mixed_sensitivity, "H-infinity mixed sensitivity, order reduced"),
    *(_rule(each) for each in ("valerio-s", "five", "flat-phase", "lead")),
)
CLASSES: Mapping[str, Contestant] = {each.name: each for each in _LIST}
"""Name -> class, in the order in which they are shown."""
