"""Frequencies, couplings and shapes of a robot's own beam and of its two models, side by side.

>>> compared(Robot()).clamped_hz["chain"]

What is called exact is the robot's own beam: a file's, as it stands there, edits and all.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from flexsim.arm.beam import MODES
from flexsim.arm.finite_beam import flexible_modes
from flexsim.arm.parameters import Parameters
from flexsim.arm.reference_beam import ReferenceBeam, uniform_reference
from flexsim.mjcf.beams.beam_of import DEFAULT, WRITTEN, StandsFor, beam_of
from flexsim.mjcf.chain_file import ChainModel, highest_frequency, longest_step
from flexsim.numerics.types import Array
from flexsim.plants.chain_as_modes import Vibration, clamped_damping, vibration
from flexsim.plants.chain_plant import ChainPlant
from flexsim.plants.modes_plant import AssumedModesPlant
from flexsim.robot import Robot

HERTZ = 1 / (2 * np.pi)


@dataclass(frozen=True, eq=False)
class ModesResult:
    """What `flexsim modes` prints; frequencies in Hz, each a mapping from model to (3,).

    `exact` is the robot's own beam; `default`, by the same names, the one that it is compared with:
    the one that was written if a file has been edited since, else the default robot's.
    """

    source: str
    beam: dict[str, str | float]  # how it is solved, and its numbers as a uniform one
    remarks: tuple[str, ...]  # what of a file makes it so
    clamped_hz: dict[str, Array]
    joint_free_hz: dict[str, Array]
    damping_ratio: dict[str, Array]  # of the clamped modes
    joint_free_damping_ratio: dict[str, Array]
    couplings: dict[str, dict[str, Array]]  # by name, then by model
    coupling_error_max: float
    static_compliance: dict[str, float]
    mac: Array
    omega_max: dict[str, float]
    step: float
    step_limit: float | None
    default: dict[str, Any]


def stands_for(robot: Robot) -> StandsFor:
    """Return the beam of a robot, from its file if it has one."""
    if robot.given is not None:
        return beam_of(robot.given)
    own, default = uniform_reference(robot.parameters), uniform_reference(Parameters())
    return StandsFor(own, default, DEFAULT, design="tuned")


def compared(robot: Robot) -> ModesResult:
    """Return frequencies, couplings and shapes of a robot's own beam and of its plants.

    Raises:
        ModelError: its file has fewer hinges than modes are compared, or what no mode has.
    """
    stands = stands_for(robot)
    beam, default = stands.reference, stands.default
    plant, chain_plant = robot.both(modes=MODES)
    chain = chain_plant.chain
    found = vibration(chain, beam.parameters, MODES)
    couplings = couplings_of(beam, plant, found)
    errors = [error(each["chain"], each["exact"]) for each in couplings.values()]
    models = frequencies(beam, plant, chain_plant, found)
    return ModesResult(
        source=source_of(robot),
        beam=as_numbers(beam),
        remarks=stands.remarks,
        **models,
        couplings=couplings,
        coupling_error_max=max(*errors, abs(found.compliance / beam.compliance - 1)),
        static_compliance={
            "exact": beam.compliance,
            "assumed_modes": modal_compliance(plant),
            "chain": found.compliance,
        },
        mac=modal_assurance(chain, found.shapes, beam),
        omega_max={
            "assumed_modes": plant.highest_frequency,
            "chain": highest_frequency(chain.model),
        },
        step=chain.step,
        step_limit=longest_step(chain.model),
        default={
            "name": stands.default_name,
            "beam": as_numbers(default),
            "clamped_hz": default.clamped(MODES) * HERTZ,
            "joint_free_hz": default.joint_free(MODES) * HERTZ,
            "damping_ratio": default.clamped_damping(MODES),
            "joint_free_damping_ratio": default.joint_free_damping(MODES),
            "static_compliance": default.compliance,
        },
    )


def as_numbers(beam: ReferenceBeam) -> dict[str, str | float]:
    """Return how a beam is solved, and its numbers as a uniform one."""
    return {"method": beam.method} | {name: getattr(beam.parameters, name) for name in WRITTEN}


def frequencies(
    beam: ReferenceBeam, plant: AssumedModesPlant, chain_plant: ChainPlant, found: Vibration
) -> dict[str, dict[str, Array]]:
    """Return frequencies [Hz] and damping ratios [-] (3,) of beam and plants, straight arm.

    With free joints ratios are of first order in the damping, the joints' friction with it.
    """
    coefficients, linear = plant.coefficients, plant.linearised(0.0)
    clamped = np.sqrt(coefficients.stiffness / coefficients.mass)
    free, free_ratio = flexible_modes(linear.M, linear.D, linear.K)
    _, chain_ratio = flexible_modes(*chain_plant.chain.motion(0.0))
    return {
        "clamped_hz": {
            "exact": beam.clamped(MODES) * HERTZ,
            "assumed_modes": clamped * HERTZ,
            "chain": found.clamped * HERTZ,
        },
        "joint_free_hz": {
            "exact": beam.joint_free(MODES) * HERTZ,
            "assumed_modes": free * HERTZ,
            "chain": found.joint_free * HERTZ,
        },
        "damping_ratio": {
            "exact": beam.clamped_damping(MODES),
            "assumed_modes": np.diag(coefficients.damping) / (2 * clamped * coefficients.mass),
            "chain": clamped_damping(chain_plant.chain)[:MODES],
        },
        "joint_free_damping_ratio": {
            "exact": beam.joint_free_damping(MODES),
            "assumed_modes": free_ratio,
            "chain": chain_ratio[:MODES],
        },
    }


def couplings_of(
    beam: ReferenceBeam, plant: AssumedModesPlant, found: Vibration
) -> dict[str, dict[str, Array]]:
    """Return couplings to the joints and tip values (3,) of beam and plants.

    Modal masses are rho L of the beam, whatever a plant has.
    """
    p, coefficients, exact = beam.parameters, plant.coefficients, beam.couplings(MODES)
    scale = np.sqrt(p.m_b / coefficients.mass)
    Phi = coefficients.P * scale / p.rho
    values = {
        "Phi_i (m)": (exact.Phi, Phi, found.Phi),
        "int (x-r) chi_i (m2)": (
            exact.moment,
            coefficients.X * scale / p.rho - p.r * Phi,
            found.moment,
        ),
        "chi_i(tip)": (exact.tip, coefficients.tip * scale, found.tip),
    }
    models = ("exact", "assumed_modes", "chain")
    return {name: dict(zip(models, each, strict=True)) for name, each in values.items()}


def error(found: Array, exact: Array) -> float:
    """Return the largest relative difference."""
    return float(np.abs(found / exact - 1).max())


def modal_compliance(plant: AssumedModesPlant) -> float:
    """Return the static tip compliance of assumed modes [m/N]."""
    return float(np.sum(plant.coefficients.tip**2 / plant.coefficients.stiffness))


def source_of(robot: Robot) -> str:
    """Return the name of a robot's file, as titles have it."""
    if robot.rod is not None:
        return f"chain of 6 segments for the beam of {robot.rod.source}"
    return robot.file.source if robot.file is not None else "default chain of 6 segments"


def modal_assurance(chain: ChainModel, shapes: Array, beam: ReferenceBeam) -> Array:
    """Return the MAC (n,) of chain shapes (N+2, n) with a beam's at the hinges and the tip [-]."""
    places = np.append(chain.hinges, chain.reach - chain.clamp)
    exact, found = beam.shapes(places, shapes.shape[1]), shapes[1:]
    cross = np.sum(exact * found, axis=0)
    return cross**2 / (np.sum(exact**2, axis=0) * np.sum(found**2, axis=0))
