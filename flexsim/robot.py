"""Which robot, and which model of it? The paper's or an MJCF file's; every plant by its name.

    >>> from flexsim.robot import Robot
    >>> robot = Robot.of("models/chain6.xml")     # Robot() is the paper's
    >>> modes, chain = robot.both()
    >>> rigid = robot.plant("rigid")

Plants are named `rigid`, `assumed-modes`, `printed`, `chain` (MuJoCo's), `closed-chain` (the same
chain's equations, compiled), `untuned` and `rod`, with a size after a colon where there is one:
`assumed-modes:5`, `chain:10`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from pathlib import Path

from flexsim.arm.beam import MODES, beta_lengths
from flexsim.arm.chain_design import SEGMENTS
from flexsim.arm.parameters import Parameters
from flexsim.errors import ModelError, ParameterError
from flexsim.loop.followed import require_followed
from flexsim.loop.settings import Setting
from flexsim.mjcf.arm_file import ArmFile
from flexsim.mjcf.as_parameters import parameters_of, parameters_of_rod
from flexsim.mjcf.bodies import parts
from flexsim.mjcf.chain_file import ChainModel, motor_matrix
from flexsim.mjcf.edits import changed, with_motors
from flexsim.mjcf.load import load_arm
from flexsim.mjcf.reading.linear_checks import require_linear
from flexsim.mjcf.reading.names import Names
from flexsim.mjcf.rod_file import RodModel
from flexsim.mjcf.rod_xml import ELEMENTS
from flexsim.numerics.step_limits import halved
from flexsim.plants.base import Plant
from flexsim.plants.chain_plant import ChainPlant, ClosedChainPlant
from flexsim.plants.modes_plant import AssumedModesPlant, stable_modes_step
from flexsim.plants.rod_as_beam import require_uniform
from flexsim.plants.rod_plant import RodPlant

BEAMS = ("file", "analytic")
SAME_LENGTH = 1e-6  # relative
ZETA_MOST = 0.5  # of what a command is given: more is a percentage, not a fraction
BALANCED = 1e-9  # [kg m] of the hub about joint 2
KINDS = ("rigid", "assumed-modes", "printed", "chain", "closed-chain", "untuned", "rod")
PLANT_HELP = (
    "rigid, assumed-modes[:n], printed[:n], chain[:N], closed-chain[:N], untuned[:N] or rod[:N]"
)


@dataclass(frozen=True, eq=False)
class Robot:
    """A robot that plants are made of.

    Attributes:
        parameters: of the robot without a file.
        file: the checked MJCF file of a chain that is the robot instead, or None.
        beam: 'file' gives the assumed modes the modes of the file's own chain, 'analytic' those
            of the paper's beam on the file's rigid bodies.
        rod: the checked MJCF file of a rod, whose uniform beam the parameters then are, or None.
        modal_damping: (n,) ratios of the assumed modes, one by one, instead of the parameters'
            `zeta`, which is then the first of them and what chains and rods have: in those the
            ratios grow with the frequency, whatever mode 2 is asked to have.
    """

    parameters: Parameters = field(default_factory=Parameters)
    file: ChainModel | None = None
    beam: str = "file"
    rod: RodModel | None = None
    modal_damping: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        for value in self.modal_damping:
            if not 0 <= value < 1:  # so that a nan is caught
                raise ParameterError(
                    f"modal damping has the ratio {value!r}; give fractions from 0, below 1"
                )
        if self.modal_damping and self.given is not None:
            raise ParameterError(
                f"--modal-damping has no effect on {self.given.source}, whose hinges have dampers "
                "of their own; leave it out, or change them"
            )

    @property
    def given(self) -> ChainModel | RodModel | None:
        """The file that the robot is, of either kind."""
        return self.file or self.rod

    @classmethod
    def of(
        cls,
        mjcf: str | Path | None = None,
        beam: str = "file",
        parameters: Parameters | None = None,
        text: str | None = None,
        names: Names | None = None,
        modal_damping: tuple[float, ...] = (),
    ) -> Robot:
        """Return the robot of an MJCF file or its text; without one, that of the parameters.

        Args:
            mjcf, text: file, or what one has. beam: see `Robot`. parameters: of a robot without.
            names: that the file has for the parts of the arm, if others than ours.
            modal_damping: see `Robot`.

        Raises:
            ParameterError: an unknown beam, or what contradicts the file.
            ModelError: the file cannot be used.
        """
        if beam not in BEAMS:
            raise ParameterError(f"beam {beam!r} is unknown; choose {' or '.join(BEAMS)}")
        if mjcf is None and text is None:
            if beam != "file":
                raise ParameterError(f"--beam {beam} has no effect without --mjcf; add a file")
            for ours, theirs in (names or Names()).given().items():
                raise ParameterError(f"--{ours} {theirs} has no effect without --mjcf; add a file")
            return cls._of_parameters(parameters or Parameters(), modal_damping)
        if parameters not in (None, Parameters()):
            raise ParameterError("--robot and --mjcf contradict each other: the file is the robot")
        arm = load_arm(mjcf, text, names)
        if isinstance(arm, RodModel):
            return cls(parameters_of_rod(arm), None, beam, arm, modal_damping)
        return cls(parameters_of(arm), arm, beam, None, modal_damping)

    @classmethod
    def _of_parameters(cls, own: Parameters, modal_damping: tuple[float, ...]) -> Robot:
        """Return the robot without a file.

        Raises:
            ParameterError: damping beyond all structures, or given twice.
        """
        if own.zeta >= ZETA_MOST:
            raise ParameterError(
                f"--robot.zeta is {own.zeta:g}, mode 1's damping ratio; give a fraction below "
                f"{ZETA_MOST:g}: 0.001 is 0.1 %"
            )
        if modal_damping and own.zeta not in (Parameters().zeta, modal_damping[0]):
            raise ParameterError(
                f"--robot.zeta {own.zeta:g} and --modal-damping {modal_damping[0]:g} contradict "
                "each other: both give mode 1's damping; leave one out"
            )
        if modal_damping:
            own = replace(own, zeta=modal_damping[0])
        return cls(own, modal_damping=modal_damping)

    def changed(self, stiffness: float, density: float, payload: float) -> Robot:
        """Return the robot with its beam's stiffness and density times a factor, and a payload.

        The damping ratio of mode 1 stays. A rod's file becomes a chain of its beam.
        """
        if self.given is None:
            p = self.parameters
            return replace(
                self,
                parameters=replace(
                    p, EI=stiffness * p.EI, rho=density * p.rho, payload=p.payload + payload
                ),
            )
        file = self.file if self.file is not None else self.chain_plant().chain
        other = changed(file, stiffness, density, payload)
        return replace(self, parameters=parameters_of(other), file=other)

    def _chain(self, setting: Setting | None) -> ChainModel | None:
        """Return the file's chain with a setting's motors."""
        if self.file is None or setting is None or (setting.I_m1, setting.I_m2) == (None, None):
            return self.file
        return with_motors(self.file, setting.I_m1, setting.I_m2)

    def _parameters(self, setting: Setting | None) -> Parameters:
        return setting.applied(self.parameters) if setting else self.parameters

    def modes_plant(
        self,
        setting: Setting | None = None,
        modes: int = MODES,
        step: float | None = None,
        form: str = "consistent",
        name: str = "assumed-modes",
    ) -> AssumedModesPlant:
        """Return the assumed-modes plant, by default at 1 ms, halved until RK4 can take it.

        Raises:
            ParameterError, ModelError: modes or step out of range, or a file with something that
                the equations do not have.
        """
        chain, own = self._chain(setting), self._parameters(setting)
        if chain is not None:
            own = parameters_of(chain)
        if self.beam == "analytic":
            own, chain = self._with_papers_beam(own), None
        elif self.rod is not None:
            require_uniform(self.rod)
        if step is None:
            usual = stable_modes_step(own, modes, chain, self.modal_damping)
        else:
            usual = step
        plant = AssumedModesPlant(
            own, modes, usual, form, name, chain, modal_damping=self.modal_damping
        )
        longest = plant.longest_held_step(_steepest(setting))
        if plant.step >= longest:
            if step is not None:
                raise ParameterError(_too_long(f"physics step {step:g} s", plant.name, longest))
            plant = replace(plant, step=halved(longest))
        arm = self._rod(setting) if self.file is None else chain
        if arm is not None and self.beam == "file" and form == "consistent" and modes >= MODES:
            require_followed(plant, arm)
        return plant

    def chain_plant(
        self,
        setting: Setting | None = None,
        segments: int | None = None,
        step: float | None = None,
        fitted: bool = True,
        name: str = "chain",
    ) -> ChainPlant:
        """Return the chain: the file's, or one designed, of 6 segments unless given.

        Raises:
            ParameterError: segments or a step beside a file, which has its own; or out of range.
        """
        chain = self._chain(setting)
        if self.rod is not None:
            require_uniform(self.rod)
        if chain is None:
            own, size = self._parameters(setting), SEGMENTS if segments is None else segments
            plant = ChainPlant.designed(own, size, step, fitted, name)
            shorter = _shortened(plant.chain, setting, step)
            if shorter is not None:
                plant = ChainPlant.designed(own, size, shorter, fitted, name)
            return plant
        for what, value, its in (
            ("segments", segments, len(chain.lengths)),
            ("step", step, chain.step),
        ):
            if value is not None and value != its:
                _contradicted(chain.source, what, value, its)
        _shortened(chain, setting, chain.step)
        return ChainPlant(parameters_of(chain), chain, name)

    def both(
        self,
        setting: Setting | None = None,
        modes: int = MODES,
        segments: int | None = None,
        step: float | None = None,
        chain_step: float | None = None,
    ) -> tuple[AssumedModesPlant, ChainPlant]:
        """Return both plants of the robot."""
        return (
            self.modes_plant(setting, modes, step),
            self.chain_plant(setting, segments, chain_step),
        )

    def plant(
        self,
        name: str,
        setting: Setting | None = None,
        modes: int = MODES,
        segments: int | None = None,
        step: float | None = None,
        chain_step: float | None = None,
    ) -> Plant:
        """Return a plant by its name; modes and segments hold where the name has no size.

        Args:
            name: as above. setting: whose motors it has. modes, segments: n, N.
            step, chain_step: of assumed modes and of chains [s], as `both`.

        Raises:
            ParameterError: there is no such plant, or the file's robot has none such.
        """
        kind, size = plant_kind(name)
        if kind == "rigid":
            return self.modes_plant(setting, 0, step, name=name)
        if kind in ("assumed-modes", "printed"):
            beta_lengths(size or modes)  # refuses none: the rigid link has a name of its own
            form = "printed" if kind == "printed" else "consistent"
            return self.modes_plant(setting, size or modes, step, form, name)
        if kind == "closed-chain":
            own = self.chain_plant(setting, size or segments, chain_step)
            return ClosedChainPlant(own.parameters, own.chain, name)
        if self.file is not None and kind != "chain":
            raise ParameterError(
                f"plant {name!r} is made from a uniform beam, not from {self.file.source}; "
                "leave out --mjcf, or choose chain or closed-chain"
            )
        if kind == "rod" and self.rod is not None:
            return self._rod_plant(self.rod, setting, size, chain_step, name)
        if kind == "rod":
            return self._designed_rod(setting, size or ELEMENTS, chain_step, name)
        return self.chain_plant(setting, size or segments, chain_step, kind == "chain", name)

    def _with_papers_beam(self, own: Parameters) -> Parameters:
        """Return the robot of a file with the paper's beam, as long as the file's.

        Raises:
            ModelError: the file has something that no analytic beam takes along.
        """
        paper = Parameters()
        if abs(own.L / paper.L - 1) > SAME_LENGTH and self.given is not None:
            raise ModelError(
                f"{self.given.source}: its beam is {own.L:g} m long, the paper's {paper.L:g} m; "
                "--beam analytic is for files with the paper's length"
            )
        if self.file is not None:
            require_linear(self.file)
            hub = parts(self.file)[1]
            if abs(float(hub.mass @ hub.x)) > BALANCED:
                raise ModelError(
                    f"{self.file.source}: body 'hub' has its centre of mass beside joint2, which "
                    "--beam analytic cannot carry; leave it out, or centre the hub"
                )
        elif self.rod is not None:
            require_linear(self.rod)
        return replace(own, L=paper.L, rho=paper.rho, EI=paper.EI)

    def _rod_plant(
        self,
        rod: RodModel,
        setting: Setting | None,
        elements: int | None,
        step: float | None,
        name: str,
    ) -> RodPlant:
        """Return the file's rod, with a setting's motors."""
        for what, value, its in (
            ("elements", elements, len(rod.vertices) - 2),
            ("step", step, rod.step),
        ):
            if value is not None and value != its:
                _contradicted(rod.source, what, value, its)
        own = self._rod(setting) or rod
        _shortened(own, setting, own.step)
        return RodPlant(self._parameters(setting), own, name)

    def _designed_rod(
        self, setting: Setting | None, elements: int, step: float | None, name: str
    ) -> RodPlant:
        """Return the rod of the parameters, its step short enough for a setting's friction."""
        own = self._parameters(setting)
        plant = RodPlant.designed(own, elements, step)
        shorter = _shortened(plant.rod, setting, step)
        if shorter is not None:
            plant = RodPlant.designed(own, elements, shorter)
        return replace(plant, name=name)

    def _rod(self, setting: Setting | None) -> RodModel | None:
        """Return the file's rod with a setting's motors."""
        if self.rod is None or setting is None or (setting.I_m1, setting.I_m2) == (None, None):
            return self.rod
        return with_motors(self.rod, setting.I_m1, setting.I_m2)


def _steepest(setting: Setting | None) -> tuple[float, float]:
    """Return the slopes of a setting's friction that is held over a step [N m s/rad]."""
    return (0.0, 0.0) if setting is None else setting.friction.steepest


def _shortened(arm: ArmFile, setting: Setting | None, step: float | None) -> float | None:
    """Return a step that a setting's friction, held over it, leaves stable; None: as it is.

    Friction that opposes a joint's motion adds its slope over the joint's inertia to the rates that
    bound the step, at the worst pose: a light hub runs away by itself, whatever controls it.

    Args:
        arm: a chain or rod. step: that was asked for, None if it may be shorter [s].

    Raises:
        ModelError: the step that was asked for is too long.
    """
    gears = motor_matrix(arm.model)
    first, second = _steepest(setting)
    longest = arm.longest_step((first * gears[0, 0], second * gears[1, 1]))
    if arm.step < longest:
        return None
    if step is not None:
        raise ModelError(_too_long(f"timestep {arm.step:g} s", arm.source, longest))
    return halved(longest)


def _too_long(step: str, what: str, longest: float) -> str:
    return (
        f"{what}: {step} is too long for friction that opposes the joints' motion, held over a "
        f"step, with so light a joint; use less than {longest:.3g} s, or another setting"
    )


def _contradicted(source: str, what: str, value: float, its: float) -> None:
    raise ParameterError(
        f"{source} has {what} {its:g}, not {value:g}; leave it out, or edit the file"
    )


def plant_kind(name: str) -> tuple[str, int | None]:
    """Return kind and size (None without one) of a plant's name.

    Raises:
        ParameterError: there is no such plant.
    """
    match = re.fullmatch(rf"({'|'.join(KINDS)})(?::([1-9][0-9]{{0,3}}))?", name)
    if not match or (match[2] and match[1] == "rigid"):
        raise ParameterError(f"plant {name!r} is unknown; choose {PLANT_HELP}")
    return match[1], int(match[2]) if match[2] else None
