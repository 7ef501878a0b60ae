"""Do the plants vibrate like the beam? Frequencies, couplings and mode shapes, side by side.

>>> run(ModesConfig()).clamped_hz["chain"]
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro
from rich.console import Console
from rich.table import Table

from flexsim.arm.beam import modal_integrals, mode_shapes
from flexsim.arm.free_arm import clamped_frequencies, joint_free_frequencies
from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.mjcf.chain_file import ChainModel, highest_frequency, longest_step
from flexsim.numerics.types import Array
from flexsim.plants.assumed_modes import free_frequencies
from flexsim.plants.chain_as_modes import clamped_damping, vibration
from flexsim.robot import Robot
from studies.core.folder import to_json
from studies.core.options import RobotOptions, show_differences

COMPARED = 3  # modes: those of the paper's model
HERTZ = 1 / (2 * np.pi)


@dataclass(frozen=True)
class ModesConfig(RobotOptions):
    """Compare frequencies and mode shapes: exact, assumed modes, chain."""

    file: tyro.conf.Positional[Path | None] = None
    """The MJCF file, as --mjcf."""
    json: bool = False
    """Print one JSON object instead of tables."""

    @property
    def named(self) -> RobotOptions:
        """The robot's file, however it was given.

        Raises:
            ParameterError: it was given twice.
        """
        if self.file is not None and self.mjcf is not None:
            raise ParameterError(f"two MJCF files are given, {self.file} and {self.mjcf}; give one")
        return RobotOptions(mjcf=self.mjcf or self.file, beam=self.beam, **vars(self.names))


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
    return compared(config.named.robot_of())


def compared(robot: Robot) -> ModesResult:
    """Return frequencies, couplings and shapes of the paper's beam and of a robot's plants.

    Raises:
        ModelError: its file has fewer hinges than modes are compared, or what no mode has.
    """
    p = Parameters()
    plant, chain_plant = robot.both(modes=COMPARED)
    chain = chain_plant.chain
    found = vibration(chain, chain_plant.parameters, COMPARED)
    integrals = modal_integrals(p, COMPARED)
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
            "exact": clamped_frequencies(p, COMPARED) * HERTZ,
            "assumed_modes": clamped * HERTZ,
            "chain": found.clamped * HERTZ,
        },
        joint_free_hz={
            "exact": joint_free_frequencies(p, COMPARED) * HERTZ,
            "assumed_modes": free_frequencies(coefficients) * HERTZ,
            "chain": found.joint_free * HERTZ,
        },
        damping_ratio={
            "assumed_modes": np.diag(coefficients.damping) / (2 * clamped * coefficients.mass),
            "chain": clamped_damping(chain)[:COMPARED],
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


def _frequency_table(title: str, columns: dict[str, Array]) -> Table:
    table = Table(title=title, title_justify="left")
    for heading in ("mode", "exact", "assumed modes", "difference", "chain", "difference"):
        table.add_column(heading, justify="right")
    for i, exact in enumerate(columns["exact"]):
        modes, chain = columns["assumed_modes"][i], columns["chain"][i]
        table.add_row(
            str(i + 1),
            f"{exact:.6f}",
            f"{modes:.6f}",
            f"{modes / exact - 1:+.1e}",
            f"{chain:.6f}",
            f"{chain / exact - 1:+.1e}",
        )
    return table


def _coupling_table(result: ModesResult) -> Table:
    table = Table(title="Couplings and tip values of the modes", title_justify="left")
    table.add_column("")
    for heading in ("mode 1", "mode 2", "mode 3"):
        table.add_column(heading, justify="right")
    for name, values in result.couplings.items():
        table.add_row(f"{name}, beam", *[f"{x:+.7f}" for x in values["exact"]])
        table.add_row("  assumed modes", *[f"{x:+.7f}" for x in values["assumed_modes"]])
        table.add_row("  chain", *[f"{x:+.7f}" for x in values["chain"]])
        errors = values["chain"] / values["exact"] - 1
        table.add_row("  difference", *[f"{x:+.1e}" for x in errors], end_section=True)
    table.add_row("MAC, chain to beam", *[f"{value:.6f}" for value in result.mac])
    if np.any(result.damping_ratio["chain"]):
        for model, ratios in result.damping_ratio.items():
            label = f"damping ratio, {model.replace('_', ' ')}"
            table.add_row(label, *[f"{ratio:.6f}" for ratio in ratios])
    return table


def command(config: ModesConfig) -> None:
    """Print the comparison."""
    result = run(config)
    if config.json:
        print(to_json(vars(result)))
        return
    console = Console()
    show_differences(config.named.robot_of())
    print_modes(result, console)


def print_modes(result: ModesResult, console: Console) -> None:
    """Print frequencies, couplings and what bounds the step."""
    console.print(f"Chain: {result.source}; exact: the paper's beam", highlight=False)
    console.print(_frequency_table("Clamped beam, frequencies (Hz)", result.clamped_hz))
    console.print(
        _frequency_table("Both joints free, straight arm, frequencies (Hz)", result.joint_free_hz)
    )
    console.print(_coupling_table(result))
    compliance = result.static_compliance
    console.print(
        f"Static tip compliance (m/N): exact {compliance['exact']:.6f}, assumed modes "
        f"{compliance['assumed_modes']:.6f}, chain {compliance['chain']:.6f}\n"
        "Largest of the chain's differences in couplings and compliance: "
        f"{100 * result.coupling_error_max:.3f} %\n"
        f"Highest frequency (rad/s): assumed modes {result.omega_max['assumed_modes']:.0f}, chain "
        f"{result.omega_max['chain']:.0f}",
        highlight=False,
    )
    if result.step_limit is not None:
        console.print(
            f"The chain's step of {1e3 * result.step:g} ms is within its integrator's limit of "
            f"{1e3 * result.step_limit:.2f} ms",
            highlight=False,
        )
