"""Bands: least and largest of runs that went on to their end, in figures and recordings."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from recorded_cases import STEP, made_up_cases, made_up_motion
from rerun.chunk import RrdReader

from flexsim import Parameters
from flexsim.loop.motion import Motion
from flexsim.recording.band import PATHS, Band, covered, pair_band
from flexsim.recording.case import Case
from flexsim.recording.curves import BAND, columns, of_band, panels
from flexsim.recording.drawn.arms import FRAME, frames
from flexsim.recording.drawn.map import sheet_of
from flexsim.recording.rrd import write_recording
from flexsim.recording.scene import remarks
from flexsim.recording.texts import notes
from studies.compare.figures import case_figure

RUNS, ROWS = 3, 40


def runs(count: int = RUNS) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(1)
    time = STEP * np.arange(ROWS)
    return (
        time,
        rng.normal(size=(count, ROWS, 2)),
        rng.normal(size=(count, ROWS)),
        rng.normal(size=(count, ROWS, 2)),
        np.ones((ROWS, 2)),
    )


def banded(case: Case) -> Case:
    motion = case.motions["chain"]
    tip, v = (np.stack([each - 1e-3, each + 2e-3]) for each in (motion.tip, motion.v))
    torque = np.stack([motion.torque - 0.1, motion.torque + 0.2])
    band = covered(None, motion.time, tip, v, torque, motion.reference_tip)
    assert band is not None
    return replace(case, bands={"chain": band}, shown={"chain": "run 1 of 2, the median"})


def test_a_band_is_what_all_runs_cover() -> None:
    time, tip, v, torque, ref = runs()
    band = covered(None, time, tip, v, torque, ref)
    assert band is not None and band.runs == RUNS
    assert np.array_equal(band.v, [v.min(axis=0), v.max(axis=0)])
    assert np.array_equal(band.tip, [tip.min(axis=0), tip.max(axis=0)])
    error = np.linalg.norm(tip - ref, axis=2)
    assert band.error == pytest.approx(np.stack([error.min(axis=0), error.max(axis=0)]), rel=1e-14)
    assert np.array_equal(band.paths, tip)


def test_batches_make_the_same_band() -> None:
    time, tip, v, torque, ref = runs(PATHS + 5)
    whole = covered(None, time, tip, v, torque, ref)
    parts: Band | None = None
    for some in (slice(0, 7), slice(7, PATHS + 2), slice(PATHS + 2, None)):
        parts = covered(parts, time, tip[some], v[some], torque[some], ref)
    assert whole is not None and parts is not None
    for name, each in vars(whole).items():
        assert np.array_equal(getattr(parts, name), each), name
    assert len(parts.paths) == PATHS


def test_diverged_runs_are_not_in_a_band() -> None:
    time, tip, v, torque, ref = runs()
    tip[1, 20:], v[1, 20:] = np.nan, np.nan
    tip[1, :20], v[1, :20] = 99.0, 99.0
    band = covered(None, time, tip, v, torque, ref)
    assert band is not None and band.runs == RUNS - 1
    assert band.v.max() < 99.0 and np.isfinite(band.error).all()
    assert covered(None, time, tip[1:2], v[1:2], torque[1:2], ref) is None
    assert covered(band, time, tip[1:2], v[1:2], torque[1:2], ref) is band


def test_a_figure_shades_the_band_and_says_which_run() -> None:
    case = banded(made_up_cases()[0])
    figure = case_figure(case)
    axes = {each.get_label(): each for each in figure.axes}
    motion = case.motions["chain"]
    for name, mean, less, more in (
        ("tau1", motion.torque[:, 0], 0.1, 0.2),
        ("v", 1e3 * motion.v, 1.0, 2.0),
    ):
        (shade,) = axes[name].collections
        corners = shade.get_paths()[0].vertices
        assert corners[:, 1].max() == pytest.approx(mean.max() + more)
        assert corners[:, 1].min() == pytest.approx(mean.min() - less)
    for name in ("along", "across", "tau2"):
        assert len(axes[name].collections) == 1, name
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert {"chain", "pale: all runs", "assumed modes"} <= set(labels)
    assert "chain: run 1 of 2, the median" in figure.get_label()
    assert len([line for line in axes["path"].lines if line.get_rasterized()]) == 2


def test_pairs_are_differences_run_by_run() -> None:
    """Along x and across it of three pairs; none without a pair."""
    time = STEP * np.arange(ROWS)
    ref = np.stack([time, np.zeros(ROWS)], axis=1)
    differences = np.stack([np.full((ROWS, 2), each) for each in ([3.0, 0.0], [1.0, 2.0], [2, -1])])
    pairs = pair_band(time, differences, ref)
    assert pairs is not None and pairs.runs == 3
    assert np.allclose(pairs.along[:, 5], [1.0, 1.5, 2.0, 2.5, 3.0])
    assert np.allclose(pairs.across[:, 5], [-1.0, -0.5, 0.0, 1.0, 2.0])
    assert pair_band(time, differences[:0], ref) is None


def test_a_recording_has_the_band_beside_the_curve() -> None:
    case = banded(made_up_cases()[0])
    table = next(each for each in columns(case) if each.entity == BAND)
    found, motion = table.components["chain"], case.motions["chain"]
    assert found["v_mm_least"] == pytest.approx(1e3 * (motion.v - 1e-3), abs=1e-9)
    assert found["v_mm_largest"] == pytest.approx(1e3 * (motion.v + 2e-3), abs=1e-9)
    assert (found["tip_error_mm_largest"] >= found["tip_error_mm_least"]).all()
    shown = {s.field for panel in panels(case, columns(case)) for s in panel.series}
    assert {"v_mm_least", "tip_error_mm_largest"} <= shown
    said = notes(case, remarks(case, sheet_of(case, Parameters())))
    assert "| chain | run 1 of 2, the median: ran to its end" in said


def test_a_thinned_band_still_covers_all() -> None:
    """Ends of 5 ms together: the least of the least, the largest of the largest."""
    time = 1e-3 * np.arange(103)
    v = np.stack([-np.cos(90 * time) - 2, np.cos(90 * time) + 2])
    tips = np.zeros((2, 103, 2))
    band = Band(2, time, tips, v, v, v, v, tips, np.zeros((1, 103, 2)))
    times, found = of_band(band)
    assert np.array_equal(times, time[::5])
    for i, t in enumerate(times):
        inside = (time >= t) & (time < t + 0.005 - 1e-9)
        assert found["v_mm_least"][i] == pytest.approx(1e3 * v[0, inside].min())
        assert found["v_mm_largest"][i] == pytest.approx(1e3 * v[1, inside].max())


def dithered(motion: Motion, hz: float) -> Motion:
    """Return a motion at 1 kHz whose torque is a tone."""
    time = 1e-3 * np.arange(motion.time.size)
    tone = np.sin(2 * np.pi * hz * time)
    return replace(motion, time=time, torque=np.stack([tone, tone], axis=1))


def test_a_dither_is_recorded_at_its_own_frequency(tmp_path: Path) -> None:
    """Every 5th sample of 250 Hz at 1 kHz would be 50 Hz; only poses are thinned."""
    motion = dithered(made_up_motion("assumed-modes"), 250.0)
    case = Case("dithered", "line", "ours", "none", {"assumed-modes": motion})
    write_recording(tmp_path / "run.rrd", [case], {}, Parameters())
    chunks = RrdReader(tmp_path / "run.rrd").store().stream().to_chunks()

    def of(path: str) -> tuple[np.ndarray, np.ndarray]:
        (chunk,) = (c for c in chunks if c.entity_path == f"/dithered/{path}" and not c.is_static)
        batch = chunk.to_record_batch()
        array = batch.column(batch.schema.names[-1])
        while hasattr(array, "flatten") and "list" in str(array.type):
            array = array.flatten()
        time = batch.column(1).to_numpy(zero_copy_only=False).astype(np.int64)
        return 1e-9 * time, array.to_numpy(zero_copy_only=False)

    (curves,) = (c for c in chunks if c.entity_path == "/dithered/curves")
    batch = curves.to_record_batch()
    time = 1e-9 * batch.column(1).to_numpy(zero_copy_only=False).astype(np.int64)
    column = batch.column("assumed_modes").flatten()
    first = column.field("torque_1_Nm").to_numpy(zero_copy_only=False)
    spectrum = np.abs(np.fft.rfft(first))
    step = float(np.diff(time).mean())
    assert np.fft.rfftfreq(len(first), step)[np.argmax(spectrum)] == pytest.approx(250.0, rel=1e-3)
    shown, _ = of("scene/assumed-modes/tip")
    assert np.diff(shown) == pytest.approx(np.full(len(shown) - 1, FRAME))


def test_frames_leave_slow_motions_as_they_are() -> None:
    slow = made_up_motion("assumed-modes").thinned(2)
    assert np.array_equal(frames(slow).time, slow.time)
    assert frames(slow.first(1)).time.size == 1
