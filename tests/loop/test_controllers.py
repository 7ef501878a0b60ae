"""Controllers of every linear kind: read by type, never misread, run and linearised alike."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import signal

from controllers import TUNED_IDEAL
from flexsim import AssumedModesPlant, ParameterError, Parameters
from flexsim.linear.controller_space import controller_space, controller_states
from flexsim.linear.loop_poles import LoopOptions, linear_loop
from flexsim.linear.margins import margins
from flexsim.loop.compiled_loop import Outcome
from flexsim.loop.control.compiled import filter_sample
from flexsim.loop.control.linear_kinds import kind_of
from flexsim.loop.control.stacking import stack
from flexsim.loop.runs import evaluate
from flexsim.loop.settings import setting
from flexsim.loop.trajectories import Trajectory, reference

PERIOD = 1e-3  # [s]
ALIKE = 1e-9  # relative to the largest; 150 samples in a loop that amplifies rounding: 1e-13
POLES = 1e-9  # of the loop's poles; the companion's double poles are good to 1e-10
CUBED = 5e-5  # [N m] what atan(v/(r+L)) is less than v/(r+L), through the loop: 1.5e-5 of 0.3
RESPONSE = 1e-8  # relative, of sections whose poles are 2.5e-6 from 1: 1e-16 over that
PLANT = AssumedModesPlant(Parameters())
SHORT = Trajectory("line", duration=0.1, hold=0.05, start=(0.60, 0.30), end=(0.59, 0.31))
REFERENCE = reference(SHORT, PLANT.parameters, PERIOD)
GAIN = 30.0  # [N m/rad]
ZEROS, POLE = np.array([0.95, 0.3]), np.array([0.7, -0.2])
B, A = GAIN * np.poly(ZEROS), np.poly(POLE)
PLAIN = (np.array([2.0, -1.9]), np.array([1.0, -0.5]))  # of joint 2


def run(controller: Any, plant: AssumedModesPlant = PLANT, **columns: Any) -> Outcome:
    return evaluate(plant, setting("none"), replace(REFERENCE, **columns), [controller], stride=1)


def alike(one: Outcome, other: Outcome) -> None:
    for name in ("torques", "states"):
        first, second = getattr(one, name), getattr(other, name)
        assert np.isfinite(first).all()
        scale = np.abs(first).max(axis=(0, 1))
        assert np.abs(first - second).max(axis=(0, 1)) == pytest.approx(0 * scale, abs=ALIKE)
        assert (np.abs(first - second).max(axis=(0, 1)) <= ALIKE * scale).all()


def theirs(**fields: Any) -> Any:
    """Return a stand-in for python-control's systems, which are known by their attributes."""
    return SimpleNamespace(**fields)


ROWS = dict(zip("ABCD", signal.tf2ss(B, A), strict=True))
ALL = {
    "lists": [list(B), list(A)],
    "(1, n)": (B[None], A),
    "scaled": (3 * B, 3 * A),
    "sections": signal.tf2sos(B, A),
    "one section of a0 = 2": 2 * signal.tf2sos(B, A),
    "zeros, poles, gain": (ZEROS, POLE, GAIN),
    "zeros with their period": (ZEROS, POLE, GAIN, PERIOD),
    "matrices": tuple(ROWS.values()),
    "matrices with their period": (*ROWS.values(), PERIOD),
    "dlti": signal.dlti(B, A, dt=PERIOD),
    "dlti of zeros": signal.dlti(ZEROS, POLE, GAIN, dt=PERIOD),
    "dlti of matrices": signal.dlti(*ROWS.values(), dt=PERIOD),
    "control.tf": theirs(num=[[B]], den=[[A]], dt=PERIOD),
    "control.ss": theirs(**ROWS, dt=PERIOD * (1 + 1e-15)),
    "cascades": theirs(cascades=[[([GAIN], [1.0]), (np.poly(ZEROS), A)]]),
    "two branches": theirs(cascades=[[(0.25 * B, A)], [(0.75 * B, A)]]),
}


@pytest.mark.parametrize("kind", ALL)
def test_a_filter_runs_alike_whatever_it_is_given_as(kind: str) -> None:
    expected = run(((B, A), PLAIN))
    alike(expected, run((ALL[kind], PLAIN)))
    alike(run((PLAIN, (B, A))), run((PLAIN, ALL[kind])))


@pytest.mark.parametrize("kind", ALL)
def test_the_linear_loop_is_alike_whatever_it_is_given_as(kind: str) -> None:
    def loop(mine: Any) -> Any:
        return linear_loop(PLANT, 1.2, stack([(mine, PLAIN)], PERIOD), LoopOptions(hold="stepped"))

    one, other = loop((B, A)), loop(ALL[kind])
    found = other.poles
    for pole in one.poles[np.abs(one.poles) > 1e-3]:  # padding adds poles at 0
        assert np.abs(found - pole).min() < POLES
    for joint in (0, 1):
        expected, have = vars(margins(one, joint)), vars(margins(other, joint))
        assert have == pytest.approx(expected, rel=1e-6)


def test_two_sections_are_not_taken_for_b_and_a() -> None:
    sos = signal.butter(4, 0.2, output="sos")
    assert sos.shape == (2, 6)
    x = np.random.default_rng(1).standard_normal(50)
    stacked = stack([(sos, (sos[0], sos[1]))], PERIOD)
    z = np.zeros(stacked.b.shape[1:])
    assert stacked.b.shape[3:] == (2, 6)
    y = x
    for s in range(2):
        y = np.array(
            [filter_sample(stacked.b[0, 0, 0, s], stacked.a[0, 0, 0, s], z[0, 0, s], v) for v in y]
        )
    assert y == pytest.approx(signal.sosfilt(sos, x), abs=1e-12)
    tuple_means_b_a = [
        filter_sample(stacked.b[0, 1, 0, 0], stacked.a[0, 1, 0, 0], z[1, 0, 0], v) for v in x
    ]
    assert tuple_means_b_a == pytest.approx(signal.lfilter(sos[0], sos[1], x), rel=1e-9)
    with pytest.raises(ParameterError, match="two rows of six"):
        kind_of(sos.tolist(), PERIOD)


def test_fewer_zeros_than_poles_are_a_delay() -> None:
    """As `dlti` has it: zeros and poles are in z, and scipy's own `zpk2sos` loses the delay."""
    impulse = np.eye(1, 30)[0]
    for p in ([0.5, 0.2, -0.1], [0.5, 0.3 + 0.4j, 0.3 - 0.4j]):
        for z in ([], [0.4], [0.4, -0.3]):
            expected = signal.dlti(z, p, 2.0, dt=PERIOD).impulse(n=30)[1][0][:, 0]
            y = impulse
            for b, a in kind_of((z, p, 2.0), PERIOD)[0]:
                y = signal.lfilter(b, a, y)
            assert y == pytest.approx(expected, abs=1e-13)


def test_a_transfer_function_in_z_keeps_its_delay() -> None:
    ((b, a),) = kind_of(signal.dlti([2.0], [1.0, -0.5, 0.1], dt=PERIOD), PERIOD)[0]
    assert (b.tolist(), a.tolist()) == ([0.0, 0.0, 2.0], [1.0, -0.5, 0.1])


# --- both joints at once ------------------------------------------------------------------------


def both(first: Any, second: Any) -> tuple[np.ndarray, ...]:
    """Return two filters side by side as a state space from (e1, e2) to two torques."""
    spaces = [signal.tf2ss(*first), signal.tf2ss(*second)]
    n = [len(each[0]) for each in spaces]
    parts = [np.zeros(shape) for shape in ((sum(n), sum(n)), (sum(n), 2), (2, sum(n)), (2, 2))]
    for j, (start, each) in enumerate(zip((0, n[0]), spaces, strict=True)):
        own = slice(start, start + n[j])
        parts[0][own, own], parts[1][own, j] = each[0], each[1][:, 0]
        parts[2][j, own], parts[3][j, j] = each[2][0], each[3][0, 0]
    return tuple(parts)


def test_one_state_space_of_both_joints_is_two_filters() -> None:
    expected = run(((B, A), PLAIN))
    matrices = both((B, A), PLAIN)
    alike(expected, run(matrices))
    alike(expected, run(signal.dlti(*matrices, dt=PERIOD)))
    table = theirs(
        num=[[B, np.zeros(1)], [np.zeros(1), PLAIN[0]]],
        den=[[A, np.ones(1)], [np.ones(1), PLAIN[1]]],
        dt=PERIOD,
    )
    alike(expected, run(table))
    loops = [
        linear_loop(PLANT, 1.2, stack([each], PERIOD)).poles for each in (((B, A), PLAIN), matrices)
    ]
    for pole in loops[1]:
        assert np.abs(loops[0] - pole).min() < POLES


def test_v_has_a_path_of_its_own() -> None:
    """u2 = k e2 - 2 k v/(r + L) undoes, near rest, the sign that the loop gives v."""
    k, reach = 3.0, PLANT.parameters.reach
    D = np.array([[30.0, 0.0, 0.0], [0.0, k, -2 * k / reach]])
    given = (np.zeros((0, 0)), np.zeros((0, 3)), np.zeros((2, 0)), D)
    pair = (([30.0], [1.0]), ([k], [1.0]))
    own = evaluate(PLANT, setting("none"), REFERENCE, [given], stride=1)
    states = own.states[0]
    v = PLANT.observe(states).v
    assert np.abs(v).max() > 1e-4  # [m], so that its path counts
    assert own.torques[0, :, 1] == pytest.approx(
        k * own.errors[0, :, 1] - 2 * k / reach * v, abs=1e-12
    )
    direct = evaluate(PLANT, setting("none"), REFERENCE, [pair], stride=1, v_gain=1.0)
    assert own.torques[0] == pytest.approx(direct.torques[0], abs=CUBED)
    growth = linear_loop(PLANT, 1.2, stack([given], PERIOD)).growth_rate
    same = linear_loop(PLANT, 1.2, stack([pair], PERIOD), LoopOptions(v_gain=1.0)).growth_rate
    assert growth == pytest.approx(same, abs=1e-9)


def test_linear_states_are_those_that_the_loop_runs_through() -> None:
    """The state space of a mixed population gives the torques that were simulated."""
    mixed = [((B, A), PLAIN), both((B, A), PLAIN), (ALL["two branches"], ALL["sections"])]
    outcome = evaluate(PLANT, setting("none"), REFERENCE, mixed, stride=1)
    controllers = stack(mixed, PERIOD)
    for i in range(len(mixed)):
        v = PLANT.observe(outcome.states[i]).v
        measured = np.column_stack([outcome.errors[i], v])
        one = controllers.chosen(slice(i, i + 1))
        _, _, C, D = controller_space(one)
        torques = controller_states(one, measured) @ C[0].T + measured @ D[0].T
        scale = np.abs(outcome.torques[i]).max(axis=0)
        assert torques / scale == pytest.approx(outcome.torques[i] / scale, abs=ALIKE)


def test_who_else_is_in_a_population_changes_no_bit() -> None:
    alone = run(((B, A), PLAIN))
    mixed = [((B, A), PLAIN), both((B, A), PLAIN), (ALL["two branches"], ALL["sections"])]
    among = evaluate(PLANT, setting("none"), REFERENCE, mixed, stride=1)
    np.testing.assert_array_equal(among.states[0], alone.states[0])
    np.testing.assert_array_equal(among.torques[0], alone.torques[0])


def test_objects_with_filters_are_controllers() -> None:
    tuned = TUNED_IDEAL["line"]
    np.testing.assert_array_equal(run(tuned).states, run(tuned.filters(PERIOD)).states)


# --- wide bands ---------------------------------------------------------------------------------


def oustaloup(pairs: int, decades: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Return zeros, poles and gain in z of s^0.5 over a band that ends at 2500 rad/s."""
    high = 2500.0
    edges = high * 10.0 ** (-decades * (1 - (2 * np.arange(pairs) + 0.5) / (2 * pairs)))
    poles = edges * 10.0 ** (decades / (2 * pairs))
    return signal.bilinear_zpk(-edges, -poles, high**0.5, 1 / PERIOD)


def test_seventeen_pairs_over_six_decades_need_sections() -> None:
    zpk = oustaloup(17, 6.0)
    (cascade,) = kind_of(zpk, PERIOD)
    omega = np.geomspace(2.5e-3, 2500.0, 60) * PERIOD
    exact = signal.freqz_zpk(*zpk, omega)[1]
    found = np.prod([signal.freqz(b, a, omega)[1] for b, a in cascade], axis=0)
    assert np.abs(found / exact - 1).max() < RESPONSE
    assert all(abs(np.roots(a)[0]) < 1 for _, a in cascade)
    b, a = signal.zpk2tf(*zpk)
    assert np.abs(np.roots(a)).max() > 1  # control: the polynomial is not even stable
    slow = ((GAIN * b, a), PLAIN)
    fast = ((*zpk[:2], GAIN / 50 * zpk[2]), PLAIN)
    held = run(fast)
    assert np.isnan(held.diverged).all()
    _, _, C, _ = controller_space(stack([fast], PERIOD))
    assert np.abs(np.linalg.eigvals(controller_space(stack([fast], PERIOD))[0][0])).max() < 1
    assert C.shape[-1] == 2 * 17
    assert np.abs(np.linalg.eigvals(controller_space(stack([slow], PERIOD))[0][0])).max() > 1


# --- torque fed forward -------------------------------------------------------------------------


def test_torque_is_fed_forward() -> None:
    torque = 0.1 * np.random.default_rng(1).standard_normal((len(REFERENCE.time), 2))
    outcome = run(((B, A), PLAIN), torque=torque)
    for j, (b, a) in enumerate(((B, A), PLAIN)):
        own = signal.lfilter(b, a, outcome.errors[0, :, j])
        assert outcome.torques[0, :, j] == pytest.approx(own + torque[:, j], abs=1e-9)
    without = run(((B, A), PLAIN))
    still = run(((B, A), PLAIN), torque=np.zeros_like(torque))
    np.testing.assert_array_equal(still.states, without.states)


@pytest.mark.parametrize(
    "torque", [np.zeros(151), np.zeros((150, 2)), np.full((151, 2), np.nan), "none", [[1], [1, 2]]]
)
def test_torque_that_cannot_be_fed_forward_is_refused(torque: Any) -> None:
    with pytest.raises(ParameterError, match="the reference's torque") as refused:
        run(((B, A), PLAIN), torque=torque)
    assert "\n" not in str(refused.value)


# --- what cannot be used ------------------------------------------------------------------------

REFUSED = {
    "complex": (([1j], [1.0]), "complex"),
    "nan": (([np.nan], [1.0]), "finite"),
    "a0": (([1.0], [0.0, 1.0]), r"a\[0\] other than 0"),
    "a0 of sections": (np.array([[1.0, 0, 0, 0, 1, 0]]), r"a\[0\] other than 0"),
    "empty": (([], [1.0]), "empty"),
    "overflow": (([1e300], [1e-300]), "overflow"),
    "text": (("ab", "cd"), "numbers in a row"),
    "ragged": (([[1.0, 2.0], [3.0]], [1.0]), "different lengths"),
    "nothing": (None, "of type NoneType"),
    "array (2, 3)": (np.ones((2, 3)), r"shape \(2, 3\); an array is sections"),
    "array (5,)": (np.ones(5), "an array is sections"),
    "array (0, 6)": (np.ones((0, 6)), "an array is sections"),
    "six": ((1,) * 6, "a tuple of 6"),
    "none at all": ((), "a tuple of 0"),
    "continuous": (signal.lti([1.0], [1.0, 1.0]), "continuous"),
    "continuous too": (theirs(num=[[[1.0]]], den=[[[1.0]]], dt=0), "continuous"),
    "no period": (signal.dlti([1.0], [1.0, -0.5]), "without a sampling period"),
    "period": (signal.dlti([1.0], [1.0, -0.5], dt=2e-3), "0.002 s, the loop's 0.001"),
    "period in a tuple": ((np.eye(1), np.eye(1), np.eye(1), np.eye(1), 0.01), "0.01 s"),
    "b, a, dt": (([1.0], [1.0, -0.5], PERIOD), "ends in the control period"),
    "lookahead": (([0.1, 0.2], [0.5], 1.0), "looks ahead"),
    "lookahead in z": (signal.dlti([1.0, 2.0, 3.0], [1.0, 0.5], dt=PERIOD), "looks ahead"),
    "half a pair": (([0.5j], [0.1], 1.0), "conjugates"),
    "gain": (([0.5], [0.1], np.inf), "finite"),
    "shapes": ((np.eye(2),) * 3 + (np.eye(3),), "A, B, C, D have shapes"),
    "outputs": (signal.dlti(*(np.eye(2),) * 4, dt=PERIOD), "2 inputs and 2 outputs"),
    "response only": (theirs(dt=PERIOD, fresp=1), "of type SimpleNamespace"),
    "long": ((np.full(999, np.nan), [1.0]), "finite"),
}


@pytest.mark.filterwarnings("ignore::scipy.signal.BadCoefficients")
@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_used_is_refused_in_a_line(case: str) -> None:
    given, said = REFUSED[case]
    with pytest.raises(ParameterError, match=said) as refused:
        stack([((B, A), PLAIN), (PLAIN, given)], PERIOD)
    text = str(refused.value)
    assert text.startswith("filter 2 of controller 1 ") and "\n" not in text and len(text) < 200


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (signal.dlti(B, A, dt=PERIOD), "one filter alone"),
        ((B, A), "filter 1 of controller 0 .* an array is sections"),
        (signal.dlti(*(np.eye(3),) * 4, dt=PERIOD), "3 inputs and 3 outputs; both joints'"),
        (signal.dlti(*(np.eye(2),) * 4, dt=1.0), "the loop's 0.001"),
        (7, "of type int"),
    ],
)
def test_a_controller_of_both_joints_that_is_none_is_refused(given: Any, said: str) -> None:
    with pytest.raises(ParameterError, match=said) as refused:
        stack([given], PERIOD)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("none", [[], None, 3])
def test_no_controllers_are_refused(none: Any) -> None:
    with pytest.raises(ParameterError, match="one controller or more"):
        stack(none, PERIOD)
