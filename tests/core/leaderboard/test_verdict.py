"""The sentence above a table: one of three outcomes, and how far it may be relied on."""

import itertools

import numpy as np
import pytest

from tactbench.core.leaderboard.table import build_table
from tactbench.core.statistics.replicates import over_replicates
from tests.core.leaderboard.rendering import to_markdown
from tests.core.statistics.test_replicates import replicates

RNG = np.random.default_rng(7)
COMMON = 0.02 * RNG.standard_normal(8)
"""What every cell shares of a replicate."""


def verdict(**cells):
    """Return the verdict on cells by the name of their estimator: their mean score, or all of their scores."""
    rows = []
    for name, given in cells.items():
        values = given if isinstance(given, list) else [*(given + COMMON + 0.004 * RNG.standard_normal(8))]
        rows += replicates([float(value) for value in values], estimator=name)
    return build_table(over_replicates(rows)).blocks[0].verdict


def test_a_clear_winner_is_named_with_its_interval():
    said, how = verdict(ols=0.3, lasso=0.5, forest=0.9)
    assert said.startswith("ols is best: ")
    assert "95 % over 8 replicates" in said
    assert how.startswith("2 of 2 neighbouring rows separable; 0 tied with the first, 2 behind.")
    assert "Without any one replicate the first stays first. Single replicates: ols 0." in how


def test_in_a_tie_all_co_leaders_are_named_and_cost_decides():
    same = [0.5, 0.52, 0.48, 0.51, 0.49, 0.5, 0.53, 0.47]
    rows = [one | {"fit_s": cost} for name, cost in (("ols", 0.1), ("lasso", 1.0), ("forest", 0.2))
            for one in replicates(same[::-1] if name == "lasso" else same, estimator=name)]  # fmt: skip
    said = build_table(over_replicates(rows)).blocks[0].verdict[0]
    assert said.startswith("Tie at the top: ")
    assert "cannot be told from it." in said
    assert all(name in said for name in ("ols", "lasso", "forest"))
    assert said.endswith("Of these ols fits 10 times quicker than lasso.")


def test_an_interval_that_holds_the_trivial_answer_is_not_enough():
    wide = [0.9, 0.1, 0.8, 0.15, 0.7, 0.2, 0.6, 0.3]
    rows = [*replicates(wide), *replicates([0.5] * 8, estimator="mean")]
    assert build_table(over_replicates(rows)).blocks[0].verdict[0].startswith("Not enough to tell: lasso leads")


def test_a_missing_interval_counts_as_not_separable():
    rows = over_replicates([*replicates([0.9]), *replicates([0.1], estimator="ols")])
    (said,) = build_table(rows).blocks[0].verdict
    assert said.startswith("Not enough to tell: one replicate, and an interval or a rank needs 5.")


def test_nobody_better_than_trivial_is_said():
    rows = over_replicates([*replicates([0.3] * 8), *replicates([0.1] * 8, estimator="mean")])
    assert build_table(rows).blocks[0].verdict == (
        "None of 1 answers scores better than the trivial one: mean 0.1000 N.",
    )


def test_an_answer_without_touch_that_is_as_good_is_named():
    timed = [one | {"looks_at": "time"} for one in replicates([0.3] * 8, estimator="mean")]
    rows = over_replicates([*replicates([0.4] * 8), *timed])
    assert build_table(rows).blocks[0].verdict[-1].startswith("mean reads no sensor, only the time since the press")


def test_the_trivial_answer_that_is_the_bar_is_named():
    timed = [one | {"looks_at": "time", "is_baseline": True} for one in replicates([0.3] * 8, estimator="time-index")]
    known = [one | {"baseline": 0.9} for one in replicates([0.4] * 8)]
    rows = over_replicates([*known, *timed, *replicates([0.9] * 8, estimator="mean")])
    assert "the only answer better than the trivial mean." in build_table(rows).blocks[0].verdict[0]


def test_an_answer_without_touch_is_named_where_there_are_few_replicates_too():
    timed = [one | {"looks_at": "time"} for one in replicates([0.3], estimator="mean")]
    said = build_table(over_replicates([*replicates([0.4]), *timed])).blocks[0].verdict
    assert said[0].startswith("Not enough to tell: one replicate")
    assert said[1].startswith("mean reads no sensor, only the time since the press began, and scores 0.3000 N")


def test_a_first_place_that_hangs_on_one_replicate_is_said():
    one = [0.50, 0.50, 0.50, 0.50, 0.60, 0.60, 0.60, 0.60]
    other = [0.549, 0.549, 0.549, 0.549, 0.549, 0.549, 0.549, 0.549]
    how = verdict(ols=one, lasso=other)[1]
    assert "the first would be" in how


@pytest.mark.parametrize("seed", range(5))
def test_neighbours_have_different_places_only_if_the_replicates_separate_them(seed):
    from tactbench.core.statistics.paired import difference

    rng = np.random.default_rng(seed)
    rows = []
    for place in range(12):
        scores = 0.5 + 0.01 * place + rng.normal(0, rng.choice([0.005, 0.05]), 8)
        rows += replicates(scores.tolist(), estimator=f"e{place}")
    lines = build_table(over_replicates(rows)).blocks[0].lines
    for before, after in itertools.pairwise(lines):
        if before.placing.place != after.placing.place:
            assert difference(before.row, after.row).verdict == "better"


def test_it_stands_above_the_table_in_markdown():
    rows = over_replicates([*replicates([0.5] * 8), *replicates([0.4] * 8, estimator="ols")])
    text = to_markdown(rows)
    assert text.index("is best") < text.index("| # |")


def test_published_figures_are_placed_beside_our_interval():
    rows = [one | {"published": 0.9} for one in replicates([0.5, 0.4, 0.6, 0.5, 0.4, 0.6, 0.5, 0.5])]
    said = build_table(over_replicates(rows)).blocks[0].verdict[-1]
    assert said.startswith("Published figures: lasso 0.9000 lies above our 0.4")
    assert said.endswith("This tests the simulation, not the sensor.")
