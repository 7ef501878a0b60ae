"""Which robot, and which model of it? The paper's or an MJCF file's; every plant by its name.

    >>> from flexsim.robot import Robot
    >>> robot = Robot.of("models/chain6.xml")     # Robot() is the paper's, damped
    >>> modes, chain = robot.both()
    >>> rigid = robot.plant("rigid")

Plants are named `rigid`, `assumed-modes`, `printed`, `chain` (MuJoCo's), `closed-chain` (the same
chain's equations, compiled), `untuned` (hinges in the middle of equal cells, EI/h), `rule-of-thumb`
(hinges between them, as MuJoCo's cable had), `rod` and `exudyn` (the beam of another code, an
extra), with a size after a colon where there is one: `assumed-modes:5`, `chain:10`.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from numbers import Real
from pathlib import Path

from flexsim.arm.arms import Arm as NamedArm
from flexsim.arm.arms import FirstLink, named_arm
from flexsim.arm.beam import MODES, beta_lengths
from flexsim.arm.chain_design import SEGMENTS, TUNED
from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.loop.followed import require_followed
from flexsim.loop.settings import Setting
from flexsim.mjcf.arm_file import ArmFile
from flexsim.mjcf.arms.two_chains import straight_parameters
from flexsim.mjcf.as_parameters import parameters_of, parameters_of_rod
from flexsim.mjcf.chain_file import ChainModel
from flexsim.mjcf.edits import Arm, changed, with_motors
from flexsim.mjcf.load import load_arm
from flexsim.mjcf.reading.names import Names
from flexsim.mjcf.rod_file import RodModel
from flexsim.mjcf.rod_xml import ELEMENTS
from flexsim.numerics.step_limits import halved
from flexsim.plants.base import Plant
from flexsim.plants.chain_plant import ChainPlant, ClosedChainPlant
from flexsim.plants.modes_plant import AssumedModesPlant, stable_modes_step
from flexsim.plants.rod_as_beam import require_uniform
from flexsim.plants.rod_plant import RodPlant
from flexsim.robot.exudyn_arm import exudyn_plant
from flexsim.robot.held_friction import shortened, steepest, too_long
from flexsim.robot.papers_beam import with_papers_beam
from flexsim.robot.plant_names import plant_kind
from flexsim.robot.two_flexible_arm import changed_arm, two_flexible_plant

BEAMS = ("file", "analytic")
FOR_TWO = "flexsim modes, drive, follow, tune or animate"  # what takes an arm whose links both bend
ZETA_MOST = 0.5  # of what a command is given: more is a percentage, not a fraction


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
        link1: the beam that link 1 is, where it bends; a file may have hinges there instead. Plants
            of such an arm are those of `flexsim.robot.two_flexible_arm`.
    """

    parameters: Parameters = field(default_factory=Parameters)
    file: ChainModel | None = None
    beam: str = "file"
    rod: RodModel | None = None
    modal_damping: tuple[float, ...] = ()
    link1: FirstLink | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.modal_damping, tuple | list):
            raise ParameterError(
                f"modal damping is {self.modal_damping!r}; give a ratio for each mode, in a tuple"
            )
        for value in self.modal_damping:
            if not (isinstance(value, Real) and 0 <= value < 1):  # so that a nan is caught
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

    @property
    def both_bend(self) -> bool:
        """Whether link 1 bends, too."""
        return self.link1 is not None or (self.file is not None and self.file.bends_twice)

    def _require_rigid_link1(self) -> None:
        if self.both_bend:
            which = "--arm two-flexible" if self.file is None else self.file.source
            raise ParameterError(
                f"link 1 of {which} bends, too, which this command has no model of; give it to "
                f"{FOR_TWO}, or leave it out here"
            )

    @classmethod
    def named(cls, name: str) -> Robot:
        """Return the robot of a name: paper, one-link or two-flexible.

        Raises:
            ParameterError: there is none of that name.
        """
        arm = named_arm(name)
        return cls(arm.parameters, link1=arm.link1)

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
        if arm.bends_twice:
            if beam != "file":
                raise ParameterError(
                    f"--beam {beam} has no effect on {arm.source}, whose links both bend; leave it "
                    "out"
                )
            return cls(straight_parameters(arm), arm, beam, None, modal_damping)
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
        if self.link1 is not None:
            own = NamedArm(self.parameters, self.link1)
            found = changed_arm(own, stiffness, density, payload)
            return replace(self, parameters=found.parameters, link1=found.link1)
        self._require_rigid_link1()
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
        self._require_rigid_link1()
        chain, own = _with_motors(self.file, setting), self._parameters(setting)
        if chain is not None:
            own = parameters_of(chain)
        if self.beam == "analytic":
            own, chain = with_papers_beam(own, self.given), None
        elif self.rod is not None:
            require_uniform(self.rod)
        if step is None:
            usual = stable_modes_step(own, modes, chain, self.modal_damping)
        else:
            usual = step
        plant = AssumedModesPlant(
            own, modes, usual, form, name, chain, modal_damping=self.modal_damping
        )
        longest = plant.longest_held_step(steepest(setting))
        if plant.step >= longest:
            if step is not None:
                raise ParameterError(too_long(f"physics step {step:g} s", plant.name, longest))
            plant = replace(plant, step=halved(longest))
        arm = _with_motors(self.rod, setting) if self.file is None else chain
        if arm is not None and self.beam == "file" and form == "consistent" and modes >= MODES:
            require_followed(plant, arm)
        return plant

    def chain_plant(
        self,
        setting: Setting | None = None,
        segments: int | None = None,
        step: float | None = None,
        kind: str = TUNED,
        name: str = "chain",
    ) -> ChainPlant:
        """Return the chain: the file's, or one designed, of 6 segments unless given.

        Raises:
            ParameterError: segments or a step beside a file, which has its own; or out of range.
        """
        self._require_rigid_link1()
        chain = _with_motors(self.file, setting)
        if self.rod is not None:
            require_uniform(self.rod)
        if chain is None:
            own, size = self._parameters(setting), SEGMENTS if segments is None else segments
            plant = ChainPlant.designed(own, size, step, kind, name)
            shorter = shortened(plant.chain, setting, step)
            if shorter is not None:
                plant = ChainPlant.designed(own, size, shorter, kind, name)
            return plant
        _require_own(
            chain, {"segments": (segments, len(chain.lengths)), "step": (step, chain.step)}
        )
        shortened(chain, setting, chain.step)
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
        if self.both_bend:
            own_arm = NamedArm(self._parameters(setting), self.link1)
            sizes, steps = (modes, segments), (step, chain_step)
            file = _with_motors(self.file, setting)
            return two_flexible_plant(name, own_arm, file, setting, sizes, steps)
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
        if kind == "exudyn":
            if self.rod is not None:
                require_uniform(self.rod)
            return exudyn_plant(self._parameters(setting), setting, size, chain_step, name)
        if kind == "rod" and self.rod is not None:
            return self._rod_plant(self.rod, setting, size, chain_step, name)
        if kind == "rod":
            return self._designed_rod(setting, size or ELEMENTS, chain_step, name)
        return self.chain_plant(setting, size or segments, chain_step, kind, name)

    def _rod_plant(
        self,
        rod: RodModel,
        setting: Setting | None,
        elements: int | None,
        step: float | None,
        name: str,
    ) -> RodPlant:
        """Return the file's rod, with a setting's motors."""
        of_file = len(rod.vertices) - 2
        _require_own(rod, {"elements": (elements, of_file), "step": (step, rod.step)})
        own = _with_motors(self.rod, setting) or rod
        shortened(own, setting, own.step)
        return RodPlant(self._parameters(setting), own, name)

    def _designed_rod(
        self, setting: Setting | None, elements: int, step: float | None, name: str
    ) -> RodPlant:
        """Return the rod of the parameters, its step short enough for a setting's friction."""
        own = self._parameters(setting)
        plant = RodPlant.designed(own, elements, step)
        shorter = shortened(plant.rod, setting, step)
        if shorter is not None:
            plant = RodPlant.designed(own, elements, shorter)
        return replace(plant, name=name)


def _require_own(arm: ArmFile, numbers: dict[str, tuple[float | None, float]]) -> None:
    """Refuse numbers that are given otherwise than a file has them; None is not given."""
    for what, (value, its) in numbers.items():
        if value is not None and value != its:
            raise ParameterError(
                f"{arm.source} has {what} {its:g}, not {value:g}; leave it out, or edit the file"
            )


def _with_motors(arm: Arm | None, setting: Setting | None) -> Arm | None:
    """Return a file, if there is one, with a setting's motors."""
    if arm is None or setting is None or (setting.I_m1, setting.I_m2) == (None, None):
        return arm
    return with_motors(arm, setting.I_m1, setting.I_m2)
