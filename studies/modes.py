"""Do the plants vibrate like the beam? Frequencies, couplings and mode shapes, side by side.

>>> run(ModesConfig()).clamped_hz["chain"]
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from scipy.linalg import eigh

from flexsim.assumed_modes import free_frequencies
from flexsim.beam import modal_integrals, mode_shapes
from flexsim.chain import ChainModel, highest_frequency, load_chain, longest_step, mass_matrix
from flexsim.chain import stiffness_matrix as stiffness_of
from flexsim.errors import ModelError
from flexsim.exact import clamped_frequencies, joint_free_frequencies
from flexsim.parameters import Parameters
from flexsim.robots import AssumedModesPlant, ChainPlant
from studies.run_folder import to_json

Array = NDArray[np.float64]

COMPARED = 3  # modes: those of the paper's model
HERTZ = 1 / (2 * np.pi)


@dataclass(frozen=True)
class ModesConfig:
    """Compare frequencies and mode shapes: exact, assumed modes, chain."""

    mjcf: tyro.conf.Positional[Path | None] = None
    """MJCF file of the chain; the default chain of 6 segments unless given."""
    json: bool = False
    """Print one JSON object instead of tables."""


@dataclass(frozen=True, eq=False)
class ChainModes:
    """Linear properties of a compiled chain, the first three modes (3,).

    Attributes:
        clamped, joint_free: frequencies [rad/s], joints locked and free, beam straight, theta2 = 0.
        shapes: (N+2, 3) transverse displacement at clamp, hinges, tip, of modes whose modal mass
            is rho L, as (15) has it, positive at the tip of the first.
        Phi, moment: couplings int chi dx [m] and int (x-r) chi dx [m2]; tip: tip values.
        compliance: static tip deflection per tip force [m/N].
    """

    clamped: Array
    joint_free: Array
    shapes: Array
    Phi: Array
    moment: Array
    tip: Array
    compliance: float


def chain_modes(chain: ChainModel, parameters: Parameters, n: int = COMPARED) -> ChainModes:
    """Return the linear properties of a chain as MuJoCo compiled it.

    Args:
        chain: the model; parameters: of the beam it stands for; n: how many modes.

    Raises:
        ModelError: the chain has fewer than n hinges along the beam.
    """
    model = chain.model
    if model.nv - 2 < n:
        raise ModelError(
            f"{chain.source}: has {model.nv - 2} hinges along the beam; at least {n} are needed"
        )
    M, K = mass_matrix(model, np.zeros(model.nq)), stiffness_of(model)
    squared, vectors = eigh(K[2:, 2:], M[2:, 2:])
    vectors = vectors[:, :n] * np.sqrt(parameters.rho * parameters.L)  # modal mass rho L
    angle = np.cumsum(vectors, axis=0)  # of each segment
    across = np.vstack([np.zeros((2, n)), np.cumsum(chain.lengths[:, None] * angle, axis=0)])
    signs = np.sign(across[-1]) * (-1.0) ** np.arange(n)  # tip values 2, -2, 2
    vectors, across = vectors * signs, across * signs
    free, _ = eigh(K, M)
    X = M[1, 2:] @ vectors / parameters.rho  # int x chi
    Phi = (M[0, 2:] - M[1, 2:]) @ vectors / (parameters.rho * chain.L_R)
    arm = np.append(0.0, np.cumsum(chain.lengths))
    lever = arm[-1] - arm[:-1]  # from each hinge to the tip
    return ChainModes(
        clamped=np.sqrt(squared[:n]),
        joint_free=np.sqrt(free[2 : 2 + n]),
        shapes=across,
        Phi=Phi,
        moment=X - chain.clamp * Phi,
        tip=across[-1],
        compliance=float(lever @ np.linalg.solve(K[2:, 2:], lever)),
    )


@dataclass(frozen=True, eq=False)
class ModesResult:
    """What `flexsim modes` prints; frequencies in Hz, each a mapping from model to (3,)."""

    source: str
    clamped_hz: dict[str, Array]
    joint_free_hz: dict[str, Array]
    couplings: dict[str, dict[str, Array]]  # by name, then by model
    coupling_error_max: float
    static_compliance: dict[str, float]
    mac: Array
    omega_max: dict[str, float]
    step: float
    step_limit: float | None


def run(config: ModesConfig) -> ModesResult:
    """Return frequencies, couplings and shapes of the exact beam and of both plants."""
    p = Parameters()
    plant = AssumedModesPlant(p)
    chain = load_chain(config.mjcf) if config.mjcf else ChainPlant.designed(p).chain
    found = chain_modes(chain, p)
    integrals = modal_integrals(p, COMPARED)
    couplings = {  # exact, also the assumed modes' by construction; chain
        "Phi_i (m)": (integrals.Phi, found.Phi),
        "int (x-r) chi_i (m2)": (integrals.x_chi - p.r * integrals.Phi, found.moment),
        "chi_i(tip)": (integrals.tip, found.tip),
    }
    errors = [float(np.abs(chain / exact - 1).max()) for exact, chain in couplings.values()]
    coefficients = plant.coefficients
    return ModesResult(
        source=chain.source if config.mjcf else "default chain of 6 segments",
        clamped_hz={
            "exact": clamped_frequencies(p, COMPARED) * HERTZ,
            "assumed_modes": np.sqrt(coefficients.stiffness / coefficients.mass) * HERTZ,
            "chain": found.clamped * HERTZ,
        },
        joint_free_hz={
            "exact": joint_free_frequencies(p, COMPARED) * HERTZ,
            "assumed_modes": free_frequencies(coefficients) * HERTZ,
            "chain": found.joint_free * HERTZ,
        },
        couplings={
            name: {"exact": exact, "assumed_modes": exact, "chain": values}
            for name, (exact, values) in couplings.items()
        },
        coupling_error_max=max(*errors, abs(found.compliance / p.static_compliance - 1)),
        static_compliance={
            "exact": p.static_compliance,
            "assumed_modes": float(np.sum(integrals.tip**2 / coefficients.stiffness)),
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
        table.add_row(f"{name}, beam and assumed modes", *[f"{x:+.7f}" for x in values["exact"]])
        table.add_row("  chain", *[f"{x:+.7f}" for x in values["chain"]])
        errors = values["chain"] / values["exact"] - 1
        table.add_row("  difference", *[f"{x:+.1e}" for x in errors], end_section=True)
    table.add_row("MAC, chain to beam", *[f"{value:.6f}" for value in result.mac])
    return table


def command(config: ModesConfig) -> None:
    """Print the comparison."""
    result = run(config)
    if config.json:
        print(to_json(vars(result)))
        return
    console = Console()
    console.print(f"Chain: {result.source}", highlight=False)
    console.print(_frequency_table("Clamped beam, frequencies (Hz)", result.clamped_hz))
    console.print(
        _frequency_table("Both joints free, straight arm, frequencies (Hz)", result.joint_free_hz)
    )
    console.print(_coupling_table(result))
    compliance = result.static_compliance
    console.print(
        f"Static tip compliance (m/N): exact {compliance['exact']:.6f}, assumed modes "
        f"{compliance['assumed_modes']:.6f}, chain {compliance['chain']:.6f}\n"
        f"Largest coupling error of the chain: {100 * result.coupling_error_max:.3f} %\n"
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
