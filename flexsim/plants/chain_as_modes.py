"""A compiled chain as a flexible link: its modes, its modal integrals, the robot it is part of.

    >>> from flexsim.mjcf.chain_file import load_chain
    >>> from flexsim.plants.chain_as_modes import modes_of_chain, parameters_of
    >>> chain = load_chain("models/chain6.xml")
    >>> modes_of_chain(chain, 3).stiffness        # coefficients of the assumed-modes equations
    >>> parameters_of(chain).EI                   # of the uniform beam that bends as far

So an edited file is the robot of both plants. The modes are those of the chain with its hub
locked; their integrals are sums over the bodies beyond the clamp, so that uneven stiffness, a
payload, dampers in the hinges and another length all come along.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexsim.arm.beam import MODES
from flexsim.arm.parameters import Parameters
from flexsim.errors import ModelError
from flexsim.mjcf.as_parameters import parameters_of
from flexsim.mjcf.bodies import Bodies, parts, require_carried
from flexsim.mjcf.chain_file import ChainModel, mass_matrix, stiffness_matrix
from flexsim.numerics.dense import product, solve
from flexsim.numerics.eigen import natural_modes
from flexsim.numerics.eigenvalues import eigenvalues
from flexsim.numerics.state_matrix import state_matrix
from flexsim.numerics.step_limits import LONGEST_STEP
from flexsim.numerics.types import Array
from flexsim.plants.assumed_modes import AssumedModes

ROUNDING = 1e-12  # damping ratios of undamped chains are below


@dataclass(frozen=True, eq=False)
class Vibration:
    """Linear properties of a compiled chain, its first n modes.

    Attributes:
        clamped, joint_free: (n,) frequencies [rad/s], joints locked and free, beam straight,
            theta2 = 0.
        hinges: (N, n) hinge angles [rad/m] of modes whose modal mass is that of the beam without
            its payload, as (15) has it, positive beside the clamp as these; without payload
            the tip's are plus, minus, plus.
        shapes: (N+2, n) transverse displacement of these at clamp, hinges, tip [-].
        Phi, moment: (n,) couplings int chi dx [m] and int (x-r) chi dx [m2]; tip: tip values.
        compliance: static tip deflection per tip force [m/N].
    """

    clamped: Array
    joint_free: Array
    hinges: Array
    shapes: Array
    Phi: Array
    moment: Array
    tip: Array
    compliance: float


def vibration(chain: ChainModel, parameters: Parameters, n: int = MODES) -> Vibration:
    """Return the linear properties of a chain as MuJoCo compiled it.

    Args:
        chain: the model; parameters: of the beam it stands for, which scale the modes; n: how many.

    Raises:
        ModelError: the chain has fewer than n hinges along the beam.
    """
    model = chain.model
    if model.nv - 2 < n:
        raise ModelError(
            f"{chain.source}: has {model.nv - 2} hinges along the beam; at least {n} are needed "
            f"for {n} modes"
        )
    M, K = mass_matrix(model, np.zeros(model.nq)), stiffness_matrix(model)
    squared, vectors = natural_modes(K[2:, 2:], M[2:, 2:])
    vectors = vectors[:, :n] * np.sqrt(parameters.m_b)  # modal mass rho L
    # positive beside the clamp: the first moment about it is omega^-2 of the bending there
    about_clamp = M[1, 2:] - chain.clamp / chain.L_R * (M[0, 2:] - M[1, 2:])
    vectors = vectors * np.sign(product(about_clamp, vectors))
    across = _across(chain, vectors)
    free, _ = natural_modes(K, M)
    X = product(M[1, 2:], vectors) / parameters.rho  # int x chi
    Phi = product(M[0, 2:] - M[1, 2:], vectors) / (parameters.rho * chain.L_R)
    arm = np.append(0.0, np.cumsum(chain.lengths))
    lever = arm[-1] - arm[:-1]  # from each hinge to the tip
    return Vibration(
        clamped=np.sqrt(squared[:n]),
        joint_free=np.sqrt(free[2 : 2 + n]),
        hinges=vectors,
        shapes=across,
        Phi=Phi,
        moment=X - chain.clamp * Phi,
        tip=across[-1],
        compliance=float(product(lever, solve(K[2:, 2:], lever))),
    )


def _across(chain: ChainModel, vectors: Array) -> Array:
    """Return transverse displacements (N+2, n) at clamp, hinges, tip of hinge angles (N, n)."""
    angle = np.cumsum(vectors, axis=0)  # (N, n) of each segment
    still = np.zeros((2, vectors.shape[1]))
    return np.vstack([still, np.cumsum(chain.lengths[:, None] * angle, axis=0)])


def clamped_damping(chain: ChainModel) -> Array:
    """Return damping ratios (N,) of the chain's motions with the joints locked, slowest first [-].

    A motion that creeps back without swinging counts as 1.
    """
    model = chain.model
    M = mass_matrix(model, np.zeros(model.nq))[2:, 2:]
    D, K = np.diag(model.dof_damping[2:]), np.diag(model.jnt_stiffness[2:])
    rates = eigenvalues(state_matrix(M, D, K))
    rates = rates[np.argsort(np.abs(rates), kind="stable")]
    swinging = rates[rates.imag >= 0][: len(M)]
    ratios: Array = -swinging.real / np.abs(swinging)
    return np.where(np.abs(ratios) < ROUNDING, 0.0, ratios)


def modes_of_chain(chain: ChainModel, n: int = MODES, step: float = LONGEST_STEP) -> AssumedModes:
    """Return the coefficients of the assumed-modes equations with n modes of the chain itself.

    To second order in the modal coordinates, as the equations are: the segments' rotations shorten
    the beam, and bodies have rotary inertia, so N is what J2 = J + m |eta|^2 - eta'N eta leaves.

    Args:
        chain: a checked file; n: modes; step: of RK4 [s].

    Raises:
        ModelError: too few hinges, or something that the equations do not have (see
            `require_carried`).
    """
    require_carried(chain)
    p, model = parameters_of(chain), chain.model
    found = vibration(chain, p, n)
    V = found.hinges  # (N, n)
    _, hub, beam = parts(chain)
    M = mass_matrix(model, np.zeros(model.nq))
    angle = np.cumsum(V, axis=0)  # (N, n) of the segments
    cover = _lever_within(chain, beam)  # (B, N) length of each segment that carries each body
    across = product(cover, angle)  # (B, n) transverse displacement of the centres of mass
    mass = np.full(n, p.m_b)  # by the scale of the modes
    spread = product((beam.mass[:, None] * across).T, across)
    carried, turned = product(beam.mass, cover), product(beam.mass * beam.x, cover)  # (N,), (N,)
    return AssumedModes(
        L_R=p.L_R,
        reach=p.reach,
        A=p.I_m1 + p.I_R0 + p.L_R**2 * float(hub.mass.sum() + beam.mass.sum()),
        J=hub.about_axis + beam.about_axis,
        I_m2=p.I_m2,
        first_moment=float(product(hub.mass, hub.x) + product(beam.mass, beam.x)),
        F_1=float(model.dof_damping[0]),
        F_2=float(model.dof_damping[1]),
        r_1=p.r_1,
        r_2=p.r_2,
        P=product(M[0, 2:] - M[1, 2:], V) / p.L_R,
        X=product(M[1, 2:], V),
        mass=mass,
        inverse_mass=1 / mass,
        stiffness=found.clamped**2 * mass,
        damping=product(V.T, model.dof_damping[2:, None] * V),
        M=product(angle.T, carried[:, None] * angle),  # -2 sum of mass times shortening
        N=np.diag(mass) - spread + product(angle.T, turned[:, None] * angle),
        tip=found.tip.copy(),
        slope=product(angle.T, chain.lengths[:, None] * angle),
        step=step,
    )


def _lever_within(chain: ChainModel, beam: Bodies) -> Array:
    """Return (B, N): how much of each segment lies between the clamp and each centre of mass [m].

    A body beyond its segment's end, as a payload may be, turns with its segment.
    """
    carrier = chain.model.body_weldid[list(beam.ids)]
    order = {int(body): j for j, body in enumerate(chain.model.jnt_bodyid[2:])}
    starts = chain.root + np.concatenate([[0.0], np.cumsum(chain.lengths)[:-1]])  # (N,)
    cover = np.zeros((len(beam.ids), len(chain.lengths)))
    for b, weld in enumerate(carrier):
        j = order.get(int(weld), -1)  # -1: fixed to the hub
        cover[b, : max(j, 0)] = chain.lengths[: max(j, 0)]
        if j >= 0:
            cover[b, j] = beam.x[b] - starts[j]
    return cover
