"""Tuning on chains: simulated in closed form where a file allows it, and rated on MuJoCo's."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from edits import edited

from flexsim import evaluate, reference, setting, trajectory
from flexsim.plants.chain_plant import ChainPlant, ClosedChainPlant
from flexsim.robot import Robot
from studies.main import main
from studies.tuning.individuals import ControllerDesign
from studies.tuning.problem import problem_of
from studies.tuning.tuning import Tuning

HELD = np.array(  # a tuned set for the circle, as a tuner draws it
    [8660.0, 0.06911, 1.235, 0.0297, 0.141, 103.7, 0.4938, 1.107, -0.07112, 0.1552]
)
SMALL = ("--trajectory", "circle", "--setting", "none", "--population", "8", "--survivors", "3")
REGULAR = 1e-9  # relative: without friction no rounding is amplified


def run_of(words, out, capsys):
    assert main(["tune", *SMALL, "--generations", "4", *words, "--out", str(out)]) == 0
    return capsys.readouterr().out


@pytest.mark.parametrize(
    ("plant", "simulated"),
    [
        ("both", ["assumed-modes", "closed-chain"]),
        ("chain", ["closed-chain"]),
        ("chain:4", ["closed-chain:4"]),
        ("untuned:8", ["closed-untuned:8"]),
    ],
)
def test_chains_are_simulated_in_closed_form_and_judged_by_mujoco(plant, simulated):
    problem = problem_of(Tuning(trajectory="circle", plant=plant))
    assert problem.simulated == simulated
    judges = [type(each) for each, _ in problem.judges]
    assert judges[-1] is ChainPlant and ClosedChainPlant not in judges
    assert len(problem.remarks) == 1 and "MuJoCo" in problem.remarks[0]


@pytest.mark.parametrize("plant", ["assumed-modes", "closed-chain", "rigid"])
def test_where_nothing_is_replaced_nothing_is_rated(plant):
    problem = problem_of(Tuning(trajectory="circle", plant=plant))
    assert problem.judges == () and problem.remarks == () and problem.rated(HELD) == {}


def test_a_file_that_the_equations_do_not_have_is_mujocos_and_said(tmp_path, capsys):
    file = tmp_path / "dry.xml"
    file.write_text(edited('<joint name="hinge2"', '<joint name="hinge2" frictionloss="1e-3"'))
    problem = problem_of(Tuning(trajectory="circle", plant="chain", mjcf=str(file)))
    assert type(problem.scenarios[0][0]) is ChainPlant and problem.judges == ()
    shown = run_of(["--plant", "chain", "--mjcf", str(file)], tmp_path / "run", capsys)
    assert shown.count("MuJoCo simulates the chain") == 1 and "hinge2" in shown
    assert json.loads((tmp_path / "run" / "config.json").read_text())["simulated"] == ["chain"]


def test_the_rating_is_the_index_on_mujocos_chain():
    problem = problem_of(Tuning(trajectory="circle", plant="both", setting="none"))
    rated = problem.rated(HELD)
    assert list(rated) == ["assumed-modes", "chain"]
    chain = Robot().plant("chain", setting("none"))
    circle = reference(trajectory("circle"), chain.parameters)
    filters = ControllerDesign().filters(HELD[None])
    own = evaluate(chain, setting("none"), circle, filters).indices[0]
    assert rated["chain"] == own
    assert max(rated.values()) == pytest.approx(problem(HELD[None]).indices[0], rel=REGULAR)


def test_a_run_says_what_was_simulated_rates_its_result_and_resumes(tmp_path, capsys):
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    draws = tmp_path / "near.toml"
    draws.write_text(  # near a set that holds, so that there is a best to be rated
        "".join(
            f"{name} = {{ normal = [{value}, {abs(value) * 1e-3}] }}\n"
            for name, value in zip(
                "k1 nu1 k2 nu2 k3 k4 nu4 k5 nu5 k6".split(), HELD.tolist(), strict=True
            )
        )
    )
    shown = run_of(["--plant", "both", "--distribution", str(draws)], whole, capsys)
    assert "chains are simulated in closed form, the result is rated on MuJoCo's" in shown
    config, result = (json.loads((whole / f"{n}.json").read_text()) for n in ("config", "result"))
    assert config["simulated"] == ["assumed-modes", "closed-chain"]
    assert set(result["rated"]) == {"assumed-modes", "chain"}
    assert result["rated_index"] == max(result["rated"].values())
    assert result["rated_index"] == pytest.approx(result["best_index"], rel=REGULAR)
    shutil.copytree(whole, cut)
    table = (cut / "generations.csv").read_bytes().splitlines(keepends=True)
    (cut / "generations.csv").write_bytes(b"".join(table[: 1 + 8 * 2]))
    (cut / "result.json").unlink()
    assert main(["tune", "--resume", str(cut), "--json"]) == 0
    again = json.loads(capsys.readouterr().out)
    assert again["simulated"] == config["simulated"] and again["rated"] == result["rated"]
    for name in ("generations.csv", "result.json", "convergence.csv"):
        assert Path(cut, name).read_bytes() == Path(whole, name).read_bytes()
