"""Beams that are not uniform: closed forms of wedge and cone, published tapers, chains of them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import iv, jv, kv, yv

from flexsim import ParameterError
from flexsim.arm.beam import Load, beta_lengths
from flexsim.arm.chain_design import design_chain
from flexsim.arm.finite_beam import Piece, finite_beam
from flexsim.arm.graded_beam import GradedBeam, finite_graded
from flexsim.arm.graded_chain import design_graded, mass_of_hinges, target
from flexsim.arm.parameters import Parameters
from flexsim.numerics.eigen import natural_modes

COUNTS = np.array([6, 12, 24])
ORDER = 0.15  # of a fit over coarse meshes
MESH = 1e-6  # relative: 48 elements, third frequency
EXACT = 1e-9  # relative: Newton's iteration


def beam(**more: float) -> GradedBeam:
    return GradedBeam.uniform(1.0, 1.0, 1.0, **more)


def truncated(order: int, blunt: float, n: int) -> float:
    """Return omega of the n-th mode of a truncated wedge (order 1) or cone (2), dimensionless.

    With x from the point that the sides run to, 1 at the clamp and `blunt` at the tip, deflections
    are x^(-order/2) times J, Y, I and K of that order at 2 k sqrt(x), k^2 = omega; so slopes have
    the next order, the moment the one after, the shear force the former again. Source: Kirchhoff,
    Monatsberichte der Berliner Akademie 1879, p. 815, for the point itself.
    """

    def equation(k: float) -> float:
        z, end, up = 2 * k, 2 * k * np.sqrt(blunt), order + 1
        rows = [
            [jv(order, z), yv(order, z), iv(order, z), kv(order, z)],
            [-jv(up, z), -yv(up, z), iv(up, z), -kv(up, z)],
            [jv(up + 1, end), yv(up + 1, end), iv(up + 1, end), kv(up + 1, end)],
            [jv(up, end), yv(up, end), iv(up, end), -kv(up, end)],
        ]
        return float(np.linalg.det(np.array(rows)))

    grid = np.linspace(0.8, 20.0, 500)
    values = [equation(k) for k in grid]
    pairs = zip(grid, grid[1:], values, values[1:], strict=False)
    roots = [brentq(equation, a, b) for a, b, f, g in pairs if f * g < 0]
    return float(roots[n - 1]) ** 2 * (1 - blunt) ** 2


def test_the_closed_forms_are_kirchhoffs() -> None:
    assert truncated(1, 1e-6, 1) == pytest.approx(5.315, abs=5e-4)  # as printed in textbooks since
    assert truncated(2, 1e-6, 1) == pytest.approx(8.719, abs=5e-4)


@pytest.mark.parametrize(("order", "blunt"), [(1, 0.5), (1, 0.1), (2, 0.5), (2, 0.1)])
def test_wedge_and_cone_are_exact(order: int, blunt: float) -> None:
    exact = [truncated(order, blunt, n) for n in (1, 2, 3)]
    found = beam(thickness=blunt, width=blunt if order == 2 else 1.0).frequencies(3)
    np.testing.assert_allclose(found, exact, rtol=3 * MESH)


@pytest.mark.parametrize(
    ("thickness", "width", "published"),
    [  # Ozdemir Ozgumus and Kaya, Meccanica 41 (2006) 661, as Table 1 of Int. J. Mech. Mater. Eng.
        # 10 (2015), doi 10.1186/s40712-015-0040-0, has them; tapers tau = 1 - ratio
        (0.8, 1.0, (3.60828, 20.6210, 56.1923)),
        (0.2, 1.0, (4.29249, 15.7427, 36.8846)),
        (1.0, 0.8, (3.76286, 22.5018, 62.1525)),
        (0.8, 0.8, (3.85512, 21.0568, 56.6303)),
        (0.2, 0.2, (6.19639, 18.3855, 39.8336)),
    ],
)
def test_tapered_beams_are_as_published(
    thickness: float, width: float, published: tuple[float, ...]
) -> None:
    found = beam(thickness=thickness, width=width).frequencies(3)
    np.testing.assert_allclose(found, published, rtol=2e-5)  # six digits are printed


def test_out_of_the_plane_thickness_and_width_change_places() -> None:
    one, other = beam(thickness=0.5, width=0.8), beam(thickness=0.8, width=0.5)
    np.testing.assert_allclose(one.frequencies(3), other.frequencies(3, out=True), rtol=1e-12)


@pytest.mark.parametrize("load", [(0.0, 0.0), (0.5, 0.0), (1.0, 0.04)])
def test_a_uniform_beam_is_the_exact_one_with_its_load(load: tuple[float, float]) -> None:
    loaded = beam(tip_mass=load[0], tip_inertia=load[1])
    roots = np.array(beta_lengths(3, Load(*load))) ** 2
    np.testing.assert_allclose(loaded.frequencies(3), roots, rtol=1e-14)
    np.testing.assert_allclose(finite_graded(loaded).frequency[:3], roots, rtol=MESH)


def test_a_heavy_tip_is_as_published() -> None:
    """beta L of a cantilever with a tip mass as heavy as itself, 1.2479, 4.0311, 7.1341.

    Source: Laura, Pombo and Susemihl, J. Sound Vib. 37 (1974) 161.
    """
    found = np.sqrt(finite_graded(beam(tip_mass=1.0)).frequency[:3])
    np.testing.assert_allclose(found, [1.2479, 4.0311, 7.1341], atol=6e-5)


def test_elements_converge_with_fourth_order() -> None:
    tapered = beam(thickness=0.5, width=0.7, tip_mass=0.1)
    fine = finite_graded(tapered, elements=96).frequency[:3]
    errors = [finite_graded(tapered, elements=int(n)).frequency[:3] / fine - 1 for n in COUNTS]
    slopes = -np.polyfit(np.log(COUNTS), np.log(np.array(errors)), 1)[0]
    assert slopes == pytest.approx([4.0] * 3, abs=ORDER)


def test_stations_of_a_step_are_pieces() -> None:
    """Two stations close together are a jump between them, as of two uniform pieces."""
    place = np.array([0.0, 0.4995, 0.5005, 1.0])
    EI, rho = np.array([2.0, 2.0, 1.0, 1.0]), np.array([1.5, 1.5, 1.0, 1.0])
    stepped = finite_graded(GradedBeam(place, EI, EI, rho)).frequency[:3]
    pieces = finite_beam([Piece(0.5, 2.0, 1.5), Piece(0.5, 1.0, 1.0)]).frequency[:3]
    np.testing.assert_allclose(stepped, pieces, rtol=1e-4)  # the ramp is a thousandth long


def test_the_chain_of_a_uniform_beam_is_the_tuned_one() -> None:
    p = Parameters()
    own, known = (
        design_graded(GradedBeam.uniform(p.L, p.EI, p.rho, EI_out=50.0), 6),
        design_chain(p),
    )
    np.testing.assert_allclose(own.position, known.position, rtol=1e-14)
    np.testing.assert_allclose(own.stiffness, known.stiffness, rtol=1e-9)
    np.testing.assert_allclose(own.stiffness_out, known.stiffness * 50.0 / p.EI, rtol=1e-9)
    assert own.coupling_error == pytest.approx(known.coupling_error, rel=1e-2)  # finite elements


@pytest.mark.parametrize(
    "more", [{"tip_mass": 0.5}, {"thickness": 0.5}, {"thickness": 2.0, "width": 0.7}]
)
def test_chains_have_the_beams_frequencies_and_couplings(more: dict[str, float]) -> None:
    graded = beam(EI_out=30.0, **more)
    chain = design_graded(graded, 5)
    np.testing.assert_allclose(chain.frequency[:3], graded.frequencies(3), rtol=EXACT)
    np.testing.assert_allclose(chain.frequency_out[:3], graded.frequencies(3, True), rtol=EXACT)
    assert chain.coupling_error < 0.01
    squared = natural_modes(np.diag(chain.stiffness), mass_of_hinges(graded, chain.position))[0]
    np.testing.assert_allclose(np.sqrt(squared), chain.frequency, rtol=EXACT)


def test_what_is_fitted_matters() -> None:
    """Negative control: the uniform chain's springs, scaled, miss a loaded beam's frequencies."""
    graded = beam(tip_mass=1.0, tip_inertia=0.04)
    known = design_chain(Parameters(L=1.0, EI=1.0, rho=1.0), 4)
    squared = natural_modes(np.diag(known.stiffness), mass_of_hinges(graded, known.position))[0]
    assert np.abs(np.sqrt(squared[:3]) / target(graded).frequency - 1).max() > 1e-2


def test_pieces_keep_mass_and_moments() -> None:
    graded = beam(thickness=0.6, width=0.9)
    chain, whole = design_graded(graded, 4), finite_graded(graded)
    starts = np.concatenate([[0.0], chain.position])
    mass = math.fsum(piece.mass for piece in chain.pieces)
    first = sum(m.mass * (s + m.centre) for m, s in zip(chain.pieces, starts, strict=True))
    second = sum(
        m.inertia + m.mass * (s + m.centre) ** 2 for m, s in zip(chain.pieces, starts, strict=True)
    )
    np.testing.assert_allclose(
        [mass, first, second], [whole.mass, whole.first, whole.second], rtol=1e-12
    )


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"EI": 0.0}, "EI is 0 N m2 at s = 0 m; give a finite number above 0"),
        ({"rho": math.nan}, "rho is nan kg/m"),
        ({"length": -1.0}, "length is -1 m"),
        ({"thickness": 0.0}, "the tip's thickness is 0 of the clamp's; give 0.01 to 100"),
        ({"tip_mass": -1.0}, "the tip mass is -1"),
        ({"tip_inertia": 1.0}, "without a mass"),
    ],
)
def test_what_is_no_beam_is_refused(more: dict[str, float], words: str) -> None:
    with pytest.raises(ParameterError, match=words.replace("(", r"\(")):
        GradedBeam.uniform(**({"length": 1.0, "EI": 1.0, "rho": 1.0} | more))


def test_segments_out_of_range_are_refused() -> None:
    with pytest.raises(ParameterError, match="number of segments is 2; give a whole number from 3"):
        design_graded(beam(), 2)
