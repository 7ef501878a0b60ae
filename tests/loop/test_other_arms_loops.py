"""The loops of other arms hold on a bench, on both plants alike; without motor 2 one does not.

With a hold of seconds here; of 20 s it is what `models/README.md` prints.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from controllers import TUNED_ARMS
from flexsim import ParameterError, Robot
from flexsim.arm.arms import named_arm
from flexsim.linear.exact_loop import CONVERGED, exact_growth, exact_loops
from flexsim.linear.loop_poles import LoopOptions, spectral_radii
from flexsim.loop.control.stacking import stack
from flexsim.loop.hardware import HARDWARE
from flexsim.loop.metrics import measures
from flexsim.loop.motion import Motion
from flexsim.loop.runs import closed_loop
from flexsim.loop.settings import setting
from flexsim.loop.trajectories import Turn, path_named, reference, trajectory
from studies.main import main
from studies.tuning.found import devised_for, v_gain_of

PERIOD, HOLD = 1e-3, 4.0  # [s]
BENCH = setting("none", HARDWARE["bench"])
ALIKE = 0.01  # relative: the envelopes of assumed modes and chains
STANDS = 1e-20  # [rad] of a joint whose motor weighs 1e30 kg m2
NAMES = pytest.mark.parametrize("name", ["one-link", "two-flexible"])


def moved(name: str, plant: str) -> tuple[Motion, dict[str, float]]:
    """Return the loop of an arm's own controller on a bench, with a longer hold; its figures."""
    controller, built = TUNED_ARMS[name], Robot.named(name).plant(plant, BENCH)
    path = replace(path_named(devised_for(controller)), hold=HOLD)
    ref = reference(path, built.parameters, PERIOD)
    filters = controller.filters(PERIOD)
    (motion,) = closed_loop(built, BENCH, ref, [filters], v_gain=v_gain_of(controller))
    return motion, measures(motion, ref, path.hold)


@NAMES
def test_it_holds_on_mujocos_chain_and_its_closed_form(name: str) -> None:
    found = {plant: moved(name, plant) for plant in ("chain", "closed-chain")}
    for motion, figures in found.values():
        assert not figures["diverged"]
        apart = np.linalg.norm(motion.tip - motion.reference_tip, axis=1)
        assert apart[-500:].max() < 0.5 * apart.max()  # it comes to rest at the end of the path
    one, other = (figures["envelope"] for _, figures in found.values())
    assert one == pytest.approx(other, rel=ALIKE)


def test_one_links_stand_stands_and_its_modes_do_alike() -> None:
    (chain, of_chain), (modes, of_modes) = (
        moved("one-link", p) for p in ("chain", "assumed-modes")
    )
    for motion in (chain, modes):
        assert np.abs(motion.joint[:, 0]).max() < STANDS
        assert motion.joint[-1, 1] == pytest.approx(np.pi / 2, abs=2e-3)
    assert of_modes["envelope"] == pytest.approx(of_chain["envelope"], rel=ALIKE)


@pytest.mark.slow  # a minute of compiling
def test_two_beams_and_two_chains_hold_alike() -> None:
    (_, of_modes), (_, of_chain) = (moved("two-flexible", p) for p in ("assumed-modes", "chain"))
    assert not of_modes["diverged"]
    assert of_modes["envelope"] == pytest.approx(of_chain["envelope"], rel=ALIKE)


def growth(name: str, delay: int, modes: int = 8, **changes: float) -> float:
    """Return the growth of an arm's loop, exactly held, with whole samples of delay [1/s]."""
    arm, controller = named_arm(name), TUNED_ARMS[name]
    loops = exact_loops(
        replace(arm.parameters, **changes),
        delays=(delay,),
        modes=modes,
        v_gain=v_gain_of(controller),
        link1=arm.link1,
    )
    return float(exact_growth(loops, stack([controller], PERIOD))[0])


def test_two_flexible_links_do_not_grow_with_two_samples_of_delay_or_none() -> None:
    assert max(growth("two-flexible", delay) for delay in (0, 1, 2)) < -0.05
    few, many = (growth("two-flexible", 1, modes) for modes in (8, 12))
    assert abs(few - many) < CONVERGED


def test_without_motor_2_they_grow() -> None:
    """What `MOTOR_2` is for: the motor pushes off the bare end of link 1."""
    assert growth("two-flexible", 1, I_m2=0.0) > 100
    assert growth("two-flexible", 0, I_m2=0.0) > 100


def test_the_exact_loop_is_that_of_the_chain() -> None:
    """Of another model of the same arm, exactly held: the slowest of what decays."""
    controller = TUNED_ARMS["two-flexible"]
    plant = Robot.named("two-flexible").plant("closed-chain")
    options = LoopOptions(PERIOD, v_gain_of(controller))
    radii = spectral_radii(plant, (0.8, 1.5, 2.2), stack([controller], PERIOD), options)
    assert np.log(radii[0]) / PERIOD == pytest.approx(growth("two-flexible", 0), rel=0.02)


def test_a_path_that_turns_a_joint_that_stands_is_refused() -> None:
    p = named_arm("one-link").parameters
    with pytest.raises(ParameterError, match=r"'circle' turns joint 1 by .* turns joint 2 alone"):
        reference(trajectory("circle"), p)
    with pytest.raises(ParameterError, match=r"'turn' turns joint 1 by 0\.5 rad"):
        reference(Turn(end=(0.5, 1.0)), p)


@NAMES
@pytest.mark.parametrize("command", ["compare", "tables", "stability"])
def test_what_asks_about_the_papers_arm_is_refused(
    name: str, command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([command, "--arm", name]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert f"not about --arm {name}" in said and "[robot] arm" in said
