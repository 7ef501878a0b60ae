"""The realisations' study: errors against closed forms, costs, loops and what is refused."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from quick_run import QuickRun

from controllers import TUNED_IDEAL, operator
from flexsim import AssumedModesPlant, Parameters
from studies.core.evidence.intervals import share_interval
from studies.realisations.realisations import LENGTHS, RealisationsConfig, loop_row, tuned_anew
from studies.realisations.report import tables, verdict
from studies.realisations.response import ORDERS, band, response_row, sample_cost
from studies.realisations.rows import (
    FactorRow,
    LoopRow,
    RealisationsResult,
    factor_rows,
    relative_index,
)

FORGOTTEN_DEG = 45.0  # phase of (j omega)^0.5, all missing where a filter acts as a gain
ENDS = ("_db", "_deg")
OUSTALOUP_DB = 1.0  # rms over the band: 0.75, nearly all of it below its lower edge of 1.6 Hz


def test_orders_of_zero_and_one_are_exact() -> None:
    """s^0 is one; the backward difference is late by half a sample, sin(x)/x in magnitude."""
    for name in LENGTHS:
        row = response_row(name, 5, 0.0)
        assert max(abs(getattr(row, key)) for key in vars(row) if key.endswith(ENDS)) < 1e-9
    x = band() * 1e-3 / 2
    row = response_row("gruenwald-letnikov", 5, 1.0)
    assert row.phase_max_deg == pytest.approx(np.degrees(x.max()), rel=1e-9)
    assert row.magnitude_max_db == pytest.approx(-20 * np.log10(np.sinc(x.max() / np.pi)))


def test_two_forgets_where_oustaloup_follows() -> None:
    """Below 1/(p T) = 16 Hz the ten terms of (2) are a gain; the recursive filter is not."""
    series, recursive = response_row("tustin", 10, 0.5), response_row("oustaloup", 5, 0.5)
    assert series.phase_max_deg == pytest.approx(FORGOTTEN_DEG, abs=0.5)
    assert series.magnitude_max_db > 10
    assert recursive.magnitude_rms_db < OUSTALOUP_DB
    assert recursive.phase_rms_deg < series.phase_rms_deg / 2


@pytest.mark.parametrize("name", ["gruenwald-letnikov", "impulse-response", "tustin-fraction"])
def test_more_terms_are_better(name: str) -> None:
    rms = [response_row(name, terms, 0.5).magnitude_rms_db for terms in LENGTHS[name]]
    assert rms == sorted(rms, reverse=True)


def test_an_odd_number_of_terms_takes_the_steady_gain_of_two() -> None:
    """Where sum of taps of (2) to p is small: at order 1 it is 1 for even p and -1 for odd."""
    for terms, wanted in ((10, 2000.0), (5, -2000.0)):
        b, _ = operator("tustin", 1.0, 1e-3, terms)
        assert b.sum() == pytest.approx(wanted)


def test_longer_filters_cost_more() -> None:
    costs = [sample_cost(*operator("tustin", 0.5, 1e-3, terms), rounds=5) for terms in (5, 400)]
    assert 0 < costs[0] < costs[1]


def test_loops_of_two_hold_and_too_many_poles_are_refused() -> None:
    plant = AssumedModesPlant(Parameters())
    held = loop_row("tustin", 10, plant, "circle", [TUNED_IDEAL["circle"]], RealisationsConfig())
    assert held.bounded_share == 1.0 and 0 < held.index < 1e-3 and held.envelope < 0.03
    assert (held.bounded_share_low, held.bounded_share_high) == share_interval(1, 1)
    lost = loop_row(
        "backward-fraction", 12, plant, "circle", [TUNED_IDEAL["circle"]], RealisationsConfig()
    )
    assert lost.index is None and "fewer terms" in lost.refused


@pytest.mark.slow
def test_retuning_suits_a_realisation_better_than_gains_of_another() -> None:
    plant = AssumedModesPlant(Parameters())
    quick = RealisationsConfig(quick=True)
    alone = RealisationsConfig(quick=True, threads=1)
    searches = [tuned_anew("oustaloup", 3, "circle", 1, config) for config in (quick, alone)]
    assert searches[0] is not None and searches[0] == searches[1]
    best = tuned_anew("oustaloup", 3, "circle", 1, RealisationsConfig())
    assert best is not None
    before, after = (
        loop_row("oustaloup", 3, plant, "circle", [each], alone).index
        for each in (TUNED_IDEAL["circle"], best)
    )
    assert after < before


def loop(name: str, terms: int, index: float | None, shape: str = "line") -> LoopRow:
    return LoopRow("loop", name, terms, "chain", shape, index=index)


def test_relative_index_is_a_geometric_mean() -> None:
    rows = [loop("tustin", 10, 1.0), loop("tustin", 10, 4.0, "circle"), loop("tustin", 5, None)]
    rows += [loop("oustaloup", 5, 1.0), loop("oustaloup", 5, 1.0, "circle")]
    assert relative_index(rows, ("oustaloup", 5)) == pytest.approx(0.5)
    assert relative_index(rows, ("tustin", 5)) == np.inf
    anew = [replace(row, part="retuned") for row in rows]
    assert "oustaloup, 5 terms, 0.5 of it" in verdict(RealisationsResult([*rows, *anew]))


def measured(name: str, terms: int, indices: np.ndarray, shape: str, lost: int = 0) -> LoopRow:
    """A row of runs, the last of which diverged."""
    found = np.where(np.arange(len(indices)) < len(indices) - lost, indices, np.inf)
    return replace(loop(name, terms, float(np.median(found)), shape), indices=found)


def test_factors_have_the_interval_of_pairs() -> None:
    """Equal controllers under both: what these share does not blur the ratio."""
    common = np.random.default_rng(1).lognormal(size=(2, 12))
    rows = [measured("tustin", 10, each, shape) for each, shape in zip(common, "ab", strict=True)]
    for factors, shape, each in zip(((2.0, 1.0), (8.0, 1.0)), "ab", common, strict=True):
        rows.append(measured("oustaloup", 5, factors[0] * each, shape))
        rows.append(measured("tustin", 5, factors[1] * each, shape, lost=6))
    found = {(row.realisation, row.terms): row for row in factor_rows(RealisationsResult(rows))}
    four = found["oustaloup", 5]
    assert (four.factor, four.factor_low, four.factor_high) == pytest.approx((4, 4, 4))
    assert four.shown == "4.00 [4.00, 4.00]"
    assert found["tustin", 10].shown == "1.00 [1.00, 1.00]"
    lost = found["tustin", 5]
    assert lost.factor == np.inf and lost.factor_high is None and lost.shown.endswith("?]")
    cells = next(table for table in tables(RealisationsResult(rows)) if table.tight)
    assert cells.cells([row for row in cells.rows if row.terms == 5][:2])[-1] == four.shown


def test_searches_have_the_range_of_their_seeds() -> None:
    rows = []
    for seed, factor in ((1, 0.5), (2, 3.0), (3, 2.0)):
        rows += [
            replace(loop(*each), part="retuned", seed=seed)
            for each in (("tustin", 10, 1.0), ("oustaloup", 5, factor))
        ]
    (own,) = (
        row for row in factor_rows(RealisationsResult(rows)) if row.realisation == "oustaloup"
    )
    two, half, three = map(pytest.approx, (2.0, 0.5, 3.0))
    assert own == FactorRow("retuned", "oustaloup", 5, two, None, None, half, three)
    assert own.shown == "2.0 (0.5 to 3.0)"


def test_six_searches_have_an_interval() -> None:
    """Paired by their seeds: what equal populations share does not blur the factor."""
    rows = []
    for seed, common in enumerate((1.0, 3.0, 2.0, 5.0, 4.0, 6.0), 1):
        rows += [
            replace(loop(name, terms, factor * common), part="retuned", seed=seed)
            for name, terms, factor in (("tustin", 10, 1.0), ("oustaloup", 5, 2.0))
        ]
    result = RealisationsResult(rows)
    (own,) = (row for row in factor_rows(result) if row.realisation == "oustaloup")
    assert (own.factor, own.factor_low, own.factor_high) == pytest.approx((2, 2, 2))
    assert own.shown == "2.00 [2.00, 2.00]"
    cells = [table for table in tables(result) if table.tight][-1]
    assert cells.rows[0].index == 3.5e0 and cells.rows[0].index_low == 1.0


def test_nothing_is_relative_to_a_loop_that_fails() -> None:
    rows = [loop("tustin", 10, np.inf), loop("oustaloup", 5, 1.0)]
    assert relative_index(rows, ("oustaloup", 5)) == np.inf


def test_the_command_writes_its_folder(quick: Callable[[str], QuickRun]) -> None:
    run = quick("realisations")
    rows = run.content["rows"]
    parts = [row["part"] for row in rows]
    assert parts.count("loop") == 2 * 9 and parts.count("retuned") == 2 * 6
    assert parts.count("response") == 9 * len(ORDERS)
    assert all(row["bounded_share"] == 1.0 for row in rows if row["part"] == "loop")
    assert len(run.content["factors"]) == 9 + 6
    assert all(row["bounded_share_high"] == 1.0 for row in rows if row["part"] == "loop")
    assert run.figures == {"loop.png", "retuned.png", "responses.png"}
    assert run.faults() == []
    for name, part in (("responses", "response"), ("loops", "loop"), ("retuned", "retuned")):
        assert {row["part"] for row in run.table(f"{name}.csv")} == {part}
