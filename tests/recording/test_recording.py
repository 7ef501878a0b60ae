"""Recordings: what is read back from the file is what the motions held, laid out and explained."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pyarrow as pa
import pytest
import rerun as rr
from recorded_cases import DIVERGED, SAMPLES, made_up_cases, made_up_motion
from rerun.chunk import Chunk, RrdReader

from flexsim import ModelError, ParameterError, Parameters, RunError
from flexsim.loop.friction import Friction
from flexsim.recording import rerun_file as recording_module
from flexsim.recording.case import Case
from flexsim.recording.curves import APART, CURVES, QUANTITIES, columns, panels
from flexsim.recording.drawn.map import dashes, sheet_of
from flexsim.recording.joined import plans_of
from flexsim.recording.layout import Beside, layout, space_view, top_view
from flexsim.recording.rerun_file import RERUN_TOOL, open_recording
from flexsim.recording.rrd import plan_of, write_recording
from flexsim.recording.scene import remarks
from flexsim.recording.texts import notes
from flexsim.recording.traces import TIMELINE

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


def moving(chunks: list[Chunk], path: str) -> pa.RecordBatch:
    """Return the columns of an entity that changes over time."""
    (chunk,) = (c for c in chunks if c.entity_path == path and not c.is_static)
    return chunk.to_record_batch()


def rows(chunks: list[Chunk], path: str) -> dict[str, np.ndarray]:
    """Return the time [ns] and the flattened columns of an entity that changes over time."""
    batch = moving(chunks, path)

    def flat(name: str) -> np.ndarray:
        array = batch.column(name)
        while hasattr(array, "flatten") and "list" in str(array.type):
            array = array.flatten()
        return array.to_numpy(zero_copy_only=False)

    names = [name for name in batch.schema.names[1:] if "struct" not in str(batch.schema)]
    return {name.split(":")[-1]: flat(name) for name in names}


def curves(chunks: list[Chunk], case: str, component: str) -> dict[str, np.ndarray]:
    """Return a plant's curves by field, each with the samples that it has."""
    column = moving(chunks, f"/{case}/{CURVES}").column(component).flatten()
    return {
        field.name: column.field(field.name).to_numpy(zero_copy_only=False) for field in column.type
    }


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


def test_every_plot_has_curves_of_both_plants(chunks: list[Chunk], cases: list[Case]) -> None:
    for case in cases:
        shown = panels(case, columns(case))
        assert len(shown) == len(QUANTITIES) + 2
        for panel in shown:
            assert panel.low < panel.high and "[" in panel.title
            for series in panel.series:
                found = curves(chunks, case.name, series.component)[series.field]
                assert (
                    len(found) and panel.low <= np.nanmin(found) <= np.nanmax(found) <= panel.high
                )


def test_curves_are_the_motions_own_in_single_precision(
    chunks: list[Chunk], cases: list[Case]
) -> None:
    motion = cases[0].motions["chain"]
    found = curves(chunks, "line_tuned", "chain")
    error = np.hypot(*(motion.tip - motion.reference_tip).T)
    for name, values in {
        "v_mm": 1000 * motion.v,
        "torque_2_Nm": motion.torque[:, 1],
        "tip_error_mm": 1000 * error,
        "error_1_mrad": 1000 * motion.error[:, 0],
        "theta_2_rad": motion.joint[:, 1],
        "eta_3_mm": 1000 * motion.modal[:, 2],
        "energy_J": motion.energy,
    }.items():
        assert found[name].dtype == np.float32
        assert np.array_equal(found[name], values.astype(np.float32)), name
    time = moving(chunks, f"/line_tuned/{CURVES}").column(TIMELINE)
    step = time.to_numpy(zero_copy_only=False).astype(np.int64)
    assert np.array_equal(step, 10_000_000 * np.arange(SAMPLES))


def test_difference_is_chain_minus_assumed_modes(chunks: list[Chunk], cases: list[Case]) -> None:
    modes, chain = (cases[0].motions[plant] for plant in ("assumed-modes", "chain"))
    found = curves(chunks, "line_tuned", APART)
    tip = np.column_stack([found["x_mm"], found["y_mm"]])
    assert np.array_equal(tip, (1000 * (chain.tip - modes.tip)).astype(np.float32))
    assert np.array_equal(found["v_mm"], (1000 * (chain.v - modes.v)).astype(np.float32))
    assert np.ptp(found["distance_mm"]) > 0.1


def test_the_first_arm_is_a_line_where_it_is(chunks: list[Chunk], cases: list[Case]) -> None:
    motion, p = cases[0].motions["assumed-modes"], Parameters()
    strips = rows(chunks, "/line_tuned/scene/assumed-modes/links")["strips"]
    links = strips.reshape(-1, 2, 2, 3)  # of frames
    every = round(0.02 / 0.01)
    joint2 = p.L_R * np.column_stack([np.cos(motion.joint[:, 0]), np.sin(motion.joint[:, 0])])
    assert np.abs(links[:, 0, 0, :2]).max() == 0.0
    assert np.abs(links[:, 0, 1, :2] - joint2[::every]).max() < SINGLE
    assert np.abs(links[:, 1, 1, :2] - motion.beam[::every, 0]).max() < SINGLE
    pieces = rows(chunks, "/line_tuned/scene/assumed-modes/beam")["strips"]
    ends = pieces.reshape(len(links), -1, 2, 3)
    assert np.abs(ends[:, 0, 0, :2] - motion.beam[::every, 0]).max() < SINGLE
    assert np.abs(ends[:, -1, 1, :2] - motion.tip[::every]).max() < SINGLE


def test_both_arms_lie_in_one_plane(chunks: list[Chunk]) -> None:
    """Layers of 0.1 mm, no more: nothing is lifted to be seen."""
    for chunk in chunks:
        path = chunk.entity_path
        if path.startswith("/line_tuned/scene") and path.endswith(("links", "beam", "tip", "path")):
            found = static(chunks, path) if chunk.is_static else rows(chunks, path)
            points = found.get("strips", found.get("positions"))
            if points is not None:
                flat = (
                    np.concatenate([np.ravel(each) for each in points])
                    if chunk.is_static
                    else points
                )
                assert np.abs(flat.reshape(-1, 3)[:, 2]).max() < 2e-3


def test_geoms_stand_where_mujoco_puts_them(chunks: list[Chunk], cases: list[Case]) -> None:
    model, motion = cases[0].chain_model, cases[0].motions["chain"]
    assert model is not None
    data = mujoco.MjData(model)
    k = SAMPLES // 4
    data.qpos[:] = motion.state[2 * k, : model.nq]
    mujoco.mj_kinematics(model, data)
    boxes = np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_BOX)
    found = rows(chunks, "/line_tuned/solids/boxes")
    centres = found["centers"].reshape(-1, len(boxes), 3)[k]
    assert np.abs(centres - data.geom_xpos[boxes]).max() < SINGLE
    x, y, z, w = found["quaternions"].reshape(-1, len(boxes), 4)[k].T
    own = np.zeros((len(boxes), 4))
    for i, geom in enumerate(boxes):
        mujoco.mju_mat2Quat(own[i], data.geom_xmat[geom])
    assert np.abs(np.abs(np.sum(own * np.column_stack([w, x, y, z]), axis=1)) - 1).max() < SINGLE
    assert static(chunks, "/line_tuned/solids/boxes")["half_sizes"] == pytest.approx(
        model.geom_size[boxes], abs=SINGLE
    )


def test_divergence_ends_the_curves_and_is_said(chunks: list[Chunk]) -> None:
    assert len(curves(chunks, "line_paper", "chain")["v_mm"]) == DIVERGED
    assert len(curves(chunks, "line_paper", APART)["v_mm"]) == DIVERGED
    assert len(curves(chunks, "line_paper", "assumed_modes")["v_mm"]) == SAMPLES
    label = static(chunks, "/line_paper/scene/words/chain")["labels"]
    assert label == ["chain: diverged at 1.800 s"]
    assert static(chunks, "/line_paper/scene/chain/diverged")["positions"]
    assert "diverged at t = 1.800 s" in static(chunks, "/line_paper/notes")["text"][0]
    assert not static(chunks, "/line_tuned/scene/chain/diverged")
    assert "diverged at t = 1.800 s" in static(chunks, "/overview")["text"][0]


def test_the_state_of_a_joint_that_diverged_does_not_go_on(tmp_path: Path) -> None:
    case = replace(made_up_cases()[1], friction=Friction("simulink"))
    write_recording(tmp_path / "run.rrd", [case], METADATA, Parameters())
    chunks = RrdReader(tmp_path / "run.rrd").store().stream().to_chunks()
    for plant, last in (("chain", True), ("assumed-modes", False)):
        states = rows(chunks, f"/line_paper/states/joint_1/{plant}")["state"]
        assert (states[-1] == "diverged") == last
        assert "diverged" not in states[:-1]


def test_small_maps_and_the_view_in_space_have_no_words(cases: list[Case]) -> None:
    """Texts have one size: there they would cover the arms; what they say is in the title."""
    sheet = sheet_of(cases[0], Parameters())
    plan, here = plan_of(cases[0], sheet, columns(cases[0])), Beside("")
    words = "- /line_tuned/scene/words/**"
    large, small = top_view(here, plan), top_view(here, plan, small=True)
    assert words not in large.contents and words in small.contents
    assert words in space_view(here, plan).contents
    assert sheet.about_reference is not None and sheet.about_first is not None
    factors = f"x {sheet.about_reference.factor:g} and x {sheet.about_first.factor:g}"
    assert small.name == f"grid 0.1 m · line: assumed modes · hollow: chain · circles {factors}"
    root = layout([Beside("", [plan, replace(plan, name="other")])]).root_container
    maps = root.contents[0].contents[0].contents
    assert words in maps[0].contents and "- /line_tuned/scene/about_first/**" in maps[0].contents


def test_recording_explains_itself(written: Path, chunks: list[Chunk]) -> None:
    (store,) = RrdReader(written).recordings()
    assert store.application_id.startswith("flexsim ")
    assert static(chunks, "/__properties")["name"] == ["flexsim"]
    assert static(chunks, "/__properties/run") == {"flexsim": ["0.1.0"], "seed": ["7"]}
    about = static(chunks, "/__properties/line_paper")
    assert about["trajectory"] == ["line"] and about["controllers"] == ["Table 2, line"]
    assert about["setting"] == ["reconstructed"] and about["diverged_chain"] == ["1.8 s"]
    assert "(*assumed*)" in static(chunks, "/parameters")["text"][0]


def test_blueprint_has_a_tab_per_case(written: Path, cases: list[Case]) -> None:
    reader = RrdReader(written)
    (blueprint,) = reader.blueprints()
    (store,) = reader.recordings()
    assert blueprint.application_id == store.application_id
    names, titles = set(), set()
    for chunk in reader.stream(store=blueprint).to_chunks():
        batch = chunk.to_record_batch()
        for column, found in (
            ("ContainerBlueprint:display_name", names),
            ("ViewBlueprint:display_name", titles),
        ):
            if column in batch.schema.names:
                found.update(batch.column(column)[0].as_py())
    assert {"overview", *(case.name for case in cases)} <= names
    for case in cases:
        assert {panel.title for panel in panels(case, columns(case))} <= titles


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
    plans = [plan_of(case, sheet_of(case, Parameters()), columns(case)) for case in cases]
    first, second = (layout([Beside("", plans)]) for _ in range(2))
    assert first.root_container.id == second.root_container.id


def test_a_recording_knows_what_it_shows(
    written: Path, chunks: list[Chunk], cases: list[Case]
) -> None:
    plans = [plan_of(case, sheet_of(case, Parameters()), columns(case)) for case in cases]
    assert list(plans_of(written, chunks)) == plans


def test_few_entities_and_chunks_for_eight_cases(cases: list[Case], tmp_path: Path) -> None:
    """They were 842 and 1323 when every curve and every body was one."""
    eight = [replace(cases[0], name=f"case_{i}") for i in range(8)]
    write_recording(tmp_path / "run.rrd", eight, METADATA, Parameters())
    found = RrdReader(tmp_path / "run.rrd").store().stream().to_chunks()
    assert len({chunk.entity_path for chunk in found}) < 320 and len(found) < 450


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
    assert "/free/scene/chain/links" in paths and "/free/curves" in paths
    assert not paths & {
        "/free/scene/reference",
        "/free/solids/boxes",
        "/free/scene/about_first/rim",
    }
    found = RrdReader(tmp_path / "run.rrd").store().stream().to_chunks()
    assert "v_mm" in curves(found, "free", "chain")
    assert "tip_error_mm" not in curves(found, "free", "chain")
    assert APART not in moving(found, "/free/curves").schema.names


def test_motion_without_samples_is_left_out(cases: list[Case], tmp_path: Path) -> None:
    motion = replace(cases[0].motions["chain"].thinned(1), diverged=0.0)
    nothing = replace(motion, **{k: v[:0] for k, v in vars(motion).items() if hasattr(v, "shape")})
    case = replace(cases[0], motions={**cases[0].motions, "chain": nothing})
    write_recording(tmp_path / "run.rrd", [case], {}, Parameters())
    paths = {c.entity_path for c in RrdReader(tmp_path / "run.rrd").store().stream().to_chunks()}
    assert not any("/chain" in path for path in paths)


def test_differences_need_the_same_times() -> None:
    modes, chain = made_up_motion("assumed-modes"), made_up_motion("chain", 6)
    with pytest.raises(ParameterError, match="thin both by the same stride"):
        columns(Case("x", "-", "-", "-", {"assumed-modes": modes.thinned(2), "chain": chain}))


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
    sheet = sheet_of(case, Parameters())
    assert "| hardware | ideal |" in notes(case, remarks(case, sheet))
    motion = case.motions["assumed-modes"]
    limited = replace(motion, applied=np.clip(motion.torque, -0.5, 0.5))
    for each, seen in ((motion, set()), (limited, {"torque_1_applied_Nm"})):
        alone = replace(case, motions={"assumed-modes": each})
        (table,) = columns(alone)
        titles = [panel.title for panel in panels(alone, [table]) if panel.tab == "joints"]
        assert [title.endswith("finest: applied") for title in titles] == [bool(seen), False]
        drawn = {s.field for panel in panels(alone, [table]) for s in panel.series}
        assert {name for name in drawn if "applied" in name} == seen
    assert np.array_equal(
        table.components["assumed_modes"]["torque_1_applied_Nm"], limited.applied[:, 0]
    )


def test_plants_of_one_kind_are_told_apart() -> None:
    case = made_up_cases()[0]
    plants = ("assumed-modes", "chain", "chain:10", "chain:4")
    several = replace(case, motions=dict.fromkeys(plants, case.motions["chain"]))
    first = panels(several, columns(several))[0]
    assert len({(each.colour, each.width) for each in first.series}) == len(plants)
    assert "thin blue: chain · thin dark blue: chain 10 · thin dark dark blue" in first.title


def test_texts_from_outside_are_no_markdown() -> None:
    case = replace(made_up_cases()[0], trajectory="a|b *c* <d> [e](f)")
    said = notes(case, ["-"])
    assert "a\\|b \\*c\\* \\<d\\> \\[e\\](f)" in said
