"""Do the plants vibrate like the beam? Frequencies, couplings and mode shapes, side by side.

>>> run(ModesConfig()).clamped_hz["chain"]
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro

from flexsim.arm.beam import MODES, modal_integrals, mode_shapes
from flexsim.arm.free_arm import clamped_frequencies, joint_free_frequencies
from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.mjcf.chain_file import ChainModel, highest_frequency, longest_step
from flexsim.numerics.types import Array
from flexsim.plants.assumed_modes import free_frequencies
from flexsim.plants.chain_as_modes import clamped_damping, vibration
from flexsim.robot import Robot
from studies.core.carry_out import Question
from studies.core.options import RobotOptions
from studies.core.table import Column, Table
from studies.core.text import spelled

HERTZ = 1 / (2 * np.pi)


@dataclass(frozen=True)
class ModesConfig(RobotOptions):
    """Compare frequencies and mode shapes: exact, assumed modes, chain."""

    file: tyro.conf.Positional[Path | None] = None
    """The MJCF file, as --mjcf."""
    json: bool = False
    """Print one JSON object instead of tables."""

    def robot_of(self, parameters: Parameters | None = None) -> Robot:
        """Return the robot, however its file was given.

        Raises:
            ParameterError: it was given twice.
        """
        if self.file is not None and self.mjcf is not None:
            raise ParameterError(f"two MJCF files are given, {self.file} and {self.mjcf}; give one")
        named = RobotOptions(mjcf=self.mjcf or self.file, beam=self.beam, **vars(self.names))
        return named.robot_of(parameters)


@dataclass(frozen=True, eq=False)
class ModesResult:
    """What `flexsim modes` prints; frequencies in Hz, each a mapping from model to (3,)."""

    source: str
    clamped_hz: dict[str, Array]
    joint_free_hz: dict[str, Array]
    damping_ratio: dict[str, Array]  # of the clamped modes, without "exact": the beam has none
    couplings: dict[str, dict[str, Array]]  # by name, then by model
    coupling_error_max: float
    static_compliance: dict[str, float]
    mac: Array
    omega_max: dict[str, float]
    step: float
    step_limit: float | None


def run(config: ModesConfig) -> ModesResult:
    """Return frequencies, couplings and shapes of the paper's beam and of both plants."""
    return compared(config.robot_of())


def compared(robot: Robot) -> ModesResult:
    """Return frequencies, couplings and shapes of the paper's beam and of a robot's plants.

    Raises:
        ModelError: its file has fewer hinges than modes are compared, or what no mode has.
    """
    p = Parameters()
    plant, chain_plant = robot.both(modes=MODES)
    chain = chain_plant.chain
    found = vibration(chain, chain_plant.parameters, MODES)
    integrals = modal_integrals(p, MODES)
    coefficients, own = plant.coefficients, plant.parameters
    Phi = coefficients.P / own.rho
    couplings = {  # exact, assumed modes, chain
        "Phi_i (m)": (integrals.Phi, Phi, found.Phi),
        "int (x-r) chi_i (m2)": (
            integrals.x_chi - p.r * integrals.Phi,
            coefficients.X / own.rho - own.r * Phi,
            found.moment,
        ),
        "chi_i(tip)": (integrals.tip, coefficients.tip, found.tip),
    }
    errors = [float(np.abs(chain / exact - 1).max()) for exact, _, chain in couplings.values()]
    clamped = np.sqrt(coefficients.stiffness / coefficients.mass)
    return ModesResult(
        source=source_of(robot),
        clamped_hz={
            "exact": clamped_frequencies(p, MODES) * HERTZ,
            "assumed_modes": clamped * HERTZ,
            "chain": found.clamped * HERTZ,
        },
        joint_free_hz={
            "exact": joint_free_frequencies(p, MODES) * HERTZ,
            "assumed_modes": free_frequencies(coefficients) * HERTZ,
            "chain": found.joint_free * HERTZ,
        },
        damping_ratio={
            "assumed_modes": np.diag(coefficients.damping) / (2 * clamped * coefficients.mass),
            "chain": clamped_damping(chain)[:MODES],
        },
        couplings={
            name: dict(zip(("exact", "assumed_modes", "chain"), values, strict=True))
            for name, values in couplings.items()
        },
        coupling_error_max=max(*errors, abs(found.compliance / p.static_compliance - 1)),
        static_compliance={
            "exact": p.static_compliance,
            "assumed_modes": float(np.sum(coefficients.tip**2 / coefficients.stiffness)),
            "chain": found.compliance,
        },
        mac=modal_assurance(chain, found.shapes),
        omega_max={
            "assumed_modes": plant.highest_frequency,
            "chain": highest_frequency(chain.model),
        },
        step=chain.step,
        step_limit=longest_step(chain.model),
    )


def source_of(robot: Robot) -> str:
    """Return the name of a robot's file, as titles have it."""
    if robot.rod is not None:
        return f"chain of 6 segments for the beam of {robot.rod.source}"
    return robot.file.source if robot.file is not None else "default chain of 6 segments"


def modal_assurance(chain: ChainModel, shapes: Array) -> Array:
    """Return the MAC (n,) of chain shapes (N+2, n) with (15) at the hinges and the tip [-]."""
    s = np.append(chain.hinges, chain.reach - chain.clamp) / (chain.reach - chain.clamp)
    exact, found = mode_shapes(shapes.shape[1], s), shapes[1:]
    cross = np.sum(exact * found, axis=0)
    return cross**2 / (np.sum(exact**2, axis=0) * np.sum(found**2, axis=0))


@dataclass(frozen=True)
class ModeRow:
    """One frequency [Hz] in the three models."""

    mode: int
    exact: float
    assumed_modes: float
    chain: float

    @property
    def modes_difference(self) -> float:
        """Relative, of the assumed modes'."""
        return self.assumed_modes / self.exact - 1

    @property
    def chain_difference(self) -> float:
        """Relative, of the chain's."""
        return self.chain / self.exact - 1


@dataclass(frozen=True, eq=False)
class ShapeRow:
    """A figure of each mode (3,), and how it is written."""

    name: str
    figures: Array
    form: str


FREQUENCIES = (
    Column("mode", form="d"),
    Column("exact", form=".6f"),
    Column("assumed_modes", form=".6f"),
    Column("modes_difference", "difference", form="+.1e"),
    Column("chain", form=".6f"),
    Column("chain_difference", "difference", form="+.1e"),
)


def _mode(i: int) -> Column:
    return Column(f"mode {i + 1}", form=lambda row: format(row.figures[i], row.form))


SHAPES = (Column("name", ""), *map(_mode, range(MODES)))


def _frequencies(models: dict[str, Array]) -> list[ModeRow]:
    """Return frequencies mode by mode."""
    columns = (models[name] for name in ("exact", "assumed_modes", "chain"))
    return [ModeRow(i, *map(float, row)) for i, row in enumerate(zip(*columns, strict=True), 1)]


def _shapes(result: ModesResult) -> Iterator[ShapeRow]:
    """Give couplings with the chain's errors, the MAC, and damping ratios if there are any."""
    for name, models in result.couplings.items():
        for model, figures in models.items():
            label = f"{name}, beam" if model == "exact" else f"  {model.replace('_', ' ')}"
            yield ShapeRow(label, figures, "+.7f")
        yield ShapeRow("  difference", models["chain"] / models["exact"] - 1, "+.1e")
    yield ShapeRow("MAC, chain to beam", result.mac, ".6f")
    if np.any(result.damping_ratio["chain"]):
        for model, ratios in result.damping_ratio.items():
            yield ShapeRow(f"damping ratio, {model.replace('_', ' ')}", ratios, ".6f")


def tables(result: ModesResult) -> list[Table]:
    """Return frequencies, couplings and shapes."""
    title = (
        f"Chain: {spelled(result.source)}; exact: the paper's beam\n\n"
        "Clamped beam, frequencies (Hz)"
    )
    free = "Both joints free, straight arm, frequencies (Hz)"
    return [
        Table(_frequencies(result.clamped_hz), FREQUENCIES, title),
        Table(_frequencies(result.joint_free_hz), FREQUENCIES, free),
        Table(list(_shapes(result)), SHAPES, "Couplings and tip values of the modes"),
    ]


def verdict(result: ModesResult) -> str:
    """Return in words what differs at most, and what bounds the step."""
    compliance, omega = result.static_compliance, result.omega_max
    text = (
        f"Static tip compliance (m/N): exact {compliance['exact']:.6f}, assumed modes "
        f"{compliance['assumed_modes']:.6f}, chain {compliance['chain']:.6f}\n"
        "Largest of the chain's differences in couplings and compliance: "
        f"{100 * result.coupling_error_max:.3f} %\n"
        f"Highest frequency (rad/s): assumed modes {omega['assumed_modes']:.0f}, chain "
        f"{omega['chain']:.0f}\n"
    )
    if result.step_limit is None:
        return text
    return text + (
        f"The chain's step of {1e3 * result.step:g} ms is within its integrator's limit of "
        f"{1e3 * result.step_limit:.2f} ms\n"
    )


command = Question(run, tables, verdict, vars)
