"""What intervals, whiteness, decays and what cannot be told rest on: each by a known answer."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats
from scipy.signal import lfilter

from flexsim import ParameterError, Parameters, Robot, setting
from flexsim.arm.free_arm import clamped_frequencies, joint_free_frequencies
from flexsim.plants.chain_plant import ClosedChainPlant
from studies.identify.chains import ChainFamily
from studies.identify.decay.pencil import decay
from studies.identify.friction_names import FRICTION, friction_number, with_friction
from studies.identify.intervals import Counted, bandwidth, long_run, spread_of, whiteness
from studies.identify.names import free_numbers, robot_with
from studies.identify.records import counts_of, noise_of, read_record
from studies.identify.telling import told_by
from studies.main import main
from studies.tools.logs import LogOptions

FREQUENCY = 1e-3  # relative, promised of decays
ROUNDING = 1e-11


def test_a_changed_chain_is_that_of_its_own_file() -> None:
    values = {"EI": 0.4, "zeta": 2e-3, "rho": 0.17, "I_R0": 0.3, "I_H": 1e-3, "m_H": 0.5}
    values |= {"I_m1": 0.01, "I_m2": 0.002, "payload": 0.03, "payload_inertia": 1e-4}
    values |= {"F_1": 1e-3, "F_2": 2e-3}
    none = setting("none")
    ours = ChainFamily(Robot(), "closed-chain", none, 1e-3).plant(values).coefficients
    other = robot_with(Robot(), values).plant("closed-chain", none, chain_step=1e-3)
    assert isinstance(other, ClosedChainPlant)
    for name, mine, its in zip(ours._fields, ours, other.coefficients, strict=True):
        assert np.allclose(mine, its, rtol=ROUNDING, atol=ROUNDING), name


@pytest.mark.parametrize("noise", [0.0, 1e-4])
def test_frequencies_of_a_clamped_decay(noise: float) -> None:
    p = Parameters()
    omega, ratio = clamped_frequencies(p, 2), p.eta * clamped_frequencies(p, 2) / 2
    time = 1e-3 * np.arange(3000)
    s = omega * (-ratio + 1j * np.sqrt(1 - ratio**2))
    v = np.exp(np.outer(time, s)).real @ [0.01, 0.002]
    found = decay(v + noise * np.random.default_rng(1).standard_normal(3000), 1e-3, 2)
    assert found.frequency == pytest.approx(omega, rel=FREQUENCY if noise else 1e-9)
    assert found.ratio == pytest.approx(ratio, rel=0.1 if noise else 1e-6)
    if noise:
        assert np.all(np.abs(found.frequency - omega) < 2 * found.frequency_half)
        assert np.all(found.frequency_half < FREQUENCY * omega)


def test_frequencies_of_a_free_arm_after_a_push(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Joint-free, straight: the closed form's, within what is promised."""
    rows = [f"{k / 1000:.3f},0,{0.1 if k < 20 else 0}" for k in range(2500)]
    (tmp_path / "tau.csv").write_text("\n".join(["t,tau1,tau2", *rows, ""]))
    log = tmp_path / "log.csv"
    words = ["drive", "--torque", str(tmp_path / "tau.csv"), "--out", str(log)]
    assert main([*words, "--plant", "assumed-modes:5"]) == 0
    capsys.readouterr()
    words = ["identify", str(log), "--method", "decay", "--modes", "2", "--begin", "0.1", "--json"]
    assert main(words) == 0
    shown = json.loads(capsys.readouterr().out)["estimates"]
    exact = joint_free_frequencies(Parameters(), 2) / (2 * math.pi)
    found = [shown[f"frequency_{i}"]["value"] for i in (1, 2)]
    assert found == pytest.approx(exact, rel=FREQUENCY)
    assert main([*words, "--free", "EI"]) == 2
    assert "--free has no effect with --method decay" in capsys.readouterr().err


def test_a_decay_that_has_no_modes_is_refused() -> None:
    with pytest.raises(ParameterError, match="is still"):
        decay(np.zeros(500), 1e-3, 1)
    with pytest.raises(ParameterError, match="has 10 rows"):
        decay(np.arange(10.0), 1e-3, 1)


def test_whiteness_has_the_size_it_says_and_sees_what_is_not() -> None:
    rng = np.random.default_rng(1)
    p = [whiteness(rng.standard_normal(400)) for _ in range(300)]
    assert stats.kstest(p, "uniform").pvalue > 1e-3
    x = rng.standard_normal(400)
    assert whiteness(x[1:] + 0.5 * x[:-1]) < 1e-4


def test_the_long_run_variance_of_a_first_order_process() -> None:
    """sigma^2/(1 - rho)^2, within what 200,000 rows leave; white ones need no lags."""
    rng, rho, rows = np.random.default_rng(2), 0.8, 200_000
    e = rng.standard_normal(rows)
    x = lfilter([1.0], [1.0, -rho], e)[:, None]
    lags = bandwidth([x])
    assert long_run(x, lags)[0, 0] / rows == pytest.approx(1 / (1 - rho) ** 2, rel=0.1)
    assert bandwidth([e[:, None]]) < 5 < lags


@pytest.mark.parametrize("rho", [0.0, 0.9])
def test_intervals_cover_a_mean_in_coloured_noise(rho: float) -> None:
    rng, inside, draws = np.random.default_rng(3), 0, 200
    for _ in range(draws):
        x = lfilter([1.0], [1.0, -rho], rng.standard_normal(3000))[1000:]
        left = (x - x.mean())[:, None]
        spread = spread_of([left], [np.ones((2000, 1, 1))])
        inside += abs(x.mean()) < spread.half[0]
    assert inside >= 0.88 * draws


def test_intervals_cover_what_is_counted() -> None:
    """A joint that swings by five counts: its residuals do not show how far off its size may be."""
    rng, count, draws, t = np.random.default_rng(7), 1e-3, 200, np.linspace(0, 1, 4000)
    slopes = np.column_stack([np.sin(2.6 * np.pi * t) + 0.3 * t, np.ones_like(t)])
    inside = {"as counts": 0, "as any residuals": 0}
    for _ in range(draws):
        true, phase = np.array([5 * count * rng.uniform(0.8, 1.2), 0.0]), count * rng.uniform()
        y = count * np.round((slopes @ true + phase) / count) - phase
        z = np.linalg.lstsq(slopes, y, rcond=None)[0]
        left = y - slopes @ z
        noise = left.std()
        own = Counted((slopes @ z)[:, None], np.array([count]), np.array([noise]))
        for name, counted in (("as counts", [own]), ("as any residuals", [])):
            spread = spread_of([left[:, None] / noise], [slopes[:, None] / noise], counted)
            inside[name] += abs(z[0] - true[0]) < spread.half[0]
    assert inside["as any residuals"] < 0.88 * draws < 0.93 * draws < inside["as counts"]


def test_what_acts_together_is_named_and_what_moves_nothing() -> None:
    rng = np.random.default_rng(4)
    one, other = rng.standard_normal((2, 1000))
    columns = np.column_stack([one, -2 * one, other, 1e-9 * one])
    told = told_by(["a", "b", "c", "d"], 100 * columns)
    assert told.silent == ("d",)
    assert [{name for name, _ in group} for group in told.groups] == [{"a", "b"}]
    (a, b) = (shift for _, shift in told.groups[0])
    assert a / b == pytest.approx(2.0)  # twice as much of a undoes b
    assert told_by(["c"], other[:, None]).alone[0] == pytest.approx(1 / np.linalg.norm(other))
    hidden = told_by(["c"], np.column_stack([other, other]))  # by where the log starts
    assert hidden.silent == ("c",)


@pytest.mark.parametrize("law", ["simulink", "opposing", "stribeck", "lugre"])
def test_names_reach_every_number_of_a_law(law: str) -> None:
    chosen = setting(law)
    own = [name for name, place in FRICTION.items() if law in place.laws]
    free = free_numbers(",".join(own), Robot(), chosen)
    assert [each.value(0.0) for each in free] == [each.nominal for each in free]
    values = {each.name: each.value(0.5) for each in free}
    changed = with_friction(chosen, values)
    assert {name: friction_number(changed, name) for name in values} == pytest.approx(values)
    kept = [name for name in FRICTION if name not in values]
    assert all(friction_number(changed, name) == friction_number(chosen, name) for name in kept)
    for each in free:
        assert each.coordinate(each.value(0.3)) == pytest.approx(0.3), each.name
        assert friction_number(chosen, each.name) == each.nominal, each.name


def test_a_name_without_a_joint_is_that_of_both() -> None:
    free = free_numbers("friction.stiction,friction.dead_zone", Robot(), setting("stribeck"))
    ends = [f"friction.dead_zone_{i}_{end}" for i in (1, 2) for end in ("low", "high")]
    assert [each.name for each in free] == ["friction.stiction_1", "friction.stiction_2", *ends]


def test_intervals_end_where_a_number_can_be_no_less() -> None:
    (payload,) = free_numbers("payload", Robot(), setting("none"))
    assert payload.scale is not None and payload.bounded
    assert payload.interval(0.1, 5.0)[0] == 0.0
    (stiction, _) = free_numbers("friction.stiction", Robot(), setting("stribeck"))
    assert stiction.interval(0.0, 50.0) == pytest.approx((1.0, 6.5))
    (offset,) = free_numbers("offset.v", Robot(), setting("none"))
    assert offset.interval(0.0, 5.0) == pytest.approx((-5e-3, 5e-3))


def write(path: Path, header: str, rows: Any) -> Path:
    lines = [",".join(f"{cell!r}" for cell in row) for row in np.asarray(rows).tolist()]
    path.write_text("\n".join([header, *lines, ""]))
    return path


def test_a_laboratorys_log_is_read_at_its_own_stamps(tmp_path: Path) -> None:
    """Torque every 4 ms is held, angles every 5 ms are not; an empty cell counts for nothing."""
    k = np.arange(100.0)
    torque = write(tmp_path / "tau.csv", "t,tau1,tau2", np.column_stack([0.004 * k, k, -k]))
    log = tmp_path / "log.csv"
    rows = [f"{5 * i},{i},{2 * i},{'' if i == 7 else 0.1 * i}" for i in range(80)]
    log.write_text("\n".join(["Time,A,B,C", *rows, ""]))
    names = LogOptions(columns="t=Time,theta1=A,theta2=B,v=C", time_unit="ms")
    other = LogOptions(columns="t=t,theta1=A,theta2=B,v=C")
    with pytest.raises(ParameterError, match="no column is called 'Time'"):
        read_record(log, torque, names)
    text = torque.read_text().replace("t,tau1", "Time,tau1")
    lines = [text.splitlines()[0]] + [f"{4 * i},{i},{-i}" for i in range(100)]
    torque.write_text("\n".join([*lines, ""]))
    record = read_record(log, torque, names)
    assert record.torque[:9, 0].tolist() == [0, 0, 0, 0, 1, 1, 1, 1, 2]
    assert record.time[:3].tolist() == pytest.approx([0.0, 0.005, 0.01])
    assert np.isnan(record.values[7, 2]) and np.isfinite(record.values).sum() == 239
    assert other.columns is not None


def test_noise_is_seen_through_a_motion(tmp_path: Path) -> None:
    rng, time = np.random.default_rng(5), 1e-3 * np.arange(2000)
    count = 2 * math.pi / 8192
    theta = count * np.round(np.sin(2 * time) / count)
    v = 0.01 * np.sin(20 * time) + 1e-4 * rng.standard_normal(2000)
    zero = np.zeros(2000)
    columns = np.column_stack([time, zero, zero, theta, theta, v])
    path = write(tmp_path / "log.csv", "t,tau1,tau2,theta1,theta2,v", columns)
    record = read_record(path, None, LogOptions())
    found = noise_of(record)
    assert found[2] == pytest.approx(1e-4, rel=0.1)
    assert count / 12 < found[0] < count
    assert counts_of(record) == pytest.approx([count, count, 0.0], rel=1e-9)
    noisy = replace(record, values=record.values + 1e-3 * rng.standard_normal((2000, 3)))
    assert not counts_of(noisy).any()
