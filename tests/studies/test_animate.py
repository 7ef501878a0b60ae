"""Animations: frames of a stated size and pace, a factor that is what is drawn, plain refusals."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from recorded_cases import made_up_motion

from studies.animate.scene import Arm, Scene, round_down
from studies.core.figures import styles
from studies.main import main

WIDTH = 826  # [pixel]
SIZE_MOST = 1_500_000  # bytes


def scene(shift: float = 1e-3) -> Scene:
    """Return two arms, the second's tip `shift` [m] to the right of the first's and more."""
    one = made_up_motion("assumed-modes", samples=100)
    other = made_up_motion("chain", samples=100)
    other.tip[:] = one.tip + np.array([shift, 0.0])
    looks = styles(("assumed-modes", "chain"))
    elbow = np.tile([0.3, -0.1], (100, 1))
    arms = [Arm(each.plant, each, elbow, looks[each.plant]) for each in (one, other)]
    return Scene(arms, one.reference_tip, 1.0, "words")


@pytest.mark.parametrize(
    ("given", "wanted"), [(1.0, 1), (4.99, 4), (5.0, 5), (99.0, 80), (0.35, 0.3), (2000.0, 2000)]
)
def test_factors_are_round(given: float, wanted: float) -> None:
    assert round_down(given) == pytest.approx(wanted)


def test_the_difference_is_as_much_larger_as_the_title_says() -> None:
    """In pixels per metre, of the panel against the arms; and it fits."""
    drawn = scene(2e-3)
    assert drawn.zoom is not None
    scale = [
        axes.get_window_extent().width / np.ptp(axes.get_xlim())
        for axes in (drawn.plan, drawn.zoom)
    ]
    assert 1e3 * scale[1] / scale[0] == pytest.approx(drawn.factor, rel=1e-6)
    assert f"{drawn.factor:g} times larger" in drawn.zoom.get_title(loc="left")
    assert max(drawn.zoom.get_xlim()) > 2.0
    assert scene(2e-5).factor == pytest.approx(100 * drawn.factor)


def test_a_link_1_that_bends_is_drawn_so() -> None:
    """Its points are the motion's own, and the beam begins where they end."""
    motion = made_up_motion("chain", samples=10)
    bent = np.cumsum(np.random.default_rng(1).normal(size=(10, 5, 2)), axis=1)
    motion = dataclasses.replace(motion, link1=bent)
    arm = Arm("chain", motion, bent[:, -1], styles(("chain",))["chain"])
    drawn = Scene([arm], motion.reference_tip, 1.0)
    drawn.show(float(motion.time[4]))
    (link,), (beam,) = drawn._links, drawn._beams
    assert np.array_equal(np.transpose(link.get_data()), bent[4])
    assert np.array_equal(np.transpose(beam.get_data())[0], bent[4, -1])


def test_pictures_move_and_what_is_shown_is_the_sample() -> None:
    drawn = scene()
    pictures = []
    for time in (0.0, 0.5):
        drawn.show(time)
        pictures.append(drawn.pixels())
    assert pictures[0].shape[1] == WIDTH and (pictures[0] != pictures[1]).any()
    drawn.show(0.0)
    assert np.array_equal(drawn.pixels(), pictures[0])
    assert drawn.arms[0].row(0.501) == 50 and drawn.arms[0].row(99.0) == 99


def test_a_gif_and_a_still(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Of rigid arms, whose loop is the cheapest: five seconds at the pace of the motion."""
    out, still = tmp_path / "a.gif", tmp_path / "a.png"
    loop = ["animate", "--plants", "rigid", "assumed-modes", "--trajectory", "line", "--json"]
    assert main([*loop, "--fps", "4", "--out", str(out)]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["loops"] == ["rigid", "assumed modes"] and told["time"] == 5.0
    assert told["bytes"] == out.stat().st_size < SIZE_MOST and told["magnified"] > 0
    with Image.open(out) as image:
        assert (image.n_frames, image.size[0], image.info["duration"]) == (21, WIDTH, 250)
    assert main([*loop, "--at", "1.5", "--out", str(still)]) == 0
    assert json.loads(capsys.readouterr().out)["time"] == 1.5
    with Image.open(still) as image:
        assert image.info["dpi"] == pytest.approx((300, 300), abs=0.1)
    assert main([*loop, "--out", str(still)]) == 2
    assert "exists already" in capsys.readouterr().err
    assert {path.name for path in tmp_path.iterdir()} == {"a.gif", "a.png"}


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        ("--out a.mp4", "a.mp4 has none of the endings .gif, .webp, .png"),
        ("--out a.gif --fps 0", "fps is 0; give 1 to 50"),
        ("--out a.gif --at 1", "--at is of a still; write a .png"),
        ("--out a.gif --plants rigid rod chain", "3 loops are asked for"),
        ("--out a.gif --controllers line circle", "4 loops are asked for"),
        ("--out a.gif --plants rigid rigid", "plants are rigid rigid; name each once"),
        ("--out a.png --plants rigid --at 9", "--at is 9 s; give 0 to 5"),
        ("--out a.gif --plants rigid --trajectory square", "trajectory 'square' is unknown"),
    ],
)
def test_bad_input_is_one_line(
    words: str,
    complaint: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["animate", *words.split()]) == 2
    shown = capsys.readouterr()
    assert shown.out == "" and shown.err.count("\n") == 1 and complaint in shown.err
    assert list(tmp_path.iterdir()) == []
