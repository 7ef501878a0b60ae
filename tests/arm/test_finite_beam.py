"""Finite elements of a beam against the exact uniform one, closed forms, and themselves."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flexsim import ParameterError, Parameters
from flexsim.arm.beam import load_of, modal_integrals, mode_shapes
from flexsim.arm.finite_beam import (
    ELEMENTS,
    Base,
    FiniteBeam,
    Lump,
    Piece,
    finite_beam,
    joint_free,
    uniform_beam,
)
from flexsim.arm.free_arm import clamped_frequencies, joint_free_frequencies

LOADED = Parameters(payload=0.05, payload_inertia=2e-4, r=0.0, L=0.7, I_m1=0.01)
HEAVY = Parameters(payload=0.08, payload_inertia=3e-3)  # its tip values have other signs
ROBOTS = (Parameters(), LOADED, HEAVY)
COUNTS = np.array([8, 16, 32])  # eighths of the length: ends of the pieces are nodes
ORDER = 0.1  # of a fit over coarse meshes
STATED = np.array([2e-9, 7e-8, 5.1e-7])  # relative, of the usual mesh in modes 1 to 3
ROUNDING = 1e-9  # relative: a compliance of 48 elements
SHAPES = 2e-6  # relative: cubics between nodes, modes converge as their frequencies
STUB = 1e-5  # relative: what it gives way, and what rounding of so stiff an element leaves


def order(errors: list[np.ndarray]) -> np.ndarray:
    return -np.polyfit(np.log(COUNTS), np.log(np.array(errors)), 1)[0]


@pytest.mark.parametrize("p", ROBOTS)
@pytest.mark.parametrize("theta2", [0.0, 1.1])
def test_a_uniform_beam_converges_with_fourth_order_from_above(
    p: Parameters, theta2: float
) -> None:
    exact, free = clamped_frequencies(p, 3), joint_free_frequencies(p, 3, theta2)
    beams = [uniform_beam(p, int(count)) for count in COUNTS]
    clamped = [beam.frequency[:3] / exact - 1 for beam in beams]
    freed = [joint_free(beam, Base(p), theta2)[0][:3] / free - 1 for beam in beams]
    for errors in (clamped, freed):
        assert order(errors) == pytest.approx([4.0] * 3, abs=ORDER)
        assert np.min(errors) > 0


def test_the_usual_mesh_is_as_exact_as_said() -> None:
    error = uniform_beam(Parameters(), ELEMENTS).frequency[:3] / clamped_frequencies(
        Parameters(), 3
    )
    assert (np.abs(error - 1) < STATED).all()


@pytest.mark.parametrize("p", ROBOTS)
def test_couplings_shapes_damping_and_moments_are_the_exact_beams(p: Parameters) -> None:
    beam, exact = uniform_beam(p), modal_integrals(p, 3)
    scale = math.sqrt(p.m_b) / p.rho  # modal mass 1 to rho L, masses to lengths
    P = beam.modes[:, :3].T @ beam.P * scale
    Q = beam.modes[:, :3].T @ beam.Q * scale
    np.testing.assert_allclose(P, exact.Phi, rtol=SHAPES)
    np.testing.assert_allclose(Q, exact.x_chi - p.r * exact.Phi, rtol=SHAPES)
    s = np.linspace(0.0, p.L, 17)
    found = beam.shapes(s, 3) * math.sqrt(p.m_b)
    np.testing.assert_allclose(found, mode_shapes(3, s / p.L, 0, load_of(p)), atol=SHAPES)
    np.testing.assert_allclose(beam.damping_ratio[:3], p.eta * exact.frequency / 2, rtol=SHAPES)
    assert beam.compliance == pytest.approx(p.static_compliance, rel=ROUNDING)
    assert beam.mass == pytest.approx(p.m_b + p.payload)
    assert beam.second == pytest.approx(p.rho * p.L**3 / 3 + p.payload * p.L**2 + p.payload_inertia)


def stepped(elements: int = ELEMENTS, rho: float = 0.157) -> FiniteBeam:
    return finite_beam(
        [Piece(0.125, 0.5, rho), Piece(0.1875, 0.1, 2 * rho, 1e-4), Piece(0.1875, 0.3, rho)],
        [Lump(0.25, 0.01, 0.0, 1e-5), Lump(0.5, 0.02, 0.001, 1e-4)],
        elements,
    )


def test_a_beam_of_pieces_converges_with_fourth_order_too() -> None:
    """Of modes 2 and 3: the error of the first is soon below rounding."""
    fine = stepped(128)
    errors = [stepped(int(count)).frequency[1:3] / fine.frequency[1:3] - 1 for count in COUNTS]
    assert order(errors) == pytest.approx([4.0] * 2, abs=ORDER)
    base = Base(Parameters(), first=1e-3)
    freed = [
        joint_free(stepped(int(count)), base)[0][1:3] / joint_free(fine, base)[0][1:3] - 1
        for count in COUNTS
    ]
    assert order(freed) == pytest.approx([4.0] * 2, abs=ORDER)


def test_a_massless_stepped_beam_in_closed_form() -> None:
    """omega^2 = 1/(m c) with c = int (L - s)^2 / EI ds, and no second mode."""
    pieces = [Piece(0.2, 0.5, 0.0), Piece(0.3, 0.2, 0.0)]
    beam = finite_beam(pieces, [Lump(0.5, 0.04)])
    compliance = (0.5**3 - 0.3**3) / (3 * 0.5) + 0.3**3 / (3 * 0.2)
    assert beam.compliance == pytest.approx(compliance, rel=ROUNDING)
    assert beam.frequency == pytest.approx([1 / math.sqrt(0.04 * compliance)], rel=ROUNDING)


def test_a_rigid_body_is_the_same_wherever_it_is_fixed_on_a_stiff_end() -> None:
    """Parallel axes: a stub of 10^4 times the stiffness carries a mass that may lie ahead."""
    m, own, ahead = 0.03, 2e-5, 0.05
    lump = Lump(0.5, m, m * ahead, own + m * ahead**2)
    far = finite_beam(
        [Piece(0.5, 0.349, 0.157), Piece(ahead, 3.49e3, 0.0)], [Lump(0.55, m, 0.0, own)]
    )
    near = finite_beam([Piece(0.5, 0.349, 0.157)], [lump])
    np.testing.assert_allclose(near.frequency[:3], far.frequency[:3], rtol=STUB)
    np.testing.assert_allclose(near.second, far.second, rtol=ROUNDING)
    base = Base(Parameters())
    np.testing.assert_allclose(
        joint_free(near, base)[0][:3], joint_free(far, base)[0][:3], rtol=STUB
    )


def test_damping_of_one_piece_counts_by_its_share_of_the_energy() -> None:
    """Two halves with eta and 0: ratios of the first below that of both, and they add up."""
    EI, rho, eta = 0.349, 0.157, 1e-4

    def ratio(first: float, second: float) -> np.ndarray:
        return finite_beam(
            [Piece(0.25, EI, rho, first), Piece(0.25, EI, rho, second)]
        ).damping_ratio[:3]

    both, inner, outer = ratio(eta, eta), ratio(eta, 0.0), ratio(0.0, eta)
    np.testing.assert_allclose(inner + outer, both, rtol=ROUNDING)
    assert inner[0] > 0.9 * both[0] and outer[0] > 0  # mode 1 bends at the clamp


@pytest.mark.parametrize(
    ("pieces", "lumps", "said"),
    [
        ([Piece(0.0, 1.0, 1.0)], [], "piece 1 of the beam has length 0 m"),
        ([Piece(1.0, 1.0, 1.0), Piece(1.0, -1.0, 1.0)], [], "piece 2 .* EI -1 N m2"),
        ([Piece(1.0, 1.0, -1.0)], [], "rho -1 kg/m"),
        ([Piece(1.0, 1.0, 1.0)], [Lump(1.5, 1.0)], "a mass is 1.5 m from the clamp; give 0 to 1"),
        ([Piece(1.0, 1.0, 1.0)], [Lump(1.0, 1.0, 1.0, 0.5)], "no rigid body has these"),
        ([Piece(1.0, 1.0, 0.0)], [], "the beam has no mass"),
    ],
)
def test_what_is_no_beam_is_refused(pieces: list[Piece], lumps: list[Lump], said: str) -> None:
    with pytest.raises(ParameterError, match=said):
        finite_beam(pieces, lumps)
