"""The beam that a file stands for: uniform where it is, of pieces where it is not."""

from __future__ import annotations

import re

import numpy as np
import pytest
from edits import DEFAULT, PAYLOAD, edited

from flexsim import ModelError, Parameters, load_chain
from flexsim.arm.chain_design import design_chain, plain_chain
from flexsim.arm.finite_beam import Lump, Piece, finite_beam
from flexsim.arm.free_arm import clamped_frequencies, joint_free_frequencies
from flexsim.mjcf.beams import beam_of as beams
from flexsim.mjcf.beams.beam_of import StandsFor, beam_of
from flexsim.mjcf.bodies import parts
from flexsim.mjcf.chain_file import ChainModel
from flexsim.mjcf.chain_xml import chain_mjcf
from flexsim.mjcf.edits import changed
from flexsim.mjcf.load import load_arm
from flexsim.plants.chain_as_modes import vibration

P = Parameters(zeta=0.0)
OTHER = Parameters(zeta=0.0, L=0.8, EI=1.3, rho=0.4, r=0.03, L_R=0.5, I_R0=0.4, I_H=2e-3)
DIGITS = 2e-8  # relative: twelve digits of hinges, masses and stiffnesses
LOADED = 2e-6  # relative, of a payload that has to be taken out of a segment's body again
BEAM = ("L", "EI", "rho", "r")
CUSTOM = """
  <custom>
    <numeric name="beam_L" data="{L}"/>
    <numeric name="beam_EI" data="{EI}"/>
    <numeric name="beam_rho" data="{rho}"/>
    <numeric name="beam_r" data="{r}"/>
    <numeric name="beam_zeta" data="{zeta}"/>
    <numeric name="beam_payload" data="{payload}"/>
    <numeric name="beam_payload_inertia" data="{payload_inertia}"/>
  </custom>
</mujoco>
"""


def written(p: Parameters, text: str) -> str:
    """Return a file's text with the block of a robot in place of its own."""
    bare = re.sub(r"\s*<custom>.*</custom>", "", text, flags=re.DOTALL)
    numbers = {name: getattr(p, name) for name in ("zeta", "payload", "payload_inertia", *BEAM)}
    return bare.replace("</mujoco>\n", CUSTOM.format(**numbers))


def of(text: str) -> StandsFor:
    return beam_of(load_chain(text=text))


def times(factor: float, attribute: str, text: str = DEFAULT, element: str = "") -> str:
    """Return a file with an attribute multiplied behind every place of an element's pattern."""

    def scaled(match: re.Match[str]) -> str:
        numbers = " ".join(repr(factor * float(each)) for each in match[2].split())
        return f'{match[1]}{attribute}="{numbers}"'

    found, count = re.subn(rf'({element})\b{attribute}="([^"]*)"', scaled, text, flags=re.DOTALL)
    assert count
    return found


BODIES = r'<body name="(?:root|segment\d)"(?:(?!<body).)*?'


def require_uniform(found: StandsFor, p: Parameters, tolerance: float = DIGITS) -> None:
    assert found.reference.uniform, found.remarks
    own = found.reference.parameters
    for name in BEAM:
        assert getattr(own, name) == pytest.approx(getattr(p, name), rel=tolerance), name
    assert own.payload == pytest.approx(p.payload, rel=tolerance, abs=1e-12)
    assert own.payload_inertia == pytest.approx(p.payload_inertia, rel=tolerance, abs=1e-15)
    np.testing.assert_allclose(
        found.reference.clamped(3), clamped_frequencies(p, 3), rtol=tolerance
    )
    np.testing.assert_allclose(
        found.reference.joint_free(3, 0.7), joint_free_frequencies(p, 3, 0.7), rtol=tolerance
    )


@pytest.mark.parametrize("p", [P, OTHER])
@pytest.mark.parametrize("segments", [3, 6, 10])
@pytest.mark.parametrize("tuned", [True, False])
def test_a_chain_as_written_is_its_uniform_beam(p: Parameters, segments: int, tuned: bool) -> None:
    design = (design_chain if tuned else plain_chain)(p, segments)
    found = of(written(p, chain_mjcf(p, design, timestep=1e-4)))
    require_uniform(found, p)
    assert found.default_name == beams.DEFAULT and not found.remarks


def test_a_rod_is_its_uniform_beam() -> None:
    found = beam_of(load_arm("models/rod.xml"))
    assert found.reference.uniform
    np.testing.assert_allclose(found.reference.clamped(3), clamped_frequencies(P, 3), rtol=DIGITS)


def test_whole_beam_edits_are_uniform_beams_again() -> None:
    fine = edited('timestep="0.001"', 'timestep="0.0005"')
    require_uniform(of(times(2, "stiffness", fine)), Parameters(EI=2 * P.EI))
    masses = times(2, "mass", element=BODIES)
    found = of(masses)
    require_uniform(found, Parameters(rho=2 * P.rho))
    assert any("0.5 of a slender rod's" in remark for remark in found.remarks)
    both = of(times(2, "diaginertia", masses, BODIES))
    require_uniform(both, Parameters(rho=2 * P.rho))
    assert not any("slender" in remark for remark in both.remarks)


TIP, PLACE = next(
    (match[0], match[1]) for match in re.finditer(r'<site name="tip" pos="(\S+) 0 0"/>', DEFAULT)
)
PAYLOAD_AT_TIP = re.sub(r'pos="0\.07\d+ 0 0"', f'pos="{PLACE} 0 0"', PAYLOAD)


@pytest.mark.parametrize("factor", [1, 2])
def test_a_payload_body_is_the_exact_beams_payload(factor: int) -> None:
    body = PAYLOAD_AT_TIP.replace('mass="0.05"', f'mass="{0.05 * factor}"')
    found = of(DEFAULT.replace(TIP, body))
    require_uniform(found, Parameters(payload=0.05 * factor, payload_inertia=5e-6))


def test_a_payload_within_the_last_segments_body_is_found_again() -> None:
    chain = changed(load_chain(text=DEFAULT), stiffness=1.3, density=1.5, payload=0.05)
    p = Parameters(EI=1.3 * P.EI, rho=1.5 * P.rho, payload=0.05)
    require_uniform(beam_of(chain), p, LOADED)


def test_a_payload_ahead_of_the_tip_is_no_uniform_beams() -> None:
    ahead = PAYLOAD_AT_TIP.replace('<inertial pos="0 0 0"', '<inertial pos="0.02 0 0"')
    found = of(DEFAULT.replace(TIP, ahead)).reference
    assert not found.uniform
    lump = Lump(0.5, 0.05, 0.05 * 0.02, 5e-6 + 0.05 * 0.02**2)
    expected = finite_beam([Piece(P.L, P.EI, P.rho)], [lump]).frequency[:3]
    np.testing.assert_allclose(found.clamped(3), expected, rtol=1e-6)  # two meshes


def deflection(chain: ChainModel) -> float:
    return vibration(chain, P).compliance


@pytest.mark.parametrize("hinge", [1, 3, 6])
@pytest.mark.parametrize("factor", [0.5, 3.0])
def test_a_hinge_edited_bends_the_beam_as_far_as_the_chain(hinge: int, factor: float) -> None:
    text = edited('timestep="0.001"', 'timestep="0.0005"')
    text = times(factor, "stiffness", text, f'"hinge{hinge}" ')
    chain, usual = load_chain(text=text), load_chain(text=DEFAULT)
    found = beam_of(chain)
    assert not found.reference.uniform
    assert any(f"{factor:g} times at hinge {hinge}" in remark for remark in found.remarks)
    ratio = found.reference.compliance / P.static_compliance
    assert ratio == pytest.approx(deflection(chain) / deflection(usual), rel=1e-8)
    assert (found.reference.clamped(3) > clamped_frequencies(P, 3)).all() == (factor > 1)


def test_many_softer_hinges_converge_to_the_stepped_beam() -> None:
    """The outer half of a plain chain half as stiff: second order in the number of hinges."""
    exact = finite_beam([Piece(0.25, P.EI, P.rho), Piece(0.25, P.EI / 2, P.rho)]).frequency[:3]
    counts, errors = (8, 16, 32), []
    for segments in counts:
        text = chain_mjcf(P, plain_chain(P, segments), timestep=2e-5)
        outer = "|".join(map(str, range(segments // 2 + 1, segments + 1)))
        found = of(times(0.5, "stiffness", text, f'"hinge(?:{outer})" ')).reference
        assert not found.uniform
        errors.append(np.abs(found.clamped(3) / exact - 1).max())
    assert errors[-1] < 2e-3
    assert -np.polyfit(np.log(counts), np.log(errors), 1)[0] > 1.8


def test_a_segment_twice_as_dense_and_one_with_a_point_mass() -> None:
    segment = r'<body name="segment3"(?:(?!<body).)*?'
    heavy = times(2, "mass", element=segment)
    chain = load_chain(text=DEFAULT)
    start, end = chain.hinges[2:4]
    dense = of(times(2, "diaginertia", heavy, segment))
    pieces = [Piece(start, P.EI, P.rho), Piece(end - start, P.EI, 2 * P.rho)]
    pieces.append(Piece(P.L - end, P.EI, P.rho))
    expected = finite_beam(pieces).frequency[:3]
    np.testing.assert_allclose(dense.reference.clamped(3), expected, rtol=1e-6)
    assert any("2 times at piece 3" in remark for remark in dense.remarks)
    own = finite_beam([Piece(P.L, P.EI, P.rho)], [Lump((start + end) / 2, P.rho * (end - start))])
    np.testing.assert_allclose(of(heavy).reference.clamped(3), own.frequency[:3], rtol=1e-6)


@pytest.mark.parametrize("seed", range(6))
def test_whatever_the_bodies_are_their_mass_and_moments_are_kept(seed: int) -> None:
    """Masses, centres and inertias at random: the beam's rigid inertia is that of the file."""
    rng = np.random.default_rng(seed)

    def shaken(match: re.Match[str]) -> str:
        x, mass, turn = (float(each) for each in match.groups())
        x, mass, turn = (
            x * rng.uniform(0.2, 1.8),
            mass * rng.uniform(1, 4),
            turn * rng.uniform(1, 9),
        )
        return f'pos="{x} 0 0" mass="{mass}" diaginertia="{turn} {turn} {turn}"'

    head, beam = DEFAULT.split('<body name="root"')
    pattern = r'pos="(\S+) 0 0" mass="(\S+)"\s+diaginertia="\S+ \S+ (\S+)"'
    text = head + '<body name="root"' + re.sub(pattern, shaken, beam)
    chain = load_chain(text=text.replace('timestep="0.001"', 'timestep="0.0001"'))
    found, bodies = beam_of(chain).reference.finite, parts(chain)[2]
    x = bodies.x - chain.clamp
    assert found.mass == pytest.approx(bodies.mass.sum(), rel=DIGITS)
    assert found.first == pytest.approx(float(bodies.mass @ x), rel=DIGITS)
    second = float(bodies.mass @ x**2 + bodies.inertia.sum())
    assert found.second == pytest.approx(second, rel=DIGITS)


def test_the_block_is_the_default_of_an_edited_file() -> None:
    text = written(OTHER, chain_mjcf(OTHER, design_chain(OTHER, 6), timestep=5e-4))
    found = of(times(1.2, "stiffness", text))
    assert found.default_name == beams.AS_WRITTEN
    np.testing.assert_allclose(found.default.clamped(3), clamped_frequencies(OTHER, 3), rtol=DIGITS)
    np.testing.assert_allclose(
        found.reference.clamped(3), np.sqrt(1.2) * clamped_frequencies(OTHER, 3), rtol=DIGITS
    )


def test_a_file_without_a_block_says_so() -> None:
    bare = re.sub(r"\s*<custom>.*</custom>", "", DEFAULT, flags=re.DOTALL)
    assert any("no <custom> block" in remark for remark in of(bare).remarks)
    require_uniform(of(bare), P)


def test_hinges_elsewhere_are_said_to_be() -> None:
    longer = edited('<body name="segment3" pos="0.10', '<body name="segment3" pos="0.20')
    found = of(written(P, longer))
    assert any("where no chain of ours has them" in remark for remark in found.remarks)
    assert found.reference.compliance == pytest.approx(
        deflection(load_chain(text=longer)), rel=1e-8
    )


@pytest.mark.parametrize("number", ["-0.1", "0", "1e300"])
def test_a_block_that_is_no_beam_is_refused(number: str) -> None:
    text = written(P, DEFAULT).replace(
        'name="beam_EI" data="0.349"', f'name="beam_EI" data="{number}"'
    )
    with pytest.raises(ModelError, match=r"its <custom> block: parameter EI"):
        of(text)


def test_damping_of_hinges_is_the_materials() -> None:
    """c_j = eta k_j is stiffness-proportional: ratio i is eta omega_i / 2; a beam without is 0."""
    eta = 1e-4
    text = re.sub(
        r'stiffness="([^"]*)"(?: damping="[^"]*")?',
        lambda m: f'stiffness="{m[1]}" damping="{eta * float(m[1])!r}"',
        DEFAULT,
    )
    found = of(text).reference
    np.testing.assert_allclose(found.clamped_damping(3), eta * found.clamped(3) / 2, rtol=2e-6)
    assert found.parameters.eta == pytest.approx(eta, rel=2e-6)


SEGMENT_4 = '\n                <body name="segment4"'
ROOT = '\n        <body name="root"'
BOX = PAYLOAD_AT_TIP.removeprefix(TIP)


@pytest.mark.parametrize("place", [SEGMENT_4, ROOT], ids=["on the third segment", "on the hub"])
def test_a_payload_away_from_the_tip_is_refused(place: str) -> None:
    """Its mass would be taken off a beam that does not have it, and put at the tip."""
    assert DEFAULT.count(place) == 1
    text = DEFAULT.replace(place, BOX + place)
    with pytest.raises(ModelError, match="'payload' is not fixed to 'segment6'"):
        of(text)
    other = of(text.replace('name="payload"', 'name="box"'))
    assert other.reference.parameters.payload == 0


def test_a_payload_with_a_hinge_is_refused() -> None:
    """It is the last segment then, whatever its name."""
    hinge = '<joint name="swing" stiffness="1"/><site name="tip" pos="0.01 0 0"/><inertial'
    with pytest.raises(ModelError, match="'payload' has a hinge of its own"):
        of(DEFAULT.replace(TIP, BOX.replace("<inertial", hinge, 1)))


def test_a_block_with_several_numbers_for_one_is_refused() -> None:
    text = written(P, DEFAULT).replace('"beam_L" data="0.5"', '"beam_L" data="0.5 0.6"')
    with pytest.raises(ModelError, match=r"beam_L has 2 numbers; give one"):
        of(text)


def test_a_block_that_lacks_a_number_is_said_to() -> None:
    text = re.sub(r'<numeric name="beam_EI"[^>]*>', "", written(P, DEFAULT))
    assert any("lacks the number beam_EI" in remark for remark in of(text).remarks)
