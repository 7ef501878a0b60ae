"""The modes of the shipped chains: against the beam, the design, and what the README says."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flexsim import ModelError, Parameters, load_chain
from flexsim.arm.chain_design import design_chain
from flexsim.arm.free_arm import clamped_frequencies, joint_free_frequencies
from flexsim.arm.parameters import PRINTED_BETA_L
from flexsim.arm.reference_beam import uniform_reference
from flexsim.plants.chain_as_modes import vibration
from studies.main import main
from studies.parity.modes import ModesConfig, run
from studies.parity.side_by_side import modal_assurance

MODELS = Path(__file__).parents[2] / "models"
CHAIN6 = MODELS / "chain6.xml"
README = (MODELS / "README.md").read_text()
P = Parameters()

FIVE_DIGITS = 5e-5  # relative: (28)-(30) have five digits, frequencies go with their square
CLAMPED = 1e-9  # relative: the design tunes these to rounding
JOINT_FREE = 3e-4  # relative, promised for the default chain
COUPLING = 8e-4  # relative, promised for the default chain
TWELVE_DIGITS = 1e-9  # relative: the file rounds the design; the design's own sum is another
SHARE = 0.02  # of a frequency: what one soft hinge takes off the first, at least
CELL = 0.03  # relative: a hinge stands for a cell of the beam, a sixth of it, not for all of it
P_CLAMPED = clamped_frequencies(P, 3) / (2 * np.pi)
P_FREE = joint_free_frequencies(P, 3) / (2 * np.pi)
TRUNCATION = 0.03  # relative: what the higher modes add to the static compliance of three


def shown(capsys: pytest.CaptureFixture[str], *words: str) -> Any:
    assert main(["modes", *words, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def edited(folder: Path, pattern: str, replacement: str) -> Path:
    text, count = re.subn(pattern, replacement, CHAIN6.read_text())
    assert count
    path = folder / "edited.xml"
    path.write_text(text)
    return path


def promised(row: str, name: str) -> list[float]:
    """Return the numbers of a cell of the README's table, found by its row and file."""
    heading = next(line for line in README.splitlines() if "| plain, N = 8 |" in line)
    line = next(line for line in README.splitlines() if line.startswith(f"| {row}"))
    cell = line.split("|")[heading.split("|").index(f" `{name}` ")]
    return [float(number) for number in re.findall(r"[-+]?[\d.]+", cell)]


def test_default_chain_keeps_its_promises(capsys: pytest.CaptureFixture[str]) -> None:
    found = shown(capsys)
    for key, limit in (("clamped_hz", CLAMPED), ("joint_free_hz", JOINT_FREE)):
        assert list(found[key]) == ["exact", "assumed_modes", "chain"]
        exact = np.array(found[key]["exact"])
        assert np.abs(np.array(found[key]["chain"]) / exact - 1).max() < limit
        assert np.abs(np.array(found[key]["assumed_modes"]) / exact - 1).max() < JOINT_FREE * 3
    assert found["coupling_error_max"] < COUPLING
    assert set(found["omega_max"]) == {"assumed_modes", "chain"}
    assert (np.array(found["mac"]) <= 1).all()


def test_clamped_frequencies_are_the_papers(capsys: pytest.CaptureFixture[str]) -> None:
    """Source: (28)-(30) in omega = (beta L)^2 sqrt(EI / rho) / L^2."""
    paper = np.array(PRINTED_BETA_L) ** 2 * np.sqrt(P.EI / P.rho) / P.L**2 / (2 * np.pi)
    found = shown(capsys)["clamped_hz"]
    for model in ("exact", "assumed_modes", "chain"):
        np.testing.assert_allclose(found[model], paper, rtol=FIVE_DIGITS)


def test_static_compliance_in_closed_form() -> None:
    found = run(ModesConfig()).static_compliance
    assert found["exact"] == pytest.approx(P.L**3 / (3 * P.EI), rel=1e-15)
    assert found["chain"] == pytest.approx(found["exact"], rel=COUPLING)
    # modes' springs in series: the missing ones would only add
    assert 1 - TRUNCATION < found["assumed_modes"] / found["exact"] < 1


def test_compiled_chain_is_the_design() -> None:
    """Two codes, one chain: MuJoCo's matrices against the design's closed forms."""
    design = design_chain(P, 6)
    found = vibration(load_chain(CHAIN6), P)
    result = run(ModesConfig(CHAIN6))
    np.testing.assert_allclose(found.clamped, design.frequency[:3], rtol=TWELVE_DIGITS)
    for name, errors in (
        ("Phi_i (m)", design.Phi_error),
        ("int (x-r) chi_i (m2)", design.moment_error),
        ("chi_i(tip)", design.tip_error),
    ):
        table = result.couplings[name]
        np.testing.assert_allclose(table["chain"] / table["exact"] - 1, errors, atol=TWELVE_DIGITS)
    np.testing.assert_allclose(result.mac, design.mac, atol=TWELVE_DIGITS)
    worst = max(design.coupling_error, np.abs(design.tip_error).max(), abs(design.compliance_error))
    assert result.coupling_error_max == pytest.approx(worst, abs=TWELVE_DIGITS)


@pytest.mark.parametrize("name", ["chain4.xml", "chain6.xml", "chain10.xml"])
def test_models_readme_is_true(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Every figure of the README's table, to the digits it is given with."""
    found = shown(capsys, str(MODELS / name))
    couplings = {n: t for n, t in found["couplings"].items() if "tip" not in n}
    worst = max(
        np.abs(np.array(t["chain"]) / np.array(t["exact"]) - 1).max() for t in couplings.values()
    )
    compliance = found["static_compliance"]
    assert promised("largest error of a coupling", name) == [round(100 * worst, 4)]
    assert promised("static tip deflection", name) == [
        round(100 * (compliance["chain"] / compliance["exact"] - 1), 4)
    ]
    assert promised("MAC", name) == [round(value, 4) for value in found["mac"]]
    assert promised("highest frequency", name) == [round(found["omega_max"]["chain"])]
    (longest,) = promised("longest stable step", name)
    assert longest == float(f"{1e3 * found['step_limit']:.3g}")
    stated = [float(number) for number in re.findall(r"\d+\.\d{5}", README)[:3]]
    assert stated == [round(value, 5) for value in found["clamped_hz"]["exact"]]


def test_stiffness_goes_with_the_square_of_frequency(tmp_path: Path) -> None:
    """README: multiply every hinge's stiffness, the frequencies go with its square root."""
    text = CHAIN6.read_text()
    stiffer = re.sub(r'stiffness="([^"]*)"', lambda m: f'stiffness="{4 * float(m[1])!r}"', text)
    stiffer = stiffer.replace('timestep="0.001"', 'timestep="0.0005"')
    usual = vibration(load_chain(CHAIN6), P)
    found = vibration(load_chain(text=stiffer), P)
    np.testing.assert_allclose(found.clamped, 2 * usual.clamped, rtol=TWELVE_DIGITS)
    np.testing.assert_allclose(found.joint_free, 2 * usual.joint_free, rtol=TWELVE_DIGITS)
    assert found.compliance == pytest.approx(usual.compliance / 4, rel=TWELVE_DIGITS)


def test_an_edited_file_is_compared_with_its_own_beam(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One hinge half as stiff: another beam, which both models are, and the paper's is not."""
    soft = edited(tmp_path, 'hinge1" stiffness="[^"]*"', 'hinge1" stiffness="3.906"')
    found = shown(capsys, str(soft))
    assert found["source"] == str(soft)
    assert found["beam"]["method"] == "finite elements"
    assert any("times at hinge 1" in remark for remark in found["remarks"])
    default = found["default"]
    for key, of_default in (("clamped_hz", P_CLAMPED), ("joint_free_hz", P_FREE)):
        exact = np.array(found[key]["exact"])
        np.testing.assert_allclose(default[key], of_default, rtol=TWELVE_DIGITS)
        assert exact[0] < default[key][0] * (1 - SHARE)  # softer than the default
        for model in ("chain", "assumed_modes"):
            assert np.abs(np.array(found[key][model]) / exact - 1).max() < CELL


def test_a_table_has_default_yours_and_change(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = CHAIN6.read_text().replace('timestep="0.001"', 'timestep="0.0005"')
    path = tmp_path / "stiff.xml"
    path.write_text(
        re.sub(
            r'stiffness="([^"]*)"', lambda m: f'stiffness="{1.44 * float(m[1])!r}"', text
        ).replace('timestep="0.001"', 'timestep="0.0005"')
    )
    assert main(["modes", str(path)]) == 0
    said = capsys.readouterr().out
    assert "The beam beside the written one" in said
    rows = said.splitlines()
    changed = {line[:28].strip(): line.split()[-2:] for line in rows if "%" in line}
    assert changed["EI (N m2)"] == ["+44.000", "%"]
    assert changed["clamped 1 (Hz)"] == changed["clamped 3 (Hz)"] == ["+20.000", "%"]
    assert main(["modes"]) == 0
    assert "The beam beside" not in capsys.readouterr().out


def test_mac_tells_shapes_apart() -> None:
    chain, beam = load_chain(CHAIN6), uniform_reference(P)
    shapes = vibration(chain, P).shapes
    assert (modal_assurance(chain, shapes, beam) > 0.989).all()
    exchanged = modal_assurance(chain, shapes[:, ::-1], beam)  # modes 3 and 1
    assert (exchanged[[0, 2]] < 0.5).all()


def test_too_few_hinges_are_refused(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    text = CHAIN6.read_text()
    for j in range(3, 7):
        text = text.replace(f'<joint name="hinge{j}"', f'<!--<joint name="hinge{j}"', 1)
        text = re.sub(rf'(<!--<joint name="hinge{j}"[^>]*/>)', r"\1-->", text)
        text = re.sub(rf'\s*<jointpos name="hinge{j}".*/>', "", text)
    text = re.sub(r"<keyframe>.*</keyframe>", "", text, flags=re.DOTALL)
    path = tmp_path / "two.xml"
    path.write_text(text)
    assert load_chain(path).model.nv == 4
    with pytest.raises(ModelError, match="has 2 hinges along the beam; at least 3 are needed"):
        run(ModesConfig(path))
    assert main(["modes", str(path)]) == 2
    said = capsys.readouterr()
    assert said.out == "" and said.err.count("\n") == 1 and "two.xml" in said.err


def test_tables_show_what_json_has(capsys: pytest.CaptureFixture[str]) -> None:
    found = shown(capsys)
    assert main(["modes"]) == 0
    text = capsys.readouterr().out
    for key in ("clamped_hz", "joint_free_hz"):
        assert all(f"{value:.6f}" in text for column in found[key].values() for value in column)
    assert f"{100 * found['coupling_error_max']:.3f} %" in text
    assert f"limit of {1e3 * found['step_limit']:.2f} ms" in text
