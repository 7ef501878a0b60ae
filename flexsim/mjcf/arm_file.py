"""An MJCF file that is the robot, of either kind: read, compiled, checked, its step within limits.

    >>> from flexsim.mjcf.load import load_arm
    >>> arm = load_arm("models/chain6.xml")     # or a rod's
    >>> arm.kind, arm.L_R, arm.reach, arm.step
    ('chain', 0.32, 0.575, 0.001)

What chain and rod have in common is here; `flexsim.mjcf.chain_file` and `flexsim.mjcf.rod_file`
have what they are made of. The file is compiled from its text alone, includes in place, so that
what a run keeps is what was run.
"""

from __future__ import annotations

import math
import warnings
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import ClassVar, NamedTuple

import mujoco
import numpy as np

from flexsim.errors import ModelError
from flexsim.mjcf.reading.bridges import bridge_sites
from flexsim.mjcf.reading.checks import before_compiling, reasons
from flexsim.mjcf.reading.limits import require_small
from flexsim.mjcf.reading.linear_checks import linear_reasons
from flexsim.mjcf.reading.names import Names
from flexsim.mjcf.reading.text import read_mjcf, with_includes
from flexsim.numerics.eigen import natural_modes
from flexsim.numerics.mujoco_c import quiet_warnings
from flexsim.numerics.step_limits import POSES, fastest_decay, longest_step
from flexsim.numerics.types import Array

INTEGRATOR_NAMES = {
    mujoco.mjtIntegrator.mjINT_RK4: "RK4",
    mujoco.mjtIntegrator.mjINT_EULER: "Euler",
    mujoco.mjtIntegrator.mjINT_IMPLICIT: "implicit",
    mujoco.mjtIntegrator.mjINT_IMPLICITFAST: "implicitfast",
    mujoco.mjtIntegrator.mjINT_DISCRETE: "discrete",
}
Motion = tuple[Array, Array, Array]  # M, D, K (m, m) of small motions about a pose
GONE = ("composite", "mujoco.elasticity")  # in MuJoCo's complaint of what version 4 dropped


@dataclass(frozen=True, eq=False)
class ArmFile(ABC):
    """A compiled MJCF file with its geometry.

    Attributes:
        model: MuJoCo's compiled model; text: the MJCF it came from, with what that includes, and
            with our names; source: its name, for messages.
        L_R: distance between the joints [m]; clamp: from joint 2 to the beam's root [m].
    """

    kind: ClassVar[str]

    model: mujoco.MjModel
    text: str
    source: str
    L_R: float
    clamp: float

    @cached_property
    def bridge_sites(self) -> tuple[float, float] | None:
        """Places of the sites strain1 and strain2, from the clamp [m]; None without.

        Raises:
            ModelError: there is one only, or one is off the beam.
        """
        return bridge_sites(self.model, self.source, self.L_R + self.clamp, self.reach - self.clamp)

    @property
    def step(self) -> float:
        """The physics step, the file's `timestep` [s]."""
        return float(self.model.opt.timestep)

    @property
    def integrator(self) -> str:
        """What takes the steps, the file's `integrator`."""
        return integrator_name(self.model)

    @property
    @abstractmethod
    def reach(self) -> float:
        """Distance from joint 2 to the tip of the straight beam [m]."""

    @abstractmethod
    def motion(self, theta2: float) -> Motion:
        """Return M, D, K (m, m) of small motions about rest, joints free, at theta2 [rad].

        The first two coordinates are joint 1 and joint 2.
        """

    @cached_property
    def motions(self) -> list[Motion]:
        """The motions at poses of joint 2, from stretched to folded."""
        return [self.motion(float(pose)) for pose in POSES]

    @property
    def dampers(self) -> Array:
        """The part of D (m, m) that is dampers of joints, which some integrators take later."""
        return self.motions[0][1]

    def longest_step(self, held_friction: tuple[float, float] = (0.0, 0.0)) -> float:
        """Return the step below which the file's integrator is stable about rest [s], or inf.

        held_friction: of the joints, held over a step [N m s/rad].
        """
        return longest_of(self.model, self.motions, self.dampers, held_friction)

    @property
    def highest_frequency(self) -> float:
        """Highest natural frequency with both joints free [rad/s], over poses of joint 2."""
        return highest_of(self.motions)


def highest_of(motions: Sequence[Motion]) -> float:
    """Return the highest natural frequency of motions of several poses [rad/s]."""
    return math.sqrt(max(float(natural_modes(K, M)[0][-1]) for M, _, K in motions))


def longest_of(
    model: mujoco.MjModel,
    motions: Sequence[Motion],
    dampers: Array,
    held_friction: tuple[float, float] = (0.0, 0.0),
) -> float:
    """Return the step below which a model's integrator is stable about rest [s], or inf.

    All but RK4 take the dampers of the joints at the end of a step, unless told not to.

    Args:
        model: whose options say how it is stepped. motions: of several poses. dampers: see
            `ArmFile`. held_friction: of the joints, held over a step [N m s/rad].
    """
    name = integrator_name(model)
    at_start = np.zeros_like(dampers)
    at_start[[0, 1], [0, 1]] = held_friction
    if name == "RK4":
        return longest_step(name, motions, at_start)
    early = name == "Euler" and model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_EULERDAMP
    late = np.zeros_like(dampers) if early else dampers
    at_start += motions[0][1] - late
    return longest_step(name, [(M, late, K) for M, _, K in motions], at_start)


class Given(NamedTuple):
    """An MJCF file or text as it was given: its name for messages; itself, without includes."""

    source: str
    text: str


class Read(NamedTuple):
    """An MJCF file that is the arm: its name for messages, text, specification and model."""

    source: str
    text: str
    spec: mujoco.MjSpec
    model: mujoco.MjModel


def integrator_name(model: mujoco.MjModel) -> str:
    """Return the integrator of a model as MJCF names it: RK4, Euler, implicitfast, ..."""
    return INTEGRATOR_NAMES[mujoco.mjtIntegrator(model.opt.integrator)]


def read_arm(kind: str, given: Given) -> Read:
    """Return the compiled MJCF of the arm with a beam of a kind, 'chain' or 'rod'.

    MuJoCo's automatic reset is switched off whatever the file says: whether a motion has
    diverged is for the loop to judge.

    Raises:
        ModelError: the file does not compile, or is not the two-link arm; the message has every
            reason that can be found at once.
    """
    source, text = given
    with quiet_warnings(), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of numbers that are checked hereafter
        try:
            spec = mujoco.MjSpec.from_string(text)
        except (ValueError, mujoco.FatalError) as error:
            raise ModelError(f"{source}: {_complaint(error)}") from None
        found = before_compiling(kind, spec)
        try:
            model = spec.compile()
        except (ValueError, mujoco.FatalError) as error:
            raise _refusal(source, found or [_complaint(error)]) from None
        found += reasons(kind, spec, model)
        if found:
            raise _refusal(source, found, linear_reasons(model))
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    return Read(source, text, spec, model)


def given_text(path: str | Path | None, text: str | None, names: Names | None = None) -> Given:
    """Return a file or a text: self-contained, of a stated size, with our names.

    Args:
        path: MJCF file; text: MJCF instead of a file. names: that it has for the parts of the arm,
            if others than ours.

    Raises:
        ModelError: it cannot be read, or is too large.
    """
    source = str(path) if path is not None else "the MJCF text"
    if path is not None:
        own = read_mjcf(path)
        try:
            text = with_includes(own, Path(path).parent)
        except ModelError as error:
            raise ModelError(f"{source}: {error}") from None
    elif text is None:
        raise ModelError("no MJCF given; name a file or pass its text")
    elif not text.strip():
        raise ModelError(f"{source}: the MJCF text is empty")
    require_small(source, text)
    return Given(source, (names or Names()).applied(text, source))


def _complaint(error: Exception) -> str:
    """Return what MuJoCo says against a file, and what would do instead of what it has dropped."""
    said = " ".join(str(error).split())
    if any(word in said for word in GONE):
        said += "; MuJoCo 4 has dropped it: write the beam as hinged segments (flexsim chain)"
    return f"not valid MJCF: {said}"


def _refusal(source: str, found: list[str], linear: list[str] | None = None) -> ModelError:
    """Return the error that names one reason, or counts several."""
    if len(found) == 1 and not linear:
        return ModelError(f"{source}: {found[0]}")
    counted = "; ".join(f"({i}) {reason}" for i, reason in enumerate(found, start=1))
    message = f"{source}: {len(found)} things to mend: {counted}"
    if linear:
        message += f"; and before it is more than a plant of its own: {'; '.join(linear)}"
    return ModelError(message)


def require_stable_step(arm: ArmFile) -> None:
    """Raise a ModelError unless the file's step is within what its integrator can take."""
    try:
        longest = arm.longest_step()
    except ModelError as error:
        raise ModelError(f"{arm.source}: {error}") from None
    if arm.step >= longest:
        omega, decay = arm.highest_frequency, fastest_decay(arm.motions)
        damping = f" and damping at {decay:.0f} 1/s" if decay > omega else ""
        raise ModelError(
            f"{arm.source}: timestep {arm.step:g} s is too long for {arm.integrator.upper()} with "
            f"a highest frequency of {omega:.0f} rad/s{damping}; use less than {longest:.3g} s"
        )
