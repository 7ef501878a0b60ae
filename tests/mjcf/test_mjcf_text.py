"""Files that include others: read as one text, which a run can keep, or refused."""

import re
from pathlib import Path

import numpy as np
import pytest
from edits import DEFAULT, edited

from flexsim import ModelError
from flexsim.mjcf.chain_file import load_chain
from flexsim.mjcf.reading.text import with_includes
from studies.main import main

FOUND = re.search(r"<actuator>.*</actuator>", DEFAULT, re.DOTALL)
assert FOUND
MOTORS = FOUND[0]
PLACE = '<include file="motors.xml"/>'


def written(folder: Path, include: str = PLACE, motors: str = MOTORS) -> Path:
    """A file that includes its motors."""
    (folder / "motors.xml").write_text(f"<mujocoinclude>{motors}</mujocoinclude>")
    path = folder / "arm.xml"
    path.write_text(DEFAULT.replace(MOTORS, include))
    return path


@pytest.mark.parametrize(
    "include",
    [
        PLACE,
        "<include file='motors.xml'></include>",
        '<include  file = "motors.xml" />',
        f"<!-- {PLACE} -->{PLACE}",
    ],
)
def test_an_included_file_becomes_part_of_the_text(tmp_path: Path, include: str) -> None:
    chain = load_chain(written(tmp_path, include))
    assert "motors.xml" not in re.sub(r"<!--.*?-->", "", chain.text)
    again = load_chain(text=chain.text)
    assert np.array_equal(again.model.body_mass, chain.model.body_mass)
    assert [again.model.actuator(i).name for i in range(2)] == ["motor1", "motor2"]


def test_a_comment_of_an_include_is_none(tmp_path: Path) -> None:
    path = written(tmp_path, f"<!-- {PLACE} -->{MOTORS}")
    assert load_chain(path).text == path.read_text()


def test_includes_may_include(tmp_path: Path) -> None:
    (tmp_path / "inner.xml").write_text(f"<mujoco>{MOTORS}</mujoco>")
    (tmp_path / "motors.xml").write_text('<mujoco><include file="inner.xml"/></mujoco>')
    path = tmp_path / "arm.xml"
    path.write_text(DEFAULT.replace(MOTORS, PLACE))
    assert load_chain(text=load_chain(path).text).model.nu == 2


def test_text_without_includes_stays_to_the_byte(tmp_path: Path) -> None:
    assert with_includes(DEFAULT, tmp_path) is DEFAULT


def test_a_file_that_includes_itself_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = written(tmp_path, f'{MOTORS}<include file="arm.xml"/>')
    with pytest.raises(ModelError, match=r"arm\.xml"):
        load_chain(path)
    assert main(["modes", str(path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_a_mesh_that_no_run_could_keep_is_refused(tmp_path: Path) -> None:
    corners = "0 0 0\n0.1 0 0\n0 0.1 0\n0 0 0.1\n"
    lines = "".join(f"v {corner}\n" for corner in corners.splitlines())
    (tmp_path / "gear.obj").write_text(lines + "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    path = tmp_path / "arm.xml"
    text = edited("<asset>", '<asset><mesh name="gear" file="gear.obj"/>')
    path.write_text(
        text.replace(
            '<geom name="base" class="motor"',
            '<geom name="base" type="mesh" mesh="gear" contype="0" conaffinity="0"',
        )
    )
    with pytest.raises(ModelError, match=r"needs other files.*gear\.obj"):
        load_chain(path)


def test_a_tuning_run_of_a_file_with_includes_can_be_continued(tmp_path: Path) -> None:
    path, run = written(tmp_path, '<include file = "motors.xml"/>'), tmp_path / "run"
    small = ["--population", "4", "--generations", "2", "--survivors", "2"]
    assert main(["tune", "--mjcf", str(path), *small, "--out", str(run)]) == 0
    (tmp_path / "motors.xml").unlink()
    (run / "result.json").unlink()
    assert main(["tune", "--resume", str(run)]) == 0
    assert (run / "result.json").is_file()
