"""Recordings: what is read back from the file is what the motions held, laid out and explained."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
import rerun as rr
from recorded_cases import BEAM_POINTS, DIVERGED, SAMPLES, made_up_cases, made_up_motion
from rerun.chunk import Chunk, RrdReader

from flexsim import ModelError, ParameterError, Parameters, RunError
from flexsim.recording import rerun_file as recording_module
from flexsim.recording.case import Case
from flexsim.recording.layout import layout
from flexsim.recording.rerun_file import RERUN_TOOL, open_recording
from flexsim.recording.rrd import _notes, write_recording
from flexsim.recording.scene import dashes
from flexsim.recording.traces import PANELS, TIMELINE, traces
from studies.tools.view import ViewConfig, command, recording_of

METADATA = {"flexsim": "0.1.0", "seed": "7"}
SINGLE = 1e-6  # rerun keeps positions in single precision, 24 bits of about 1 m


@pytest.fixture(scope="module")
def cases() -> list[Case]:
    return made_up_cases()


@pytest.fixture(scope="module")
def written(cases: list[Case], tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("run") / "run.rrd"
    write_recording(path, cases, METADATA, Parameters())
    return path


@pytest.fixture(scope="module")
def chunks(written: Path) -> list[Chunk]:
    return RrdReader(written).store().stream().to_chunks()


def rows(chunks: list[Chunk], path: str) -> dict[str, np.ndarray]:
    """Return the time [ns] and the flattened columns of an entity that changes over time."""
    (chunk,) = (c for c in chunks if c.entity_path == path and not c.is_static)
    batch = chunk.to_record_batch()

    def flat(name: str) -> np.ndarray:
        array = batch.column(name)
        while hasattr(array, "flatten") and "list" in str(array.type):
            array = array.flatten()
        return array.to_numpy(zero_copy_only=False)

    return {name.split(":")[-1]: flat(name) for name in batch.schema.names[1:]}


def static(chunks: list[Chunk], path: str) -> dict[str, list]:
    """Return the columns that an entity has once and for all."""
    found: dict[str, list] = {}
    for chunk in chunks:
        if chunk.entity_path == path and chunk.is_static:
            batch = chunk.to_record_batch()
            for name in batch.schema.names[1:]:
                found[name.split(":")[-1]] = batch.column(name)[0].as_py()
    return found


def rerun(tmp_path: Path, *arguments: str) -> int:
    """Return the status of rerun's own tool, run without touching the user's settings."""
    environment = {**os.environ, "HOME": str(tmp_path), "XDG_CONFIG_HOME": str(tmp_path)}
    tool = [*RERUN_TOOL, *arguments]
    return subprocess.run(tool, env=environment, capture_output=True, check=False).returncode


def test_everything_is_on_one_timeline(chunks: list[Chunk]) -> None:
    for chunk in chunks:
        assert chunk.timeline_names == ([] if chunk.is_static else [TIMELINE])


def test_every_panel_has_curves_of_both_plants(chunks: list[Chunk], cases: list[Case]) -> None:
    recorded = {chunk.entity_path for chunk in chunks if not chunk.is_static}
    for case in cases:
        for panel in PANELS:
            plants = [""] if panel.startswith("difference") else ["/assumed-modes", "/chain"]
            assert {f"/{case.name}/{panel}{plant}" for plant in plants} <= recorded
        assert f"/{case.name}/joint/reference" in recorded


def test_scalars_are_the_motions_own(chunks: list[Chunk], cases: list[Case]) -> None:
    motion = cases[0].motions["chain"]
    v = rows(chunks, "/line_tuned/v/chain")
    assert np.array_equal(v["scalars"], 1000 * motion.v)
    assert np.array_equal(v[TIMELINE].astype(np.int64), 10_000_000 * np.arange(SAMPLES))
    torque = rows(chunks, "/line_tuned/torque/chain")["scalars"].reshape(-1, 2)
    assert np.array_equal(torque, motion.torque)
    error = rows(chunks, "/line_tuned/tip_error/chain")["scalars"]
    assert np.allclose(error, 1000 * np.hypot(*(motion.tip - motion.reference_tip).T), rtol=1e-14)


def test_difference_is_chain_minus_assumed_modes(chunks: list[Chunk], cases: list[Case]) -> None:
    modes, chain = (cases[0].motions[plant] for plant in ("assumed-modes", "chain"))
    tip = rows(chunks, "/line_tuned/difference/tip")["scalars"].reshape(-1, 3)
    assert np.array_equal(tip[:, :2], 1000 * (chain.tip - modes.tip))
    v = rows(chunks, "/line_tuned/difference/v")["scalars"]
    assert np.array_equal(v, 1000 * (chain.v - modes.v))


@pytest.mark.parametrize("plant", ["assumed-modes", "chain"])
def test_beam_is_the_motions_own(chunks: list[Chunk], cases: list[Case], plant: str) -> None:
    strips = rows(chunks, f"/line_tuned/scene/{plant}/beam")["strips"]
    beam = strips.reshape(SAMPLES, BEAM_POINTS, 3)
    assert np.abs(beam[..., :2] - cases[0].motions[plant].beam).max() < SINGLE


def test_chain_bodies_stand_where_mujoco_puts_them(chunks: list[Chunk], cases: list[Case]) -> None:
    model, motion = cases[0].chain_model, cases[0].motions["chain"]
    assert model is not None
    data = mujoco.MjData(model)
    k = SAMPLES // 2
    data.qpos[:] = motion.state[k, : model.nq]
    mujoco.mj_kinematics(model, data)
    for body in ("link1", "hub", "segment1", "segment6"):
        pose = rows(chunks, f"/line_tuned/scene/chain/bodies/{body}")
        assert len(pose[TIMELINE]) == SAMPLES
        translation = pose["translation"].reshape(-1, 3)[k]
        assert np.abs(translation - data.body(body).xpos).max() < SINGLE
        w, *xyz = data.body(body).xquat
        assert np.abs(pose["quaternion"].reshape(-1, 4)[k] - [*xyz, w]).max() < SINGLE


def test_chain_has_its_geometry(chunks: list[Chunk]) -> None:
    drawn = {
        chunk.entity_path.split("/")[5]
        for chunk in chunks
        if "visual_geom" in str(chunk.entity_path)
    }
    assert {"link1", "hub", "segment1", "segment6"} <= drawn


def test_divergence_ends_the_curves_and_is_said(chunks: list[Chunk]) -> None:
    assert len(rows(chunks, "/line_paper/v/chain")[TIMELINE]) == DIVERGED
    assert len(rows(chunks, "/line_paper/difference/v")[TIMELINE]) == DIVERGED
    assert len(rows(chunks, "/line_paper/v/assumed-modes")[TIMELINE]) == SAMPLES
    label = static(chunks, "/line_paper/scene/chain/diverged")["labels"]
    assert label == ["chain: diverged at 1.800 s"]
    assert "diverged at t = 1.800 s" in static(chunks, "/line_paper/notes")["text"][0]
    assert "diverged" not in static(chunks, "/line_tuned/scene/chain/diverged")


def test_recording_explains_itself(written: Path, chunks: list[Chunk]) -> None:
    (store,) = RrdReader(written).recordings()
    assert store.application_id == "flexsim"
    assert static(chunks, "/__properties")["name"] == ["flexsim"]
    assert static(chunks, "/__properties/run") == {"flexsim": ["0.1.0"], "seed": ["7"]}
    about = static(chunks, "/__properties/line_paper")
    assert about["trajectory"] == ["line"] and about["controllers"] == ["Table 2, line"]
    assert about["setting"] == ["reconstructed"] and about["diverged_chain"] == ["1.8 s"]
    assert "(*assumed*)" in static(chunks, "/parameters")["text"][0]
    names = static(chunks, "/line_tuned/torque/chain")["names"]
    assert names == ["tau 1 chain", "tau 2 chain"]


def test_blueprint_has_a_tab_per_case(written: Path, cases: list[Case]) -> None:
    reader = RrdReader(written)
    (blueprint,) = reader.blueprints()
    assert blueprint.application_id == "flexsim"
    names, titles = set(), set()
    for chunk in reader.stream(store=blueprint).to_chunks():
        batch = chunk.to_record_batch()
        for column, found in (
            ("ContainerBlueprint:display_name", names),
            ("ViewBlueprint:display_name", titles),
        ):
            if column in batch.schema.names:
                found.update(batch.column(column)[0].as_py())
    assert {case.name for case in cases} <= names
    assert set(PANELS.values()) <= titles


def test_rerun_verifies_the_file(written: Path, tmp_path: Path) -> None:
    assert rerun(tmp_path, "rrd", "verify", str(written)) == 0
    broken = tmp_path / "broken.rrd"
    broken.write_bytes(written.read_bytes()[:-2000])
    assert rerun(tmp_path, "rrd", "verify", str(broken)) != 0


def test_same_motions_same_recording(written: Path, cases: list[Case], tmp_path: Path) -> None:
    again, other = tmp_path / "again.rrd", tmp_path / "other.rrd"
    write_recording(again, cases, METADATA, Parameters())
    write_recording(other, cases, {**METADATA, "seed": "8"}, Parameters())
    ids = [RrdReader(path).recordings()[0].recording_id for path in (written, again, other)]
    assert ids[0] == ids[1] != ids[2]
    assert rerun(tmp_path, "rrd", "compare", "--unordered", str(written), str(again)) == 0
    assert rerun(tmp_path, "rrd", "compare", "--unordered", str(written), str(other)) != 0


def test_layout_ids_are_not_random(cases: list[Case]) -> None:
    corners = [np.zeros((2, 3)), np.ones((2, 3))]
    first, second = layout(cases, corners), layout(cases, corners)
    assert first.root_container.id == second.root_container.id


def test_writing_is_silent_and_leaves_rerun_as_it_was(
    cases: list[Case], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    before = rr.strict_mode(), rr.get_global_data_recording()
    write_recording(tmp_path / "run.rrd", cases[:1], METADATA, Parameters())
    assert (rr.strict_mode(), rr.get_global_data_recording()) == before
    assert capfd.readouterr() == ("", "")
    assert [path.name for path in tmp_path.iterdir()] == ["run.rrd"]


def test_one_plant_without_model_or_reference(tmp_path: Path) -> None:
    nowhere = np.full((SAMPLES, 2), np.nan)
    motion = made_up_motion("chain", 6, reference_tip=nowhere, reference_joint=nowhere)
    write_recording(
        tmp_path / "run.rrd", [Case("free", "-", "-", "none", {"chain": motion})], {}, Parameters()
    )
    paths = {c.entity_path for c in RrdReader(tmp_path / "run.rrd").store().stream().to_chunks()}
    assert "/free/scene/chain/link1" in paths and "/free/v/chain" in paths
    assert not paths & {"/free/tip_error/chain", "/free/scene/reference", "/free/joint/reference"}
    assert not any("difference" in path for path in paths)


def test_motion_without_samples_is_left_out(cases: list[Case], tmp_path: Path) -> None:
    motion = replace(cases[0].motions["chain"].thinned(1), diverged=0.0)
    nothing = replace(motion, **{k: v[:0] for k, v in vars(motion).items() if hasattr(v, "shape")})
    case = replace(cases[0], motions={**cases[0].motions, "chain": nothing})
    write_recording(tmp_path / "run.rrd", [case], {}, Parameters())
    paths = {c.entity_path for c in RrdReader(tmp_path / "run.rrd").store().stream().to_chunks()}
    assert not any("/chain" in path for path in paths)


def test_traces_need_the_same_times() -> None:
    modes, chain = made_up_motion("assumed-modes"), made_up_motion("chain", 6)
    with pytest.raises(ParameterError, match="thin both by the same stride"):
        traces({"assumed-modes": modes.thinned(2), "chain": chain})


def test_dashes_cover_the_path_with_gaps() -> None:
    length = np.linspace(0, 1, 300)
    path = np.column_stack([length, 0 * length])
    cut = dashes(np.concatenate([path, [[np.nan, np.nan]]]))
    covered = sum(float(dash[-1, 0] - dash[0, 0]) for dash in cut)
    assert 0.4 < covered < 0.53  # DASH / (DASH + GAP) is 0.467
    assert cut[-1].max() <= 1.0 and dashes(np.empty((0, 2))) == []


@pytest.mark.parametrize("name", ["", "a b", "a/b", "-x"])
def test_case_names_must_suit_an_entity_path(cases: list[Case], name: str) -> None:
    with pytest.raises(ParameterError, match="cannot be used"):
        replace(cases[0], name=name)


def test_case_needs_a_motion(cases: list[Case]) -> None:
    with pytest.raises(ParameterError, match="no motion"):
        replace(cases[0], motions={})


def test_cases_need_their_own_names(cases: list[Case], tmp_path: Path) -> None:
    for wrong in ([], [cases[0], cases[0]]):
        with pytest.raises(ParameterError, match="own name"):
            write_recording(tmp_path / "run.rrd", wrong, METADATA, Parameters())


def test_a_failed_write_leaves_the_old_file(cases: list[Case], tmp_path: Path) -> None:
    path = tmp_path / "run.rrd"
    path.write_text("old")
    foreign = replace(cases[0], motions={"chain": made_up_motion("chain", 4)})
    with pytest.raises(ModelError, match="record a motion with the model that made it"):
        write_recording(path, [foreign], METADATA, Parameters())
    assert path.read_text() == "old" and list(tmp_path.iterdir()) == [path]


def test_no_folder_to_write_to(cases: list[Case], tmp_path: Path) -> None:
    with pytest.raises(RunError, match="cannot write the recording"):
        write_recording(tmp_path / "missing" / "run.rrd", cases[:1], METADATA, Parameters())


def test_rerun_switched_off_is_said(
    cases: list[Case], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RERUN", "off")
    with pytest.raises(RunError, match="RERUN"):
        write_recording(tmp_path / "run.rrd", cases[:1], METADATA, Parameters())
    assert not list(tmp_path.iterdir())


@pytest.fixture
def started(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Callable[[], list[list[str]]]:
    """Stand in for the viewer, which takes down its words and ends well; give what it took."""
    taken = tmp_path / "taken"
    tool = f"import json, sys; open({str(taken)!r}, 'a').write(json.dumps(sys.argv[1:]) + chr(10))"
    monkeypatch.setattr(recording_module, "RERUN_TOOL", (sys.executable, "-c", tool))
    return lambda: [json.loads(line) for line in taken.read_text().splitlines()]


def test_view_opens_a_folder_or_a_file(
    written: Path, started: Callable[[], list[list[str]]]
) -> None:
    command(ViewConfig(written.parent))
    command(ViewConfig(written, web=True))
    assert [words[0] for words in started()] == [str(written.resolve())] * 2
    assert ["--web-viewer" in words for words in started()] == [False, True]


def test_view_says_what_would_do(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").touch()
    for path in (tmp_path / "missing", tmp_path, tmp_path / "notes.txt"):
        with pytest.raises(RunError, match=r"give the folder of a run or an \.rrd file"):
            recording_of(path)


def test_viewer_that_fails_is_an_error(written: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    failing = (sys.executable, "-c", "raise SystemExit(1)")
    monkeypatch.setattr(recording_module, "RERUN_TOOL", failing)
    with pytest.raises(RunError, match="--web"):
        open_recording(written)
    with pytest.raises(RunError, match="no recording"):
        open_recording(written.with_name("other.rrd"))


def test_what_hardware_changes_is_shown_beside_what_it_was() -> None:
    """And the hardware is in the case's notes."""
    case = made_up_cases()[0]
    assert not [each for each in traces(case.motions) if each.path.count("/") > 1]
    assert "| hardware | ideal |" in _notes(case)
    motion = case.motions["assumed-modes"]
    noisy = motion.measured + np.array([0.0, 0.0, 1e-3])
    limited = replace(motion, applied=np.clip(motion.torque, -0.5, 0.5), measured=noisy)
    found = [each for each in traces({"assumed-modes": limited}) if each.path.count("/") > 1]
    assert [each.path for each in found] == [
        "torque/applied/assumed-modes",
        "v/measured/assumed-modes",
    ]
    assert found[0].names == ("tau 1 assumed modes, applied", "tau 2 assumed modes, applied")
    assert np.array_equal(found[0].values, limited.applied)
    assert found[1].values[:, 0] == pytest.approx(1e3 * motion.v + 1.0)
    assert "| hardware | bench |" in _notes(replace(case, hardware="bench"))
