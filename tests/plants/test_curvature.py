"""Curvature at a place: closed forms under a force and in modes, order in N, bad places."""

from dataclasses import replace

import numpy as np
import pytest

from flexsim import ModelError, ParameterError, Parameters, Plant
from flexsim.arm.beam import mode_shapes
from flexsim.arm.chain_design import ChainDesign, design_chain, plain_chain
from flexsim.mjcf.chain_file import load_chain
from flexsim.mjcf.chain_xml import chain_mjcf
from flexsim.plants.chain_as_modes import vibration
from flexsim.plants.chain_plant import ChainPlant
from flexsim.plants.curvature import curvature_of_chain
from flexsim.plants.modes_plant import AssumedModesPlant
from flexsim.robot import Robot

P = Parameters()
PLACES = np.array([0.025, 0.1, 0.25, 0.4])  # [m]: 5, 20, 50, 80 % of the beam
STATIC = 1e-5  # the rod's file has numbers of twelve digits, and second differences of them
EXACT = 1e-9
IN_MODES = (2e-4, 2e-3, 2e-2)  # of the curvature at the clamp, tuned chain of six, modes 1, 2, 3


def bent_by_a_force(plant: Plant) -> np.ndarray:
    """Return the plant's curvature (P,) under 1 N at the tip [1/m]."""
    linear = plant.linearised(0.0)
    q = np.zeros(len(linear.K))
    q[2:] = np.linalg.solve(linear.K[2:, 2:], linear.tip[2:])
    rows = plant.curvature_rows(PLACES)
    own = slice(None) if linear.coordinates is None else linear.coordinates
    return np.asarray(rows[:, own] @ q)


@pytest.mark.parametrize("name", ["chain", "closed-chain", "untuned:8", "rod", "exudyn"])
def test_a_force_at_the_tip_bends_as_the_beam(name: str) -> None:
    """v'' = F (L - s)/EI: strain = h F (L - s)/EI, whatever the hinges' places."""
    if name == "exudyn":
        pytest.importorskip("exudyn")
    plant = Robot().plant(name)
    wanted = (P.L - PLACES) / plant.parameters.EI
    if name == "untuned:8":  # EI/h at cells' middles is too stiff for a force, not for its moment
        wanted = (P.L - PLACES) / P.EI
    assert bent_by_a_force(plant) == pytest.approx(wanted, rel=STATIC if name == "rod" else EXACT)


def test_assumed_modes_bend_as_their_sum_converges() -> None:
    """The static shape's curvature by n modes: errors fall with n, as 1/n at the clamp."""
    off = [
        np.abs(bent_by_a_force(AssumedModesPlant(P, n, 1e-7)) / ((P.L - PLACES) / P.EI) - 1).max()
        for n in (3, 6, 12, 24)
    ]
    assert off == sorted(off, reverse=True) and off[0] < 0.2 and off[-1] < 0.01


def in_modes(design: ChainDesign) -> np.ndarray:
    """Return errors (P, 3) of a chain's curvature in its modes 1 to 3, over that at the clamp."""
    chain = load_chain(text=chain_mjcf(replace(P, zeta=0.0), design, 5e-6))
    shapes = vibration(chain, P).hinges  # (N, 3)
    found = curvature_of_chain(chain, P, PLACES) @ shapes * P.L**2
    return np.asarray((found - mode_shapes(3, PLACES / P.L, 2)) / mode_shapes(3, 0.0, 2))


def test_the_tuned_chain_is_curved_as_the_beam_in_its_modes() -> None:
    off = np.abs(in_modes(design_chain(P, 6))).max(axis=0)
    assert (off < IN_MODES).all(), off
    assert off[2] > 0.1 * IN_MODES[2]  # it is not exact: a bound that says something


def test_the_plain_chains_error_is_of_second_order() -> None:
    many = np.array([16, 32, 64])
    off = np.array([np.abs(in_modes(plain_chain(P, int(n)))).max(axis=0) for n in many])
    for mode in range(3):
        order = -np.polyfit(np.log(many), np.log(off[:, mode]), 1)[0]
        assert order == pytest.approx(2, abs=0.15), mode


def test_a_files_modes_are_the_chains() -> None:
    """The assumed modes of an MJCF file: the same curvature for the same shape."""
    chain = load_chain("models/chain6.xml")
    modes = AssumedModesPlant.of_chain(chain)
    plant = ChainPlant(modes.parameters, chain)
    shapes = vibration(chain, modes.parameters).hinges
    q = np.zeros((8, 3))
    q[2:] = shapes
    assert modes.curvature_rows(PLACES)[:, 2:] == pytest.approx(
        plant.curvature_rows(PLACES) @ q, rel=1e-6
    )


def test_bad_places_are_one_line() -> None:
    plant = AssumedModesPlant()
    for place in (-0.01, 0.51, np.nan):
        with pytest.raises(ParameterError, match=r"off the beam; give 0 to 0.5 m") as refused:
            plant.curvature_rows([0.1, place])
        assert "\n" not in str(refused.value)
    with pytest.raises(ParameterError, match="does not bend"):
        Robot().plant("rigid").curvature_rows(PLACES)
    bent = load_chain("models/chain6.xml").text.replace(
        'name="hinge1" stiffness', 'name="hinge1" springref="0.1" stiffness'
    )
    chain = load_chain(text=bent)
    with pytest.raises(ModelError, match="rest at an angle"):
        curvature_of_chain(chain, P, PLACES)


def test_sites_of_a_file_are_the_bridges_places() -> None:
    text = chain_mjcf(P, design_chain(P, 6), bridges=(0.03, 0.21))
    robot = Robot.of(text=text)
    for plant in robot.both():
        assert plant.bridge_sites == pytest.approx((0.03, 0.21), abs=1e-12)
    assert Robot().plant("chain").bridge_sites is None
    assert chain_mjcf(P, design_chain(P, 6)) == text.replace(
        next(line for line in text.splitlines(True) if "strain1" in line), ""
    ).replace(next(line for line in text.splitlines(True) if "strain2" in line), "")
    line = next(line for line in text.splitlines() if "strain2" in line)
    for wrong, why in (
        ("", "has the site 'strain1' but no 'strain2'"),
        ('<site name="strain2" pos="0.6 0 0"/>', "off the beam; put it on"),
    ):
        with pytest.raises(ModelError, match=why) as refused:
            Robot.of(text=text.replace(line, wrong))
        assert "\n" not in str(refused.value)
    with pytest.raises(ParameterError, match=r"off the beam; give 0 to 0.5 m"):
        chain_mjcf(P, design_chain(P, 6), bridges=(0.1, 0.6))


def test_a_payload_with_inertia_bends_the_tip() -> None:
    """Its moment at the tip is no longer zero: the spline ends at the last hinge instead."""
    loaded = replace(P, payload=0.05, payload_inertia=1e-4)
    chain = ChainPlant.designed(loaded, 6)
    rows = chain.curvature_rows([loaded.L])
    assert np.abs(rows).max() > 0
    assert np.abs(ChainPlant.designed(P, 6).curvature_rows([P.L])).max() == pytest.approx(0)
