"""A laboratory's log: what is read of it, held over, resampled and said, and what is refused."""

from __future__ import annotations

import json
import time
from decimal import Decimal
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexsim import ParameterError, RunError
from flexsim.files.reading import MIB
from studies.core.folder import to_json
from studies.tools.held_log import ROWS_MOST, STAMP_TOLERANCE, Log
from studies.tools.log_table import LINE_MOST
from studies.tools.logs import GAP_INTERVALS, LogOptions, read_log

HEADER = "t,tau1,tau2\n"
NAMED = "t=Time,tau1=Torque 1,tau2=Torque 2"
MICROSECOND = 1e-6


def written(folder: Path, text: str) -> Path:
    path = folder / "log.csv"
    path.write_bytes(text.encode())
    return path


def read(folder: Path, text: str, **options: Any) -> Log:
    return read_log(written(folder, text), LogOptions(**options))


def rows(*cells: str) -> str:
    return HEADER + "".join(f"{row}\n" for row in cells)


def refusal(folder: Path, text: str, **options: Any) -> str:
    with pytest.raises((ParameterError, RunError)) as caught:
        read(folder, text, **options).resampled(options.get("period", 1e-3))
    return str(caught.value)


def grid(n: int, start: str = "0", end: str = "") -> str:
    """Return a log of n rows of 1 ms, torque k in row k, its stamps after `start` as written."""
    return rows(*(f"{start}.{k:03d}{end},{k},{-k}" for k in range(n)))


def test_a_log_on_the_grid_is_taken_as_it_is(tmp_path: Path) -> None:
    log = read(tmp_path, grid(7))
    np.testing.assert_array_equal(log.resampled(), [[k, -k] for k in range(7)])
    assert not log.done()["resampled"] and log.jitter == pytest.approx(0, abs=1e-15)
    assert log.words() == (
        f"{tmp_path}/log.csv: 7 rows every 1 ms from t = 0 s; taken as they are",
    )


@pytest.mark.parametrize("second", ["0.0009991", "0.0010009"])
def test_stamps_rounded_to_microseconds_are_on_the_grid(tmp_path: Path, second: str) -> None:
    log = read(tmp_path, rows("0,0,0", f"{second},1,0"))
    assert log.resampled().tolist() == [[0, 0], [1, 0]] and not log.done()["resampled"]


def test_stamps_further_off_are_not(tmp_path: Path) -> None:
    log = read(tmp_path, rows("0,0,0", "0.0010011,1,0", "0.0020011,2,0"))
    assert log.resampled()[:, 0].tolist() == [0, 0, 1] and log.done()["resampled"]


@pytest.mark.parametrize(
    ("text", "options"),
    [
        ("t;tau1;tau2\n0;0.5;-1\n0.001;2;3\n", {}),
        ("t\ttau1\ttau2\n0\t0.5\t-1\n0.001\t2\t3\n", {}),
        ("t;tau1;tau2\n0;0,5;-1\n0,001;2,0;3\n", {}),
        ('t,tau1,tau2\n0,"0,5",-1\n"0,001",2,3\n', {}),
        ('"t","tau1" , tau2\n0, .5,-1.\n1e-3,2E0,+3\n', {}),
        ("\ufefft,tau1,tau2\r\n0,0.5,-1\r\n0.001,2,3\r\n", {}),
        ("\n t,tau1,tau2\n\n0,0.5,-1\n\n0.001,2,3\n\n", {}),
        ("tau2,note,t,tau1\n-1,a,0,0.5\n3,b,0.001,2\n", {}),
        ("t,tau1,tau2,\n0,0.5,-1,\n0.001,2,3,\n", {}),
        ("t,tau1,tau2\n0,0.5,-1,\n0.001,2,3,,\n", {}),
        ("Time;Torque 1;Torque 2\n0;0,5;-1\n0,001;2;3\n", {"columns": NAMED}),
        (
            'Time,"Torque, 1",tau2\n0,0.5,-1\n0.001,2,3\n',
            {"columns": "t=Time,tau1=Torque, 1"},
        ),
        ("a=b,tau1,tau2\n0,0.5,-1\n0.001,2,3\n", {"columns": "t=a=b"}),
        ("t,tau1,tau2\n5,0.5,-1\n6,2,3\n", {"time_unit": "ms"}),
        ("t,tau1,tau2\n1700000000000000,0.5,-1\n1700000000001000,2,3\n", {"time_unit": "us"}),
        ("t,tau1,tau2\n1700000000123456789,0.5,-1\n1700000000124456789,2,3\n", {"time_unit": "ns"}),
        ("t,tau1,tau2\n-0.0005,0.5,-1\n0.0005,2,3\n", {}),
    ],
)
def test_what_loggers_and_spreadsheets_write_is_read(
    text: str, options: dict[str, Any], tmp_path: Path
) -> None:
    log = read(tmp_path, text, **options)
    assert log.resampled().tolist() == [[0.5, -1.0], [2.0, 3.0]]
    assert not log.done()["resampled"]


def test_stamps_since_1970_lose_nothing(tmp_path: Path) -> None:
    """A double of seconds since 1970 has a quarter of a microsecond; decimals have all."""
    stamps = [
        f"1700000000.{1000 * k + 37 * (k % 3):09d}" for k in range(50)
    ]  # 1 us and nanoseconds
    log = read(tmp_path, rows(*(f"{stamp},{k},0" for k, stamp in enumerate(stamps))))
    wanted = [(1000 * k + 37 * (k % 3)) * 1e-9 for k in range(50)]
    np.testing.assert_allclose(log.time, wanted, rtol=1e-15)
    found = log.resampled(MICROSECOND)
    np.testing.assert_array_equal(found[:, 0], [k if k % 3 == 0 else k - 1 for k in range(50)])


def test_a_slow_log_is_held(tmp_path: Path) -> None:
    log = read(tmp_path, rows("10,1,0", "10.004,2,0", "10.008,3,5"))
    assert log.resampled()[:, 0].tolist() == [1] * 4 + [2] * 4 + [3]
    assert log.resampled(2e-3)[:, 0].tolist() == [1, 1, 2, 2, 3]
    assert "resampled to 9 of 1 ms by a zero-order hold" in log.words()[0]
    assert log.start == 10.0 and log.done()["duration"] == 0.008


def test_a_fast_log_is_sampled_at_the_instants_and_said(tmp_path: Path) -> None:
    """The last sample up to an instant, not a mean over the period."""
    log = read(tmp_path, rows(*(f"{k * 0.00025:.5f},{k},0" for k in range(9))))
    assert log.resampled()[:, 0].tolist() == [0, 4, 8]
    line, note = log.words()
    assert note == (
        "Note: the log is faster than 1 ms: 6 rows between its instants are passed over"
    )
    assert log.done()["rows_passed_over"] == 6 and "every 0.25 ms" in line


@given(
    intervals=st.lists(st.integers(1, 5_000), min_size=1, max_size=60),
    torques=st.lists(st.floats(-100, 100), min_size=61, max_size=61),
    start=st.sampled_from(["0", "-3.25", "12.5", "1700000000.123457"]),
    period=st.sampled_from([1e-3, 5e-4, 2.5e-3]),
)
def test_a_held_signal_is_itself_at_every_instant(
    intervals: list[int],
    torques: list[float],
    start: str,
    period: float,
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    """A piecewise-constant signal, sampled where it changes, at any jittered stamps [us]."""
    after = np.concatenate([[0], np.cumsum(intervals)])
    every = round(period * 1e6)  # [us]
    tolerated = STAMP_TOLERANCE * every
    lines = [
        f"{Decimal(start) + Decimal(int(t)) / 1_000_000},{tau!r},{-tau!r}"
        for t, tau in zip(after, torques, strict=False)
    ]
    folder = tmp_path_factory.mktemp("held")
    log = read(folder, rows(*lines), gap=1.0)
    found = log.resampled(period)
    # by the definition, in whole microseconds: which sample is the last up to k periods
    instants = range(int((after[-1] + tolerated) // every) + 1)
    wanted = [
        max((k for k, t in enumerate(after) if t <= instant * every + tolerated), default=-1)
        for instant in instants
    ]
    np.testing.assert_array_equal(found[:, 0], np.array(torques)[wanted])
    np.testing.assert_array_equal(found[:, 1], -np.array(torques)[wanted])
    assert log.done(period)["rows_resampled"] == len(wanted)


def test_missing_samples_are_held_and_counted(tmp_path: Path) -> None:
    keep = [k for k in range(40) if k not in (5, 20, 21, 22)]
    log = read(tmp_path, rows(*(f"{k / 1000},{k},{2 * k}" for k in keep)))
    wanted = [max(j for j in keep if j <= k) for k in range(40)]
    np.testing.assert_array_equal(log.resampled()[:, 0], wanted)
    np.testing.assert_array_equal(log.resampled()[:, 1], 2 * np.array(wanted))
    assert "2 gaps held over, 4 samples, the longest 4 ms" in log.words()[0]
    done = log.done()
    assert (done["gaps"], done["filled"]) == (2, 4)
    assert done["longest_gap"] == pytest.approx(4e-3) and done["resampled"]


def test_empty_cells_hold_their_own_signal(tmp_path: Path) -> None:
    log = read(tmp_path, rows("0,1,10", "0.001,,11", "0.002,NaN,", "0.003,4,nan", "0.004,5,"))
    assert log.resampled().tolist() == [[1, 10], [1, 11], [1, 11], [4, 11], [5, 11]]
    assert "5 empty cells held over" in log.words()[0]
    assert log.done()["empty_cells"] == 5


def test_rows_before_the_first_sample_and_without_a_stamp_are_left_out(tmp_path: Path) -> None:
    text = rows("0,,1", "0.001,5,", ",9,9", "0.002,6,3")
    log = read(tmp_path, text)
    assert log.resampled().tolist() == [[5, 1], [6, 3]] and log.start == 0.001
    assert "1 without a stamp left out; 1 before the first sample" in log.words()[0]


def test_gaps_beyond_the_bound_are_refused_with_what_would_do(tmp_path: Path) -> None:
    """By default ten median intervals; what the message says does."""
    few, many = (rows(*(f"{k / 1000},1,0" for k in (0, 1, 2, 2 + n, 3 + n))) for n in (10, 11))
    assert read(tmp_path, few).done()["longest_gap"] == pytest.approx(GAP_INTERVALS * 1e-3)
    said = refusal(tmp_path, many)
    assert "line 5: 0.011 s without a sample of 'tau1', more than the 0.01 s" in said
    assert "10 median intervals; --gap 0.011 would hold it over all" in said
    assert len(read(tmp_path, many, gap=0.011).resampled()) == 15
    assert "line 5" in refusal(tmp_path, few, gap=0.009)


def test_gaps_of_empty_cells_are_gaps(tmp_path: Path) -> None:
    text = rows("0,1,1", *(f"{k / 1000},1," for k in range(1, 12)), "0.012,1,1", "0.013,1,1")
    said = refusal(tmp_path, text)
    assert "line 14: 0.012 s without a sample of 'tau2'" in said
    assert read(tmp_path, text, gap=0.012).resampled()[:, 1].tolist() == [1] * 14
    until_the_end = rows("0,1,1", *(f"{k / 1000},1," for k in range(1, 13)))
    assert "line 14" in refusal(tmp_path, until_the_end)


def test_what_was_done_is_said_on_one_line(tmp_path: Path) -> None:
    text = "Time;Temp\x1b[31m;Torque 1;Torque 2\n" + "".join(
        f"1700000000,{4 * k:03d};20;{k};0\n" for k in range(20) if k != 7
    )
    log = read(tmp_path, text, columns=NAMED)
    (line,) = log.words()
    assert line == (
        f"{tmp_path}/log.csv: 19 rows every 4 ms from t = 1700000000 s; semicolons, decimal "
        "commas; 1 gap held over, 1 sample, the longest 8 ms; columns left out: Temp\\x1b[31m; "
        "resampled to 77 of 1 ms by a zero-order hold"
    )
    done = json.loads(to_json(log.done()))
    assert done["ignored_columns"] == ["Temp\x1b[31m"] and done["start"] == 1.7e9
    assert (done["rows"], done["rows_resampled"], done["decimal_comma"]) == (19, 77, True)


def test_stamps_that_look_like_other_units_are_noted(tmp_path: Path) -> None:
    log = read(tmp_path, rows("0,1,1", "1,2,2", "2,3,3"))
    assert log.words()[1] == "Note: stamps are taken for seconds; others need --time-unit"
    assert len(read(tmp_path, rows("0,1,1", "1,2,2"), time_unit="ms").words()) == 1


def test_other_signals_than_torques_can_be_asked_for(tmp_path: Path) -> None:
    path = written(tmp_path, "t,tau1,tau2,Angle\n0,1,2,3\n0.001,4,5,6\n")
    log = read_log(path, LogOptions(columns="theta1=Angle"), ("tau1", "theta1"))
    assert log.values.tolist() == [[1, 3], [4, 6]]
    assert log.table.ignored == ("tau2",)


def test_a_single_row_is_a_log(tmp_path: Path) -> None:
    log = read(tmp_path, rows("3,1,2"))
    assert log.resampled().tolist() == [[1, 2]] and log.interval is None
    assert log.words()[0].endswith("1 rows from t = 3 s; taken as they are")


@pytest.mark.parametrize(
    ("text", "options", "words"),
    [
        ("", {}, ("is empty", "t,tau1,tau2")),
        ("\n\n", {}, ("is empty",)),
        ("0,0,0\n0.001,0,0\n", {}, ("no column is called 't'; the first line has '0', '0', '0'",)),
        (HEADER, {}, ("has no rows", "at least one")),
        ("Time,Torque 1,Torque 2\n0,0,0\n", {}, ("'Torque 1'", "--columns, perhaps 't=Time'")),
        ("t,Torque 1,Torque 2\n0,0,0\n", {}, ("perhaps 'tau1=Torque 1'",)),
        ("Time,a,b\n0,0,0\n", {"columns": "t=Tine"}, ("'Tine', which is to be t", "'t=Time'")),
        ("t,tau1,tau1,tau2\n0,1,2,3\n", {}, ("2 columns are called 'tau1'",)),
        (HEADER, {"columns": "tau3=a"}, ("--columns has 'tau3=a'; give t=NAME,tau1=NAME",)),
        (HEADER, {"columns": "Time"}, ("--columns has 'Time'",)),
        (HEADER, {"columns": "t="}, ("--columns has 't='",)),
        (HEADER, {"columns": ""}, ("--columns has ''",)),
        (HEADER, {"columns": "t=a,t=b"}, ("names t twice",)),
        (HEADER, {"columns": "tau1=a,tau2=a"}, ("takes 'a' for tau1 and tau2",)),
        (HEADER, {"columns": "tau1=t"}, ("takes 't' for t and tau1",)),
        (rows("0,0"), {}, ("line 2", "'0,0' has 2 cells, the first line 3")),
        (rows("0,0,0,0"), {}, ("'0,0,0,0' has 4 cells", "semicolons")),
        (rows("0,001,0,5,0,1"), {}, ("decimal commas need semicolons",)),
        (rows("0,0,0", "0.001,x,0"), {}, ("line 3: 'x' in column 'tau1' is not a finite",)),
        (rows("0,-inf,0"), {}, ("line 2: '-inf'",)),
        (rows("0,1e400,0"), {}, ("line 2: '1e400'",)),
        (rows("0,1_0,0"), {}, ("'1_0'",)),
        (rows("0,0x10,0"), {}, ("'0x10'",)),
        (rows("0,\u0663,0"), {}, ("is not a finite number",)),
        (rows("inf,0,0"), {}, ("'inf' in column 't'",)),
        (rows("1e999,0,0"), {}, ("column 't' is not a finite",)),
        (rows("0,0,0", "1e9999,0,0"), {}, ("column 't' is not a finite",)),
        (rows("0,0,0", "1e99999,0,0"), {}, ("'1e99999'",)),
        (rows("2026-01-02T03:04:05,0,0"), {}, ("line 2", "dates are not read")),
        (rows("0,0,0", "0,0,0"), {}, ("line 3: t = 0 is not after 0 of line 2",)),
        (rows("0,0,0", "0.2,0,0", ",,", "0.1,0,0"), {}, ("line 5: t = 0.1 is not after 0.2",)),
        (rows("1700000000.0000001,0,0", "1700000000.0000001,0,0"), {}, ("line 3", "must rise")),
        (rows("0,,0", "1,,0"), {}, ("column 'tau1' is empty",)),
        ("t;tau1;tau2\n0;0,5;1.5\n", {}, ("line 2: '1.5' has the decimal mark '.'", "line 2")),
        ("t;tau1;tau2\n0,1;0;1\n0.2;0;1\n", {}, ("line 3: '0.2'", "line 2 has ','")),
        ("t;tau1;tau2\n0;1.234,5;1\n", {}, ("'1.234,5' in column 'tau1' is not",)),
        (rows("0,0,0"), {"gap": 0.0}, ("--gap is 0.0 s",)),
        (rows("0,0,0"), {"gap": float("inf")}, ("--gap is inf s; give a finite number",)),
        (rows("0,0,0"), {"period": float("nan")}, ("--period is nan",)),
        (rows("0,0,0"), {"period": -1.0}, ("--period is -1.0",)),
        (rows("0,0,0", "1e9,0,0"), {}, ("1e+09 s apart", "2,000,000 rows", "--time-unit")),
        (rows("0,0,0", "1e300,0,0"), {}, ("1e+300 s apart",)),
        (rows("0,0,0", "1,0,0"), {"period": 1e-300}, ("rows of 1e-300 s",)),
        (rows('"0'), {}, ("line 2",)),
        ("\x00" * 5000, {}, ("no column is called 't'", "...")),
        (HEADER + '"' + "x" * 200_000 + '"\n', {}, ("not a CSV file: line 2 has more than",)),
        ("x" * (LINE_MOST + 1), {}, ("not a CSV file: line 1",)),
        ("t," * 40_000 + "\n0\n", {}, ("40000 columns are called 't'", "and 39981 more")),
    ],
)
def test_what_cannot_be_read_is_refused(
    text: str, options: dict[str, Any], words: tuple[str, ...], tmp_path: Path
) -> None:
    said = refusal(tmp_path, text, **options)
    assert all(word in said for word in words), said
    assert len(said) < 2000


CELLS = st.text("0123456789.,;\t\"'eE+-_nainf t\x00\r", max_size=12)


@given(
    lines=st.lists(st.lists(CELLS, max_size=4), max_size=8),
    header=st.sampled_from(
        ["t,tau1,tau2", "t;tau1;tau2", "t\ttau1\ttau2", "", '"t', "tau2,t,tau1"]
    ),
)
def test_whatever_the_text_it_is_a_log_or_one_of_our_errors(
    lines: list[list[str]], header: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    text = "\n".join([header, *(("," if "," in header else ";").join(line) for line in lines)])
    try:
        log = read(tmp_path_factory.mktemp("any"), text)
        torque = log.resampled()
    except (ParameterError, RunError) as error:
        assert len(str(error)) < 2000
        return
    assert np.isfinite(torque).all() and log.words() and log.done()["rows"] == len(log.time)


def test_the_largest_file_is_read_or_refused_in_seconds(tmp_path: Path) -> None:
    """As many rows as a file may have, in as few bytes: more than may be resampled."""
    row = b"%d,,\n"
    body = b"".join(row % k for k in range(1_500_000))
    path = tmp_path / "log.csv"
    path.write_bytes(HEADER.encode() + b"0,1,1\n" + body[len(row % 0) :])
    begun = time.monotonic()
    with pytest.raises(ParameterError, match="more than"):
        read_log(path, LogOptions(time_unit="us", gap=1e9, period=1e-7)).resampled(1e-7)
    assert time.monotonic() - begun < 60
    path.write_bytes(bytes(64 * MIB + 1))
    with pytest.raises(RunError, match="more than 67,108,864 bytes"):
        read_log(path)
    assert ROWS_MOST <= 2_000_000


def test_rows_are_in_the_order_of_the_clock(tmp_path: Path) -> None:
    """Nothing is looked up ahead of time: no instant has a sample from after it."""
    rng = np.random.default_rng(4)
    stamps = np.cumsum(rng.uniform(0.3e-3, 3e-3, 400))
    log = read(tmp_path, rows(*(f"{t:.9f},{k},0" for k, t in enumerate(stamps))))
    held = log.resampled()[:, 0].astype(int)
    instants = log.time[0] + 1e-3 * np.arange(len(held))
    assert (log.time[held] <= instants + STAMP_TOLERANCE * 1e-3).all()
    assert (log.time[np.minimum(held + 1, 399)] > instants)[held < 399].all()
    assert all(one <= two for one, two in pairwise(held))
