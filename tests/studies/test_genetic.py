"""The genetic algorithm step by step against section 3.2, and its peers, on problems made up."""

import numpy as np
import pytest
from scipy import stats

from flexsim import ParameterError, RunError
from studies.tuning.distributions import (
    LOG_UNIFORM,
    NAMES,
    TABLE_1,
    Distribution,
    Draw,
    distribution,
)
from studies.tuning.genetic import (
    CROSSOVER,
    FRESH,
    INITIAL,
    MUTANT,
    SURVIVOR,
    Generation,
    GeneticSettings,
    Scores,
    best_of,
    breed,
    crossover,
    generation_rng,
    has_stalled,
    mutate,
    mutation_chances,
    mutation_deviation,
    next_generation,
    offspring_counts,
    ranking,
    run_genetic,
)
from studies.tuning.peers import peer_generations, run_cma, run_de

CHANCE = 1e-3  # of a statistical test failing by bad luck; the seeds are fixed, so it never does
DRAWS = 4000
PRINTED_MEANS = (1e4, 0, 1, 0, 1e-2, 1e2, 0, 1, 0, 1e-2)  # Table 1
PRINTED_DEVIATIONS = (2000, 2, 0.1, 0.1, 0.1, 20, 2, 0.1, 0.1, 0.1)
OPTIMUM = np.array([1.1e4, 0.5, 1.05, 0.02, 0.0, 90.0, 0.3, 0.95, 0.05, 0.0])
TUNERS = (run_genetic, run_cma, run_de)


def bowl(parameters):
    """A quadratic around OPTIMUM in standard deviations of Table 1, diverged far from it."""
    far = (((parameters - OPTIMUM) / np.array(PRINTED_DEVIATIONS)) ** 2).sum(axis=1)
    return Scores(np.where(far > 12, np.inf, far), np.where(far > 12, 0.5, np.nan), 0 * far)


def hopeless(parameters):
    none = np.zeros(len(parameters))
    return Scores(np.full(len(parameters), np.inf), none, none)


def test_defaults_are_the_papers():
    settings = GeneticSettings()
    assert (settings.population, settings.generations, settings.patience) == (50, 100, 10)
    assert settings.survivors == 6
    assert settings.budget == 50 + 99 * 44


def test_table_1_is_drawn():
    sample = TABLE_1.sample(np.random.default_rng(1), DRAWS)
    for j, (mean, deviation) in enumerate(zip(PRINTED_MEANS, PRINTED_DEVIATIONS, strict=True)):
        assert TABLE_1.draws[j] == Draw("normal", (mean, deviation))
        assert stats.kstest(sample[:, j], "norm", (mean, deviation)).pvalue > CHANCE


def test_integer_orders_are_forced_and_the_gains_kept():
    integer = TABLE_1.with_integer_orders()
    sample = integer.sample(np.random.default_rng(1), 7)
    for name, nu in (("nu1", 1), ("nu2", -1), ("nu4", 1), ("nu5", -1)):
        assert (sample[:, NAMES.index(name)] == nu).all()
    assert [integer.draws[j] for j in integer.free] == [TABLE_1.draws[j] for j in integer.free]
    assert [NAMES[j] for j in integer.free] == ["k1", "k2", "k3", "k4", "k5", "k6"]


def test_log_uniform_gains():
    sample = LOG_UNIFORM.sample(np.random.default_rng(1), DRAWS)[:, 0]
    low, high = np.log(LOG_UNIFORM.draws[0].numbers)
    assert stats.kstest(np.log(sample), "uniform", (low, high - low)).pvalue > CHANCE


def test_half_mutants_a_quarter_crossed_a_quarter_fresh():
    assert offspring_counts(44) == (22, 11, 11)
    assert all(sum(offspring_counts(n)) == n for n in range(1, 100))


def test_fewer_mutations_are_exponentially_likelier():
    chances = mutation_chances(10)
    assert chances.sum() == pytest.approx(1)
    assert chances[1:] / chances[:-1] == pytest.approx(chances[1] / chances[0])
    rng, parent = np.random.default_rng(2), np.ones(10)
    mutants = [mutate(parent, np.arange(10), rng) for _ in range(DRAWS)]
    changed = np.array([(mutant != parent).sum() for mutant in mutants])
    seen = np.bincount(changed, minlength=11)[1:]
    pooled = [*seen[:6], seen[6:].sum()], [*chances[:6], chances[6:].sum()]
    assert stats.chisquare(pooled[0], DRAWS * np.array(pooled[1])).pvalue > CHANCE


def test_every_parameter_is_as_likely_to_mutate():
    rng, parent = np.random.default_rng(3), np.ones(10)
    changed = sum((mutate(parent, np.arange(10), rng) != parent) for _ in range(DRAWS))
    assert stats.chisquare(changed).pvalue > CHANCE


@pytest.mark.parametrize("value", [1e4, 1.0, -0.5, 1e-2])
def test_a_mutations_variance_is_a_tenth_of_the_magnitude(value):
    rng = np.random.default_rng(4)
    parent = np.array([value])
    changes = np.array([mutate(parent, np.arange(1), rng)[0] - value for _ in range(DRAWS)])
    assert stats.kstest(changes, "norm", (0.0, np.sqrt(abs(value) / 10))).pvalue > CHANCE


def test_zero_never_mutates():
    assert mutation_deviation(np.zeros(3)).tolist() == [0, 0, 0]


def test_fixed_parameters_do_not_mutate():
    integer = TABLE_1.with_integer_orders()
    rng = np.random.default_rng(5)
    parent = integer.sample(rng, 1)[0]
    mutants = np.array([mutate(parent, integer.free, rng) for _ in range(200)])
    fixed = np.setdiff1d(np.arange(10), integer.free)
    assert (mutants[:, fixed] == parent[fixed]).all()
    assert (mutants != parent).any(axis=0)[integer.free].all()


def test_descendants_take_each_parameter_from_one_of_two_survivors_evenly():
    survivors = np.arange(6)[:, None] * np.ones(10)  # a parent's number in every parameter
    rng = np.random.default_rng(6)
    children = np.array([crossover(survivors, rng) for _ in range(DRAWS)])
    assert all(len(set(child)) <= 2 for child in children)
    pairs = [tuple(sorted(set(child))) for child in children if len(set(child)) == 2]
    seen = np.unique(pairs, axis=0, return_counts=True)[1]
    assert len(seen) == 15  # of 6 survivors
    assert stats.chisquare(seen).pvalue > CHANCE
    first = (children == children[:, :1]).sum(axis=1)
    expected = stats.binom.pmf(np.arange(10), 9, 0.5) * DRAWS  # nine others agree with the first
    assert stats.chisquare(np.bincount(first, minlength=11)[1:], expected).pvalue > CHANCE


def test_the_diverged_rank_last_and_ties_in_order():
    indices = np.array([np.inf, 2.0, np.nan, 1.0, np.inf, 1.0])
    assert ranking(indices).tolist() == [3, 5, 1, 0, 2, 4]


def test_a_generation_is_bred_from_the_survivors_alone():
    survivors = TABLE_1.sample(np.random.default_rng(7), 6)
    children, origins = breed(survivors, 44, TABLE_1, np.random.default_rng(8))
    assert [origins.count(kind) for kind in (MUTANT, CROSSOVER, FRESH)] == [22, 11, 11]
    for child, origin in zip(children, origins, strict=True):
        shared = (child == survivors).any(axis=0).sum()
        if origin == CROSSOVER:
            assert shared == 10
        if origin == FRESH:
            assert shared == 0


BRED = 200  # generations bred, for statistics
FAR_APART = 1e6 * np.arange(1, 7)[:, None] * np.ones(10)  # survivors that no mutation can confuse


def bred(kind, survivors=FAR_APART):
    """All children of a kind in many generations bred from the same survivors (K, 10)."""
    found = []
    for number in range(BRED):
        children, origins = breed(survivors, 44, TABLE_1, generation_rng(1, number))
        found.append(children[np.array(origins) == kind])
    return np.vstack(found)


def test_mutants_come_from_every_survivor_alike():
    parents = np.rint(np.median(bred(MUTANT), axis=1) / 1e6).astype(int)
    assert stats.chisquare(np.bincount(parents, minlength=7)[1:]).pvalue > CHANCE


def test_all_pairs_of_survivors_have_descendants():
    pairs = {tuple(sorted(set(child))) for child in bred(CROSSOVER)}
    assert len({pair for pair in pairs if len(pair) == 2}) == 15


def test_fresh_individuals_are_new_in_every_generation():
    fresh = bred(FRESH)
    assert len(np.unique(fresh, axis=0)) == len(fresh) == 11 * BRED


def test_parameters_that_mutate_together_do_so_independently():
    rng, parent = np.random.default_rng(9), np.ones(2)
    changes = np.array([mutate(parent, np.arange(2), rng) - 1 for _ in range(DRAWS)])
    both = changes[(changes != 0).all(axis=1)]
    assert len(both) > DRAWS / 4
    assert abs(stats.pearsonr(*both.T).statistic) < 4 / np.sqrt(len(both))


def test_one_more_mutation_is_half_as_likely():
    chances = mutation_chances(10)  # assumed; the paper says 'exponentially'
    assert chances[1:] / chances[:-1] == pytest.approx(0.5)


def test_only_the_best_reproduce_and_keep_their_scores():
    """The six best are scattered over the last generation, each with a time of divergence."""
    population = 1e6 * np.arange(1, 51)[:, None] * np.ones(10)
    indices = np.random.default_rng(10).permutation(50).astype(float)
    diverged = 0.1 * np.arange(50)
    last = Generation(3, population, (FRESH,) * 50, indices, diverged, np.zeros(50))
    new = next_generation(bowl, TABLE_1, 6, 1, last)
    best = np.argsort(indices)[:6]
    assert not set(best) <= set(range(6))
    assert np.array_equal(new.population[:6], population[best])
    assert np.array_equal(new.indices[:6], indices[best])
    assert np.array_equal(new.diverged[:6], diverged[best])
    for kind in (MUTANT, CROSSOVER):
        children = new.population[np.array(new.origins) == kind]
        numbers = set(np.rint(children / 1e6).astype(int).ravel() - 1)
        assert numbers <= set(best)
    assert new.number == 4
    scores = bowl(new.population[6:])
    assert np.array_equal(new.indices[6:], scores.indices)
    assert np.array_equal(new.diverged[6:], scores.diverged, equal_nan=True)


def test_generations_that_do_not_follow_each_other_are_refused():
    settings = GeneticSettings(population=12, generations=8, survivors=4)
    whole = run_genetic(bowl, TABLE_1, settings, 3).generations
    with pytest.raises(RunError, match="generation 2"):
        run_genetic(bowl, TABLE_1, settings, 3, resume_from=(*whole[:1], whole[2]))


def test_elitism_keeps_the_six_best_with_their_scores():
    search = run_genetic(bowl, TABLE_1, GeneticSettings(generations=6), seed=1)
    for before, after in zip(search.generations, search.generations[1:], strict=False):
        best = np.argsort(before.indices, kind="stable")[:6]
        assert after.origins[:6] == (SURVIVOR,) * 6
        assert np.array_equal(after.population[:6], before.population[best])
        assert np.array_equal(after.indices[:6], before.indices[best])
    assert [each.evaluated for each in search.generations] == [50, 44, 44, 44, 44, 44]
    assert search.generations[0].origins == (INITIAL,) * 50


def test_survivors_are_not_evaluated_again():
    sizes = []

    def counted(parameters):
        sizes.append(len(parameters))
        return bowl(parameters)

    search = run_genetic(counted, TABLE_1, GeneticSettings(generations=5), seed=1)
    assert sizes == [50, 44, 44, 44, 44]
    assert search.evaluations == sum(sizes)


def test_the_stop_rule_counts_generations_without_improvement():
    assert not has_stalled([], 10)
    assert not has_stalled([3.0] * 10, 10)
    assert has_stalled([3.0] * 11, 10)
    assert not has_stalled([3.0] * 5 + [2.0] * 10, 10)
    assert has_stalled([3.0] * 5 + [2.0] * 11, 10)
    assert has_stalled([np.inf] * 11, 10)


def test_a_search_goes_on_while_what_it_may_not_simulate_grows_less() -> None:
    """Unbuilt individuals, of infinite growth, do not hide it; nor does growth hide an index."""

    def generation(index: float, *growth: float) -> Generation:
        count = len(growth)
        found = Scores(np.full(count, np.inf), np.zeros(count), np.array(growth))
        found.indices[0] = index
        return Generation(0, np.zeros((count, 10)), (FRESH,) * count, *found)

    falling = [best_of(generation(np.inf, np.inf, 9.0 - 0.1 * i, 20.0)) for i in range(30)]
    assert falling[0] == (np.inf, 9.0) and not has_stalled(falling, 10)
    assert has_stalled([*falling, *falling[-1:] * 10], 10)
    assert best_of(generation(1e-4, 0.0, 5.0)) == (1e-4, 0.0)


def test_the_search_stops_after_ten_without_improvement_or_at_the_last_generation():
    stuck = run_genetic(hopeless, TABLE_1, GeneticSettings(), seed=1)
    assert len(stuck.generations) == 11
    assert (stuck.best_index, stuck.best_parameters, stuck.stable_share) == (np.inf, None, 0.0)
    capped = run_genetic(bowl, TABLE_1, GeneticSettings(generations=3), seed=1)
    assert (len(capped.generations), capped.ended) == (3, "all generations done")


def test_the_genetic_algorithm_finds_the_bottom_of_a_bowl():
    at_most = GeneticSettings(patience=100)
    search = run_genetic(bowl, TABLE_1, at_most, seed=1)
    assert search.evaluations == at_most.budget
    assert search.best_index < 0.1  # 0.0 at the bottom, 10 at a random individual
    bests = [each.indices.min() for each in search.generations]
    assert all(np.diff(bests) <= 0)


@pytest.mark.parametrize("run", (run_cma, run_de))
def test_the_peers_find_it_within_the_same_budget(run):
    settings = GeneticSettings()
    search = run(bowl, TABLE_1, settings, seed=1)
    assert settings.budget - 50 < search.evaluations <= settings.budget
    assert len(search.generations) == peer_generations(settings)
    assert search.best_index < 1e-3
    assert np.allclose(search.best_parameters, OPTIMUM, atol=0.05 * np.array(PRINTED_DEVIATIONS))


@pytest.mark.parametrize("run", TUNERS)
def test_a_search_is_reproduced_by_its_seed_and_by_nothing_else(run):
    settings = GeneticSettings(population=12, generations=8, survivors=4)
    first, again, other = (run(bowl, TABLE_1, settings, seed) for seed in (3, 3, 4))
    for one, two in zip(first.generations, again.generations, strict=True):
        assert np.array_equal(one.population, two.population)
    assert not np.array_equal(first.generations[-1].population, other.generations[-1].population)
    state = np.random.get_state()[1].copy()
    run(bowl, TABLE_1, settings, 3)
    assert np.array_equal(state, np.random.get_state()[1])


@pytest.mark.parametrize("run", TUNERS)
def test_a_search_continues_from_any_generation_without_evaluating_the_earlier(run):
    settings = GeneticSettings(population=12, generations=8, survivors=4)
    whole = run(bowl, TABLE_1, settings, 3)
    for kept in (1, 3, len(whole.generations)):
        new = []
        rest = run(bowl, TABLE_1, settings, 3, new.append, resume_from=whole.generations[:kept])
        assert len(new) == len(whole.generations) - kept
        for one, two in zip(whole.generations, rest.generations, strict=True):
            assert np.array_equal(one.population, two.population)
            assert np.array_equal(one.indices, two.indices)


@pytest.mark.parametrize("run", (run_cma, run_de))
def test_peers_refuse_generations_of_another_search(run):
    settings = GeneticSettings(population=12, generations=4)
    other = run(bowl, TABLE_1, settings, 4)
    with pytest.raises(RunError, match="generation 0"):
        run(bowl, TABLE_1, settings, 3, resume_from=other.generations[:2])


@pytest.mark.parametrize("run", (run_cma, run_de))
def test_peers_spend_no_more_where_everything_diverges(run):
    settings = GeneticSettings(population=10, generations=20, survivors=3)
    search = run(hopeless, TABLE_1, settings, seed=1)
    assert search.evaluations == settings.population * peer_generations(settings)


def test_best_after_counts_whole_generations():
    search = run_genetic(bowl, TABLE_1, GeneticSettings(generations=4), seed=1)
    bests = [each.indices.min() for each in search.generations]
    assert search.best_after(49) == np.inf
    assert search.best_after(50) == search.best_after(93) == bests[0]
    assert search.best_after(94) == bests[1]
    assert search.best_after(10**6) == search.best_index


def test_generations_have_their_own_random_numbers():
    draws = {float(generation_rng(s, g).random()) for s in range(5) for g in range(50)}
    assert len(draws) == 250


@pytest.mark.parametrize(
    "changed, word",
    [
        ({"population": 6}, "survivors"),
        ({"generations": 0}, "generations"),
        ({"patience": 0}, "patience"),
        ({"survivors": 1}, "survivors"),
    ],
)
def test_settings_out_of_range(changed, word):
    with pytest.raises(ParameterError, match=word):
        GeneticSettings(**changed)


@pytest.mark.parametrize(
    "text, word",
    [
        ("k7 = { normal = [1, 2] }", "k7"),
        ("k1 = { gamma = [1, 2] }", "gamma"),
        ("k1 = { normal = [1, 0] }", "deviation"),
        ("k1 = { log-uniform = [0, 1] }", "0 < low"),
        ("k1 = { uniform = [2, 1] }", "low < high"),
        ("k1 = { normal = [1, nan] }", "finite"),
        ("k1 = { normal = [1] }", "2 finite"),
        ("k1 = 3", "k1"),
        ("k1 = ", "toml"),
    ],
)
def test_distributions_that_cannot_be_used(tmp_path, text, word):
    path = tmp_path / "draws.toml"
    path.write_text(text)
    with pytest.raises(ParameterError, match=word):
        distribution(str(path))


def test_a_distribution_file_replaces_rows_of_table_1(tmp_path):
    path = tmp_path / "draws.toml"
    path.write_text("k1 = { log-uniform = [1e3, 1e5] }\nnu2 = { fixed = -1 }\n")
    read = distribution(str(path))
    assert read.draws[0] == Draw("log-uniform", (1e3, 1e5))
    assert read.draws[3] == Draw("fixed", (-1,))
    assert read.draws[4:] == TABLE_1.draws[4:]
    with pytest.raises(RunError, match="none"):
        distribution("none.toml")
    with pytest.raises(ParameterError, match="table-1"):
        distribution("table-2")
    with pytest.raises(ParameterError, match="fixed"):
        Distribution((Draw("fixed", (1.0,)),) * 10)
