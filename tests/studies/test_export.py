"""Filters written for elsewhere are the same filters there: in C, MATLAB, Python and JSON."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
import types
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import signal

from controllers import Filter, operator
from flexsim.errors import ParameterError
from studies.main import main
from studies.tools.export import of_controller, write
from studies.tools.export.matlab import check_name
from studies.tuning.found import controller_of, found_in

EXACT = 1e-12  # of the largest output: the same sections, another order of summation
FACTORED = 1e-10  # of the largest output: sections found as roots, of up to ten poles near z = 1
INPUT = np.random.default_rng(3).standard_normal(2000)  # a pseudo-random error
CROWDED = 1e-6  # of the largest output: polynomials kept whole, summed in Octave's own order
OPTIONS = ("-Wall", "-Wextra", "-Werror", "-std=c99", "-pedantic", "-ffp-contract=off")
HOSTILE = '*/ int x; /* \'); evil() %\n""" \\ ${x} ??/ #coding=utf-7 é'
MAIN = """\
#include <stdio.h>
#include "controller.h"
#include "controller.h"

int main(void)
{
    flexsim_state state;
    double x;
    int part, parts, n, k;
    if (scanf("%d %d", &parts, &n) != 2)
        return 1;
    for (part = 0; part < parts; part++) {
        flexsim_reset(&state);
        for (k = 0; k < n; k++) {
            if (scanf("%lf", &x) != 1)
                return 1;
            printf("%.17g\\n", flexsim_step(&state, part, x));
        }
    }
    return flexsim_step(&state, parts, 1.0) != 0.0;
}
"""

Exported = Callable[[str, str], tuple[Path, list[Filter]]]
CASES = {  # words of flexsim filter, how near to the original
    "taps": ("--controller circle", EXACT),
    "Table 2": ("--controller figure-4", EXACT),
    "sections": ("--controller OTHERWISE", FACTORED),
    "a run": ("--controller TUNED", EXACT),
    "ten poles": ("--controller line --realisation tustin-fraction --terms 5", FACTORED),
    "whole": ("--controller line --realisation backward-fraction --terms 8", EXACT),
    "operator": ("--order 0.5 --realisation tustin-fraction --terms 6 --gain 3", FACTORED),
    "integrator": ("--order -1.3 --realisation oustaloup --terms 4", EXACT),
    "gain": ("--order 0 --gain 7", EXACT),
    "long": ("--order -0.5 --terms 200 --period 0.01", EXACT),
}


@pytest.fixture
def exported(tmp_path: Path, tuned: Path, tuned_otherwise: Path) -> Exported:
    """Return a function from words and a file's name to the file, and what it is to be."""

    def export(words: str, name: str) -> tuple[Path, list[Filter]]:
        given = words.replace("TUNED", str(tuned)).replace("OTHERWISE", str(tuned_otherwise))
        path = tmp_path / name
        assert main(["filter", *given.split(), "--export", str(path)]) == 0
        return path, originals(given.split())

    return export


def originals(words: list[str]) -> list[Filter]:
    """Return the filters that the words are about, by the library."""
    asked = dict(zip(words[::2], words[1::2], strict=True))
    how = (asked.get("--realisation", "tustin"), int(asked.get("--terms", "10")))
    if "--order" in asked:
        period = float(asked.get("--period", "1e-3"))
        b, a = operator(how[0], float(asked["--order"]), period, how[1])
        return [(float(asked.get("--gain", "1")) * b, a)]
    found = controller_of(asked["--controller"])
    if "--realisation" in asked:
        return list(found.filters(1e-3, *how))  # type: ignore[call-arg]
    return list(found.filters(getattr(found, "period", 1e-3)))


def assert_same(outputs: list[np.ndarray], wanted: list[Filter], tolerance: float) -> None:
    assert len(outputs) == len(wanted)
    for output, (b, a) in zip(outputs, wanted, strict=True):
        right = signal.lfilter(b, a, INPUT)
        assert np.abs(output - right).max() <= tolerance * np.abs(right).max()


def cascaded(cascades: Any) -> np.ndarray:
    """Return the output of a sum of cascades of sections."""
    total = np.zeros(INPUT.size)
    for cascade in cascades:
        passed = INPUT
        for b, a in cascade:
            passed = signal.lfilter(b, a, passed)
        total = total + passed
    return total


def compiled(header: Path, folder: Path, count: int) -> list[np.ndarray]:
    """Return the outputs of a header's filters, compiled by the system's C compiler."""
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler (cc) here: the header is not compiled")
    work = folder / "compiled"
    work.mkdir()
    shutil.copy(header, work / "controller.h")
    (work / "main.c").write_text(MAIN)
    words = [compiler, *OPTIONS, "-o", str(work / "main"), str(work / "main.c")]
    built = subprocess.run(words, capture_output=True, text=True, check=False)
    assert (built.returncode, built.stderr) == (0, "")
    numbers = "\n".join([f"{count} {INPUT.size}", *map(repr, INPUT.tolist() * count)])
    ran = subprocess.run(
        [str(work / "main")], input=numbers, capture_output=True, text=True, check=True
    )
    return list(np.array([float(line) for line in ran.stdout.split()]).reshape(count, -1))


@pytest.mark.parametrize("case", CASES)
def test_c_gives_the_same_outputs(case: str, exported: Exported, tmp_path: Path) -> None:
    words, tolerance = CASES[case]
    header, wanted = exported(words, "controller.h")
    assert_same(compiled(header, tmp_path, len(wanted)), wanted, tolerance)


@pytest.mark.parametrize("case", CASES)
def test_json_gives_the_same_outputs(case: str, exported: Exported) -> None:
    words, tolerance = CASES[case]
    path, wanted = exported(words, "controller.json")
    content = json.loads(path.read_text())
    outputs = [
        cascaded([[(part["b"], part["a"]) for part in cascade] for cascade in each["cascades"]])
        for each in content["filters"]
    ]
    assert_same(outputs, wanted, tolerance)
    assert content["period_unit"] == "s" and content["period"] in (1e-3, 2e-3, 1e-2)
    units = [(each["input_unit"], each["output_unit"]) for each in content["filters"]]
    assert set(units) <= {("rad", "N m")} or len(units) == 1


def rows_of(text: str, name: str) -> np.ndarray:
    """Return a matrix of a MATLAB file by its name."""
    found = re.search(rf"^  {re.escape(name)} = \[ \.\.\.\n(.*?)^  \];", text, re.S | re.M)
    if found is None:
        assert f"{name} = zeros(0, 6);" in text
        return np.zeros((0, 6))
    rows = found[1].replace("...", "").split(";")
    return np.array([[float(each) for each in row.split(",")] for row in rows if row.strip()])


@pytest.mark.parametrize("case", CASES)
def test_matlab_has_the_same_sections(case: str, exported: Exported) -> None:
    """Read back as numbers, also where there is neither MATLAB nor Octave."""
    words, tolerance = CASES[case]
    path, wanted = exported(words, "controller.m")
    text = path.read_text()
    assert text.startswith("function [output, state] = controller(input, state)\n%")
    outputs = []
    for j in range(1, len(wanted) + 1):
        place = f"parts{{{j}}}.cascades{{1}}"
        cascade = [(row[:3], row[3:]) for row in rows_of(text, f"{place}.sos")]
        count = re.search(rf"{re.escape(place)}\.b = cell\(1, (\d+)\);", text)
        assert count is not None
        for s in range(1, int(count[1]) + 1):
            (b,), (a,) = (rows_of(text, f"{place}.{letter}{{{s}}}") for letter in "ba")
            cascade.append((b, a))
        outputs.append(cascaded([cascade]))
    assert_same(outputs, wanted, tolerance)
    opened = len(re.findall(r"^\s*(?:function|if|for)\b", text, re.M))
    assert opened == len(re.findall(r"^\s*end$", text, re.M))


@pytest.mark.parametrize("case", CASES)
def test_octave_gives_the_same_outputs(case: str, exported: Exported, tmp_path: Path) -> None:
    """In one go as in two, from the state that the first leaves."""
    octave = shutil.which("octave-cli")
    if octave is None:
        pytest.skip("no Octave (octave-cli) here: the function is not run")
    words, tolerance = CASES[case]
    _, wanted = exported(words, "controller.m")
    np.savetxt(tmp_path / "in.txt", np.column_stack([INPUT] * len(wanted)), fmt="%.17g")
    code = (
        "x = load('in.txt'); y = controller(x); [p, s] = controller(x(1:777, :)); "
        "q = controller(x(778:end, :), s); z = [y, [p; q]]; "
        "save('-ascii', '-double', 'out.txt', 'z')"
    )
    ran = subprocess.run(
        [octave, "--no-gui", "--eval", code],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    outputs = list(np.loadtxt(tmp_path / "out.txt").T)
    assert_same(outputs, wanted * 2, CROWDED if case in ("whole", "integrator") else tolerance)


@pytest.mark.parametrize("case", CASES)
def test_python_control_gets_the_same_systems(
    case: str, exported: Exported, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With a stand-in for python-control, which makes scipy's systems of the same numbers."""
    words, tolerance = CASES[case]
    path, wanted = exported(words, "controller.py")
    control = types.ModuleType("control")
    control.tf = control.ss = lambda *numbers: signal.dlti(*numbers[:-1], dt=numbers[-1])  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "control", control)
    module: dict[str, Any] = {}
    exec(compile(path.read_text(), "controller.py", "exec"), module)
    outputs, sections = [], []
    for name, system in module["systems"].items():
        assert module[name] is system and system.dt == module["period"]
        parts = module[f"{name}_sections"]
        sections.append(cascaded([[_taps(each) for each in cascade] for cascade in parts]))
        state_space = isinstance(system, signal.StateSpace)
        one = signal.dlsim(system, INPUT)[1][:, 0] if state_space else sections[-1]
        outputs.append(one)
    assert_same(outputs, wanted, tolerance)
    assert_same(sections, wanted, tolerance)


def _taps(system: Any) -> Filter:
    """Return (b, a) in powers of 1/z of a transfer function in powers of z."""
    num, den = np.atleast_1d(system.num), np.atleast_1d(system.den)
    return np.concatenate([np.zeros(den.size - num.size), num]), den


def test_what_is_kept_whole_is_said(exported: Exported, capsys: pytest.CaptureFixture[str]) -> None:
    words, _ = CASES["whole"]
    for name in ("controller.h", "controller.m", "controller.py", "controller.json"):
        path, _ = exported(words, name)
        assert "polynomials of order 16 are kept whole" in " ".join(
            re.sub(r"^[ *%]+", "", line) for line in path.read_text().splitlines()
        )
        assert "Note: joint1: the polynomials of order 16" in capsys.readouterr().out


def assert_harmless(folder: Path, module: Callable[[str], dict[str, Any]]) -> None:
    """Of c.h, c.m, c.py: the name is within comments or strings, and ends none."""
    texts = {name: (folder / name).read_bytes() for name in ("c.h", "c.m", "c.py")}
    assert all(text.isascii() and b"evil()" in text for text in texts.values())
    header = texts["c.h"].decode()
    assert "evil" not in re.sub(r"/\*.*?\*/", "", header, flags=re.S)
    assert header.count("*/") == header.count("/*")
    named = [line for line in texts["c.m"].decode().splitlines() if "evil" in line]
    assert named and all(line.startswith("% ") for line in named)
    assert "evil()" in module(texts["c.py"].decode())["__doc__"]


@pytest.fixture
def module(monkeypatch: pytest.MonkeyPatch) -> Callable[[str], dict[str, Any]]:
    """Return a function that runs a Python file, python-control's systems its numbers."""

    def run(text: str) -> dict[str, Any]:
        control = types.ModuleType("control")
        control.tf = control.ss = lambda *numbers: numbers  # type: ignore[attr-defined]
        monkeypatch.setitem(sys.modules, "control", control)
        found: dict[str, Any] = {}
        exec(compile(text.encode(), "c.py", "exec"), found)
        return found

    return run


def test_a_folder_may_be_called_anything(
    tuned: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    module: Callable[[str], dict[str, Any]],
) -> None:
    folder = tmp_path / HOSTILE.replace("/", "|")
    shutil.copytree(tuned, folder)
    monkeypatch.chdir(tmp_path)
    for name in ("c.h", "c.m", "c.py", "c.json"):
        assert main(["filter", "--controller", str(folder), "--export", name]) == 0
        assert capsys.readouterr().out.count("\n") == 1
    assert_harmless(tmp_path, module)
    outputs = compiled(Path("c.h"), tmp_path, 2)
    assert_same(outputs, list(controller_of(str(folder)).filters(1e-3)), EXACT)
    assert json.loads(Path("c.json").read_text())["controller"] == folder.name


def test_a_name_with_the_end_of_a_comment_is_text(
    tuned: Path, tmp_path: Path, module: Callable[[str], dict[str, Any]]
) -> None:
    """Which no folder can have, a slash being no part of a name."""
    found = replace(found_in(tuned), name=HOSTILE)
    what = of_controller(found, found.filters(1e-3), 1e-3)
    for name in ("c.h", "c.m", "c.py", "c.json"):
        write(tmp_path / name, what)
    assert_harmless(tmp_path, module)
    compiled(tmp_path / "c.h", tmp_path, 2)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--controller circle --export c.txt", "give one of .h, .m, .py, .json, or add --format"),
        ("--controller circle --export taken.h", "exists already"),
        ("--controller circle --export folder.h --force", "it is a folder"),
        ("--controller circle --export 2nd.m", "no name of a MATLAB function"),
        ("--controller circle --export c-d --format matlab", "no name of a MATLAB function"),
        ("--controller circle --export no/such/folder/c.h", "cannot write"),
        ("--controller circel --export c.h", "Did you mean circle"),
        ("--controller circle --order 1", "--order is of an operator"),
        ("--controller circle --gain 2", "--gain is of an operator"),
        ("--controller circle --force", "nothing is written"),
        ("--controller circle --format c", "nothing is written"),
        ("--controller TUNED --terms 5", "a run of flexsim tune has its own"),
        ("--controller TUNED --period 0.002", "a run of flexsim tune has its own"),
        ("--controller circle --period 0 --export c.h", "period"),
        ("--controller circle --format basic --export c.h", "basic"),
        ("--export c.h", "give --order NU"),
        ("--order 0.5 --gain 0 --export c.h", "gain must not be zero"),
    ],
)
def test_what_cannot_be_written_is_said_in_one_line(
    words: str,
    said: str,
    tuned: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("taken.h").write_text("mine")
    Path("folder.h").mkdir()
    assert main(["filter", *words.replace("TUNED", str(tuned)).split()]) == 2
    shown = capsys.readouterr()
    assert shown.out == "" and shown.err.count("\n") == 1 and said in shown.err
    assert {each.name for each in tmp_path.iterdir()} == {"taken.h", "folder.h"}
    assert Path("taken.h").read_text() == "mine"


def test_the_format_may_be_given(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "controller.txt"
    words = ["filter", "--controller", "line", "--export", str(path)]
    assert main([*words, "--format", "json", "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert shown["export"] == str(path) and shown["tuned_for"] == "line"
    assert json.loads(path.read_text())["format"] == "flexsim-filters"
    assert main([*words, "--format", "c", "--force"]) == 0
    assert path.read_text().startswith("/*")


def test_a_controllers_filters_are_shown(
    tuned_otherwise: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    words = ["filter", "--controller", str(tuned_otherwise)]
    assert main([*words, "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert (shown["controller"], shown["period"], shown["v_gain"]) == ("run otherwise", 2e-3, 0)
    found = controller_of(str(tuned_otherwise)).filters(2e-3)
    for name, (b, a) in zip(("joint1", "joint2"), found, strict=True):
        assert shown[name] == {"b": b.tolist(), "a": a.tolist()}
    _, response = signal.freqz(*found[0], worN=np.array(shown["omega"]) * 2e-3)
    assert np.allclose(shown["magnitude_1_db"], 20 * np.log10(np.abs(response)))
    assert np.allclose(shown["phase_1_deg"], np.degrees(np.angle(response)))
    assert main(words) == 0
    out = capsys.readouterr().out
    assert max(map(len, out.splitlines())) <= 80 and "run otherwise, T = 0.002 s" in out


@pytest.mark.parametrize("name", ["filter", "end", "a-b", "_a", "a" * 64, "", "é"])
def test_matlab_must_be_able_to_call_it(name: str) -> None:
    with pytest.raises(ParameterError, match="MATLAB"):
        check_name(name)
    assert check_name("circle_2") == "circle_2"
