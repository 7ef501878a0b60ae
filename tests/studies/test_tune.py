"""Tuning on the plants, and the command: runs that can be killed, continued and read."""

import csv
import hashlib
import json
import os
import shutil
import signal
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from processes import PATIENCE, flexsim, wait_for
from rerun.chunk import RrdReader
from trial_controllers import TRIAL

from controllers import Controller, Gains, textbook_pid
from flexsim import ParameterError, Parameters, evaluate, reference, setting, trajectory
from flexsim.loop.runs import thread_count
from flexsim.plants.modes_plant import AssumedModesPlant
from studies.core.folders.locking import locked
from studies.main import main
from studies.tuning import tune as tune_module
from studies.tuning.distributions import LOG_UNIFORM, NAMES, TABLE_1
from studies.tuning.individuals import SI_NAMES, ControllerDesign, in_si
from studies.tuning.problem import distribution_for, problem_of, tune
from studies.tuning.scenarios import perturbations
from studies.tuning.tuning import Tuning

ROUNDING = 1e-14  # relative to the largest tap: two orders of summation of eleven terms
SMALL = ("--population", "8", "--survivors", "3", "--generations", "40", "--patience", "40")
KILLED_AFTER = 3  # generations
OUTPUTS = {"config.json", "generations.csv", "convergence.csv", "convergence.rrd", "result.json"}
HELD = np.array(  # TRIAL["circle"] as a tuner draws it
    [8660.0, 0.06911, 1.235, 0.0297, 0.141, 103.7, 0.4938, 1.107, -0.07112, 0.1552]
)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A run that was never interrupted."""
    run = tmp_path_factory.mktemp("tune") / "whole"
    assert main(["tune", "--trajectory", "circle", *SMALL, "--seed", "5", "--out", str(run)]) == 0
    return run


@pytest.fixture
def copied(finished, tmp_path):
    """A copy of it, to be spoilt."""
    return Path(shutil.copytree(finished, tmp_path / "copy"))


def digest(folder):
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def lines_of(run):
    return (run / "generations.csv").read_bytes().splitlines(keepends=True)


def keep_generations(run, count, torn=b""):
    """Leave a run as if killed: so many generations of 8, and a torn rest."""
    kept = lines_of(run)[: 1 + 8 * count]
    (run / "generations.csv").write_bytes(b"".join(kept) + torn)
    (run / "result.json").unlink()


def controllers_own(row, realisation):
    halves = (Gains.from_milliseconds(*part) for part in (row[:5], row[5:]))
    return Controller("", *halves, "").filters(1e-3, realisation)


@pytest.mark.parametrize("realisation", ["tustin", "gruenwald-letnikov"])
def test_population_filters_are_the_controllers_own(realisation):
    sample = TABLE_1.sample(np.random.default_rng(1), 40)
    sample[0, [1, 3, 6, 8]] = (1.0, -1.0, 0.0, 2.0)  # integer orders, poles of the Gamma form
    for row, pair in zip(
        sample, ControllerDesign(realisation=realisation).filters(sample), strict=True
    ):
        for (b, a), (b_own, a_own) in zip(pair, controllers_own(row, realisation), strict=True):
            assert np.array_equal(a, a_own)
            assert np.abs(b - b_own).max() <= ROUNDING * np.abs(b_own).max()


def test_the_other_realisations_are_the_controllers():
    sample = np.array([HELD, HELD])
    sample[1, [1, 3, 6, 8]] = 101.0  # an order that controllers refuse
    good, refused = ControllerDesign(realisation="oustaloup", terms=3).filters(sample)
    halves = (Gains.from_milliseconds(*part) for part in (HELD[:5], HELD[5:]))
    own = Controller("", *halves, "").filters(1e-3, "oustaloup", 3)
    for (b, a), (b_own, a_own) in zip(good, own, strict=True):
        assert np.allclose(b, b_own, rtol=1e-12)
        assert np.allclose(a, a_own, rtol=1e-12)
    assert refused is None


def test_the_textbook_pid_gets_its_gains_in_si():
    row = np.array([[1e4, 1, 2.0, -1, 3.0, 100.0, 1, 0.5, -1, 0.1]])
    ((first, second),) = ControllerDesign("pid", "textbook").filters(row)
    for (b, a), (kp, ki, kd) in ((first, (3.0, 2000.0, 10.0)), (second, (0.1, 500.0, 0.1))):
        own_b, own_a = textbook_pid(kp, ki, kd, 1e-3)
        assert np.allclose(b, own_b) and np.array_equal(a, own_a)


def test_what_no_filter_can_be_built_from_counts_as_diverged_at_once():
    sample = np.array([HELD, HELD, HELD])
    sample[1, 1] = 101.0
    sample[2, 0] = np.inf
    assert [pair is None for pair in ControllerDesign().filters(sample)] == [False, True, True]
    scores = problem_of(Tuning(trajectory="circle"))(sample)
    assert np.isfinite(scores.indices).tolist() == [True, False, False]
    assert scores.diverged[1:].tolist() == [0.0, 0.0]
    assert np.isinf(problem_of(Tuning())(sample[1:]).indices).all()


def test_the_index_is_the_closed_loops():
    robot = Parameters()
    circle = reference(trajectory("circle"), robot)
    filters = [TRIAL["circle"].filters(1e-3)]
    outcome = evaluate(AssumedModesPlant(robot), setting("simulink"), circle, filters)
    scores = problem_of(Tuning(trajectory="circle"))(HELD[None])
    assert scores.indices == pytest.approx(outcome.indices, rel=1e-9)
    assert np.isnan(scores.diverged).all()


def test_both_is_the_worse_of_the_two():
    sample = np.vstack([HELD, TABLE_1.sample(np.random.default_rng(3), 5)])
    each = {
        plant: problem_of(Tuning(trajectory="circle", plant=plant))(sample)
        for plant in ("assumed-modes", "chain", "both")
    }
    worse = np.maximum(each["assumed-modes"].indices, each["chain"].indices)
    assert np.array_equal(each["both"].indices, worse)
    first = np.fmin(each["assumed-modes"].diverged, each["chain"].diverged)
    assert np.array_equal(each["both"].diverged, first, equal_nan=True)
    assert np.isfinite(worse[0])


def test_perturbed_is_the_worst_of_all_robots():
    tuning = Tuning(trajectory="circle", perturb=3)
    problem = problem_of(tuning)
    assert len(problem.scenarios) == 4
    plants = [plant.parameters for plant, _ in problem.scenarios]
    assert plants[0] == Parameters()
    assert len({(p.EI, p.rho) for p in plants}) == 4
    nominal = problem_of(Tuning(trajectory="circle"))(HELD[None])
    assert problem(HELD[None]).indices[0] >= nominal.indices[0]


def test_perturbations_stay_in_their_bounds_and_follow_the_seed():
    def drawn(seed, payload=0.03):
        return perturbations(
            Tuning(perturb=50, perturb_spread=0.1, perturb_payload=payload, seed=seed)
        )

    found = np.array(drawn(1))
    assert np.abs(found[:, :3] - 1).max() <= 0.1 and np.ptp(found[:, :3], axis=0).min() > 0.15
    assert found[:, 3].min() >= 0 and 0.02 < found[:, 3].max() <= 0.03
    assert drawn(1) == drawn(1) != drawn(2)
    assert np.array(drawn(1, payload=0.0))[:, 3].max() == 0.0


def test_perturbed_robots_carry_their_factors_on_both_plants():
    tuning = Tuning(trajectory="circle", plant="both", perturb=2)
    (modes, _), _, *others = problem_of(tuning).scenarios
    for each, (plant, its) in zip(np.repeat(perturbations(tuning), 2, axis=0), others, strict=True):
        p = plant.parameters
        assert p.EI / 0.349 == pytest.approx(each[0], rel=1e-12)
        assert p.m_b == pytest.approx(each[1] * modes.parameters.m_b, rel=1e-12)
        assert p.payload == each[3] and p.zeta == modes.parameters.zeta
        assert its.friction.tau_0[0] / 4.56 == pytest.approx(each[2])
        assert its.friction.mu[1] / 1.0231 == pytest.approx(each[2])
        assert its.friction.dead_zone[0][0] / -3.2379 == pytest.approx(each[2])


def test_weights_and_period_reach_the_index():
    plain = problem_of(Tuning(trajectory="circle"))(HELD[None]).indices
    doubled = problem_of(Tuning(trajectory="circle", weights=(2, 2, 2)))(HELD[None]).indices
    slower = problem_of(Tuning(trajectory="circle", period=2e-3))
    assert doubled == pytest.approx(2 * plain)
    assert slower.reference.time[1] == 2e-3


def test_gains_are_in_milliseconds_and_stored_in_si_too():
    si = in_si(HELD[None])[0]
    published = TRIAL["circle"]
    assert si[:5] == pytest.approx(list(vars(published.joint1).values()))
    assert si[5:] == pytest.approx(list(vars(published.joint2).values()))


@pytest.mark.skipif(thread_count() < 2, reason="one core only")
def test_any_number_of_threads_gives_the_same_search():
    tuning = Tuning(trajectory="circle", population=10, survivors=3, generations=5)
    one, two = (tune(problem_of(tuning, threads), TABLE_1, tuning.genetic, 2) for threads in (1, 2))
    for first, second in zip(one.generations, two.generations, strict=True):
        assert np.array_equal(first.population, second.population)
        assert np.array_equal(first.indices, second.indices)
        assert np.array_equal(first.diverged, second.diverged, equal_nan=True)


def test_pids_of_table_1_find_nothing_while_textbook_ones_drawn_log_uniformly_hold():
    sample = np.random.default_rng(1)
    printed = problem_of(Tuning(controller="pid"))
    assert np.isinf(printed(TABLE_1.with_integer_orders().sample(sample, 50)).indices).all()
    textbook = problem_of(Tuning(controller="pid", realisation="textbook"))
    drawn = LOG_UNIFORM.with_integer_orders().sample(sample, 50)
    assert np.isfinite(textbook(drawn).indices).mean() > 0.5


def test_the_run_explains_itself(finished):
    assert OUTPUTS <= set(digest(finished))
    assert (finished / "figures" / "convergence.png").stat().st_size > 10_000
    config = json.loads((finished / "config.json").read_text())
    assert config["question"].startswith("How good can the controllers be made: ")
    assert json.loads((finished / "result.json").read_text())["answer"].startswith("best index ")
    assert config["configuration"]["seed"] == 5
    assert config["distribution"]["k1"] == {"normal": [10000.0, 2000.0]}
    assert set(config["units"]) >= {"index", "diverged_at"}
    assert "cma" in config["versions"]


def test_every_individual_is_in_the_table(finished):
    with (finished / "generations.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    result = json.loads((finished / "result.json").read_text())
    assert len(rows) == 8 * result["generations"]
    assert sum(row["origin"] != "survivor" for row in rows) == result["evaluations"]
    diverged = [row for row in rows if row["diverged_at"]]
    assert diverged and all(row["index"] == "inf" for row in diverged)
    best = min(rows, key=lambda row: float(row["index"]))
    assert float(best["index"]) == result["best_index"]
    assert {name: float(best[name]) for name in NAMES} == result["best_parameters"]
    assert set(SI_NAMES) <= set(best)
    assert float(best["k1_si"]) == result["best_parameters_si"]["k1"]


def test_the_recording_has_a_generation_timeline(finished):
    chunks = list(RrdReader(finished / "convergence.rrd").store().stream())
    rows = {}
    for chunk in chunks:
        if "generation" in chunk.timeline_names:
            rows[chunk.entity_path] = chunk.num_rows
    assert set(rows) == {
        "/convergence/best",
        "/convergence/median",
        "/convergence/stable",
    }
    generations = json.loads((finished / "result.json").read_text())["generations"]
    assert rows["/convergence/stable"] == generations


@contextmanager
def started(run):
    """Give the command in a process of its own that has written some generations."""
    arguments = ["tune", "--trajectory", "circle", *SMALL, "--seed", "5", "--out", str(run)]
    arguments += ["--threads", "1"]  # slower, and leaves a core for those who watch
    table = run / "generations.csv"

    def written():
        return table.exists() and table.read_bytes().count(b"\n") > 8 * KILLED_AFTER

    with flexsim(*arguments) as process:
        wait_for(written, process)
        yield process


def assert_same_run(run, whole):
    for name in ("generations.csv", "result.json", "convergence.csv"):
        assert (run / name).read_bytes() == (whole / name).read_bytes(), name


def test_a_killed_run_continues_to_the_same_bits(finished, tmp_path):
    run = tmp_path / "killed"
    with started(run) as process:
        process.send_signal(signal.SIGKILL)
        assert process.wait(PATIENCE) == -signal.SIGKILL
    written = lines_of(run)
    assert written == lines_of(finished)[: len(written)]
    assert 8 * KILLED_AFTER < len(written) < len(lines_of(finished))
    assert not (run / "result.json").exists()
    assert main(["tune", "--resume", str(run), "--threads", "1"]) == 0
    assert_same_run(run, finished)


@pytest.mark.slow  # as of flexsim run, and as killed, above
def test_ctrl_c_says_how_to_continue(finished, tmp_path):
    run = tmp_path / "interrupted"
    with started(run) as process:
        process.send_signal(signal.SIGINT)
        _, complaint = process.communicate(timeout=PATIENCE)
        assert process.returncode == 130
    assert complaint.count("\n") == 1
    assert f"--resume {run}" in complaint
    assert main(["tune", "--resume", str(run)]) == 0
    assert_same_run(run, finished)


@pytest.mark.parametrize("kept, torn", [(0, 700), (1, 300), (7, 1)])
def test_a_torn_generation_is_recognised_and_dropped(finished, copied, kept, torn):
    rest = b"".join(lines_of(copied)[1 + 8 * kept :])
    keep_generations(copied, kept, rest[:torn])
    assert main(["tune", "--resume", str(copied)]) == 0
    assert_same_run(copied, finished)


def test_a_last_line_without_its_end_is_torn(finished, copied):
    whole = b"".join(lines_of(copied))
    (copied / "generations.csv").write_bytes(whole[:-1])
    assert main(["tune", "--resume", str(copied)]) == 0
    assert_same_run(copied, finished)


def test_a_finished_run_stays_as_it_is(finished, copied, capsys):
    assert main(["tune", "--resume", str(copied), "--json"]) == 0
    assert digest(copied) == digest(finished)
    result = json.loads(capsys.readouterr().out)
    for name in (
        "best_index",
        "best_parameters",
        "generations",
        "evaluations",
        "stable_share",
        "run",
    ):
        assert name in result


def empty(path):
    path.write_bytes(b"")


def half(path):
    path.write_bytes(path.read_bytes()[:50])


@pytest.mark.parametrize(
    "spoil, name",
    [
        (empty, "result.json"),
        (half, "result.json"),
        (Path.unlink, "result.json"),
        (Path.unlink, "convergence.csv"),
        (Path.unlink, "convergence.rrd"),
        (lambda path: shutil.rmtree(path.parent), "figures/convergence.png"),
    ],
)
def test_results_that_are_missing_or_torn_are_written_anew(copied, finished, spoil, name):
    spoil(copied / name)
    assert main(["tune", "--resume", str(copied)]) == 0
    assert_same_run(copied, finished)
    assert set(digest(copied)) == set(digest(finished))


def test_a_run_at_work_is_left_to_its_process(finished, copied, capsys):
    keep_generations(copied, 3)
    before = digest(copied)
    with locked(copied):
        for words in (["--resume", str(copied)], ["--out", str(copied), "--force"]):
            assert main(["tune", *words]) == 2
            complaint = capsys.readouterr().err
            assert complaint.count("\n") == 1 and "another process" in complaint
        assert digest(copied) == before
    assert main(["tune", "--resume", str(copied)]) == 0
    assert_same_run(copied, finished)


@pytest.mark.parametrize("tuner", ["cma", "de"])
def test_peers_continue_to_the_same_bits(tuner, tmp_path, capsys):
    whole, run = tmp_path / "whole", tmp_path / "cut"
    small = [
        *("--trajectory", "circle", "--tuner", tuner, "--population", "8"),
        *("--generations", "6", "--survivors", "3"),
    ]
    assert main(["tune", *small, "--out", str(whole)]) == 0
    shutil.copytree(whole, run)
    keep_generations(run, 2, b"2,0,cma,1")
    assert main(["tune", "--resume", str(run)]) == 0
    assert_same_run(run, whole)


def test_a_search_that_finds_nothing_says_so(tmp_path, capsys):
    run = tmp_path / "run"
    small = ["--controller", "pid", "--population", "8", "--generations", "2", "--out", str(run)]
    assert main(["tune", *small]) == 0
    assert "every individual diverged" in capsys.readouterr().out
    result = json.loads((run / "result.json").read_text())
    assert (result["best_index"], result["best_parameters"]) == (None, None)
    assert result["stable_share"] == 0


@pytest.mark.parametrize(
    "options, word",
    [
        (["--trajectory", "square"], "two-loop"),
        (["--plant", "beam"], "rigid"),
        (["--controller", "pd"], "fractional"),
        (["--realisation", "padé"], "tustin"),
        (["--realisation", "textbook"], "pid"),
        (["--setting", "ice"], "opposing"),
        (["--setting", "print"], "jump"),
        (["--tuner", "hillclimb"], "genetic"),
        (["--distribution", "table-9"], "log-uniform"),
        (["--controller", "pid", "--realisation", "textbook", "--terms", "5"], "--terms"),
        (["--filter-time", "0.001"], "--filter-time|filter time"),
        (["--perturb-spread", "0.1"], "--perturb"),
        (["--perturb", "-1"], "perturb"),
        (["--tuner", "cma", "--patience", "5"], "--patience"),
        (["--tuner", "de", "--population", "4", "--survivors", "2"], "population"),
        (["--segments", "8"], "--segments"),
        (["--plant", "chain", "--modes", "2"], "--modes"),
        (["--plant", "chain:6", "--segments", "8"], "--segments"),
        (["--plant", "assumed-modes:3", "--modes", "4"], "--modes"),
        (["--plant", "chain", "--segments", "0"], "segments"),
        (["--terms", "100000"], "5000"),
        (["--population", "5"], "survivors"),
        (["--generations", "0"], "generations"),
        (["--period", "0.0015"], "period"),
        (["--period", "0"], "period"),
        (["--weights", "1", "1", "-1"], "weights"),
        (["--terms", "0"], "terms"),
        (["--seed", "-1"], "seed"),
        (["--threads", "0"], "threads"),
        (["--threads", "1000"], "threads"),
        (["--resume", "RUN", "--force"], "--resume"),
    ],
)
def test_bad_options_get_one_line_and_write_nothing(tmp_path, capsys, options, word):
    run = tmp_path / "run"
    assert main(["tune", *options, "--out", str(run)]) == 2
    complaint = capsys.readouterr().err
    assert complaint.count("\n") == 1
    assert any(each in complaint for each in word.split("|"))
    assert list(tmp_path.iterdir()) == []


def test_a_run_refused_by_its_first_generation_leaves_nothing(tmp_path, capsys, monkeypatch):
    """Neither its folder, nor the parents that it would have made."""

    def refuse(*_):
        raise ParameterError("no individual can be simulated")

    monkeypatch.setattr(tune_module, "tune", refuse)
    assert main(["tune", "--out", str(tmp_path / "new" / "deep" / "run")]) == 2
    assert capsys.readouterr().err == "flexsim: no individual can be simulated\n"
    assert list(tmp_path.iterdir()) == []


def test_force_replaces_a_finished_run_alone(finished, copied, capsys):
    """Its marker names all that it wrote; what somebody put there keeps the whole run."""
    (copied / "notes").write_text("dear")
    words = ["tune", "--trajectory", "circle", *SMALL, "--seed", "5", "--force", "--out"]
    assert main([*words, str(copied)]) == 2
    assert "holds notes, which the run did not write" in capsys.readouterr().err
    (copied / "notes").unlink()
    assert main([*words, str(copied)]) == 0
    assert_same_run(copied, finished)


def test_generations_behind_a_link_are_refused(copied, tmp_path, capsys):
    (copied / "generations.csv").rename(tmp_path / "mine")
    (copied / "generations.csv").symlink_to(tmp_path / "mine")
    before = (tmp_path / "mine").read_bytes()
    assert main(["tune", "--resume", str(copied)]) == 2
    assert "is a symbolic link" in capsys.readouterr().err
    assert (tmp_path / "mine").read_bytes() == before


@pytest.mark.parametrize("given", ["/dev/zero", "pipe.toml", "folder.toml", "huge.toml"])
def test_a_distribution_that_is_no_small_file_is_refused(tmp_path, capsys, given):
    os.mkfifo(tmp_path / "pipe.toml")
    (tmp_path / "folder.toml").mkdir()
    with (tmp_path / "huge.toml").open("wb") as file:
        file.truncate(1 << 40)
    (tmp_path / "zero.toml").symlink_to("/dev/zero")
    name = tmp_path / (given if given.endswith("toml") else "zero.toml")
    assert main(["tune", "--distribution", str(name), "--out", str(tmp_path / "run")]) == 2
    complaint = capsys.readouterr().err
    assert complaint.startswith(f"flexsim: {name}: cannot read the distribution: it ")
    assert complaint.count("\n") == 1


def test_orders_given_for_pids_are_refused(tmp_path):
    draws = tmp_path / "draws.toml"
    draws.write_text("nu1 = { normal = [0.5, 0.1] }")
    with pytest.raises(ParameterError, match="nu1"):
        distribution_for(Tuning(controller="pid", distribution=str(draws)))
    draws.write_text("k1 = { normal = [5, 1] }")
    assert distribution_for(Tuning(controller="pid", distribution=str(draws)))


def spoil_version(run):
    config = json.loads((run / "config.json").read_text())
    config["versions"]["numpy"] = "1.0"
    (run / "config.json").write_text(json.dumps(config))


def other_sources(run):
    config = json.loads((run / "config.json").read_text())
    config["versions"]["sources"] = "0123456789abcdef"
    (run / "config.json").write_text(json.dumps(config))


def spoil_config(run):
    text = (run / "config.json").read_text()
    (run / "config.json").write_text(text[: len(text) // 2])


def spoil_setting(run):
    config = json.loads((run / "config.json").read_text())
    config["configuration"]["population"] = "eight"
    (run / "config.json").write_text(json.dumps(config))


def other_study(run):
    config = json.loads((run / "config.json").read_text())
    config["configuration"] = {"out": "x"}
    (run / "config.json").write_text(json.dumps(config))


def spoil_middle(run):
    lines = lines_of(run)
    lines[10] = b"1,1,mutant,oops\n"
    (run / "generations.csv").write_bytes(b"".join(lines))


def change_config(section, **values):
    def spoil(run):
        config = json.loads((run / "config.json").read_text())
        if section:
            config[section] |= values
        else:
            config |= values
        (run / "config.json").write_text(json.dumps(config))

    return spoil


def change_cell(line, column, text):
    def spoil(run):
        lines = [each.decode().rstrip("\n").split(",") for each in lines_of(run)]
        lines[line][lines[0].index(column)] = text
        (run / "generations.csv").write_text("\n".join(map(",".join, lines)) + "\n")

    return spoil


def add_cell(run):
    lines = lines_of(run)
    lines[3] = lines[3].rstrip(b"\n") + b",1\n"
    (run / "generations.csv").write_bytes(b"".join(lines))


def add_generations(run):
    lines = lines_of(run)
    more = [b"%d,%s" % (n, line.split(b",", 1)[1]) for n in range(50) for line in lines[1:9]]
    (run / "generations.csv").write_bytes(lines[0] + b"".join(more))


def spoil_header(run):
    (run / "generations.csv").write_bytes(b"".join(lines_of(run)[1:]))


@pytest.mark.parametrize(
    "spoil, options, word",
    [
        (spoil_version, [], "numpy"),
        (other_sources, [], "sources"),
        (spoil_config, [], "damaged"),
        (spoil_setting, [], "config.json"),
        (other_study, [], "not of flexsim tune"),
        (spoil_middle, [], "generation 1"),
        (spoil_header, [], "header"),
        (change_config(None, versions=[]), [], "python"),
        (change_config(None, distribution=None), [], "config.json"),
        (change_config(None, configuration=3), [], "config.json"),
        (change_config("configuration", population=8.0), [], "population"),
        (change_config("configuration", weights=None), [], "config.json"),
        (change_config("distribution", k1=None), [], "k1"),
        (change_cell(5, "index", "nan"), [], "generation 0"),
        (change_cell(5, "origin", "stork"), [], "generation 0"),
        (change_cell(9, "index", "1e-9"), [], "generation 1"),  # of a survivor
        (change_cell(9, "k1", "1e4"), [], "generation 1"),
        (add_cell, [], "generation 0"),
        (add_generations, [], "40 generations"),
        (shutil.rmtree, [], "not a run"),
        (lambda run: (run / "generations.csv").unlink(), [], "generations.csv"),
        (lambda run: (run / "config.json").unlink(), [], "not a run"),
        (lambda run: None, ["--seed", "1"], "--seed"),
        (lambda run: None, ["--robot.payload", "0.1"], "--robot.payload 0.1 contradicts"),
        (lambda run: None, ["--trajectory", "line"], "--trajectory"),
        (lambda run: None, ["--generations", "50"], "--generations"),
        (lambda run: None, ["--threads", "0"], "threads"),
    ],
)
def test_runs_that_cannot_be_continued_stay_as_they_are(copied, capsys, spoil, options, word):
    spoil(copied)
    before = digest(copied)
    assert main(["tune", "--resume", str(copied), *options]) == 2
    complaint = capsys.readouterr().err
    assert complaint.count("\n") == 1
    assert word in complaint
    assert digest(copied) == before


def test_options_that_agree_with_the_run_may_be_repeated(copied, finished):
    assert main(["tune", "--resume", str(copied), "--seed", "5", "--trajectory", "circle"]) == 0
    assert digest(copied) == digest(finished)


def test_an_existing_run_is_replaced_only_by_force(copied, capsys):
    before = digest(copied)
    assert main(["tune", "--out", str(copied)]) == 2
    assert main(["tune", "--out", str(copied), "--force", "--population", "5"]) == 2
    assert digest(copied) == before
    assert capsys.readouterr().err.count("\n") == 2
    small = ["--population", "8", "--generations", "2"]
    assert main(["tune", "--out", str(copied), "--force", *small]) == 0
    assert digest(copied) != before


def test_a_run_on_the_chain_keeps_its_mjcf(tmp_path):
    run = tmp_path / "run"
    small = ["--population", "7", "--generations", "1", "--plant", "chain", "--out", str(run)]
    assert main(["tune", *small]) == 0
    assert "<mujoco" in (run / "chain.xml").read_text()
    (run / "chain.xml").write_text("<mujoco/>")
    before = digest(run)
    assert main(["tune", "--resume", str(run)]) == 2
    assert digest(run) == before
    assert not any(name.startswith("MUJOCO_LOG") for name in os.listdir("."))
