"""Ranks: what holds of them whatever the numbers."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.core.statistics.paired import difference
from tactbench.core.statistics.rank import Rank
from tactbench.core.statistics.ranking import ranks

from .made import mae_row, row


def board(seed, spread=0.3):
    """Six rows over the same eight sessions."""
    rng = np.random.default_rng(seed)
    session = rng.normal(0, 0.5, 8)
    return [mae_row(f"c{place}", 5 + 0.2 * place + session + spread * rng.normal(size=8)) for place in range(6)]


def places(rows):
    return [one.place for one in ranks(rows).values()]


def renamed(row):
    """The row with other replicates: it cannot be paired any more."""
    names = [f"other {place}" for place in range(8)]
    return row | {"replicates": row["replicates"] | {"names": names}}


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000), spread=st.sampled_from([0.01, 0.1, 1.0]), order=st.permutations(range(6)))
def test_order_and_names_change_nothing(seed, spread, order):
    rows = board(seed, spread=spread)
    found = ranks(rows)
    assert ranks([rows[place] for place in order]) == found
    called = ranks([one | {"cell": f"x{order[place]}"} for place, one in enumerate(rows)])
    assert [called[f"x{order[place]}"] for place in range(6)] == [found[name] for name in sorted(found)]


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000), spread=st.sampled_from([0.01, 0.1, 1.0]))
def test_places_follow_scores_and_intervals_hold_them(seed, spread):
    rows = sorted(board(seed, spread=spread), key=lambda one: one["score"])
    found = [ranks(rows)[one["cell"]] for one in rows]
    assert found[0].place == 1
    assert [one.place for one in found] == sorted(one.place for one in found)
    assert all(1 <= one.low <= one.place <= one.high <= len(rows) for one in found)


def test_baselines_and_failures_have_no_rank():
    one, other, third, *_ = board(5)
    failed = third | {"status": "failed", "score": None}
    assert ranks([one, other | {"is_baseline": True}, failed]).keys() == {"c0"}
    assert ranks([]) == {}


def force_row(cell, errors, holds, **more):
    """A row of RMSE with (sessions,) mean squares of its errors, and of its reference while unloaded."""
    n, held = 500.0, 300.0
    sums = np.column_stack([np.multiply(errors, n), np.full(len(errors), n)])
    made = row(cell, sums, **more)
    made["replicates"]["floor"] = [[one * held, held] for one in holds]
    return made | {"reference_floor": float(np.sqrt(np.mean(holds)))}


def noisy(rng, own, sigma=0.6875, scatter=0.002):
    """Mean squares of errors and of holds by session; `own` is the answer's own error."""
    noise = sigma**2 + scatter * rng.standard_normal((2, 8))
    return own**2 + noise[0], noise[1]


def test_errors_of_force_are_ranked_by_what_is_beyond_the_floor():
    """Of a noisier reference the better sensor has the larger RMSE."""
    rng = np.random.default_rng(1)
    better, worse = noisy(rng, 0.1, sigma=0.75), noisy(rng, 0.4, sigma=0.5)
    rows = [force_row("worse", *worse), force_row("better", *better)]
    assert rows[1]["score"] > rows[0]["score"]
    assert [ranks(rows)[name].place for name in ("better", "worse")] == [1, 2]


def test_a_floor_that_two_answers_share_does_not_blur_their_difference():
    """Both were tested on the same recordings: what their one floor is uncertain by cancels."""
    rng = np.random.default_rng(2)
    errors, holds = noisy(rng, 0.2, scatter=0.1)
    one, other = force_row("a", errors, holds), force_row("b", errors + 0.005 + 1e-4 * rng.standard_normal(8), holds)
    assert places([one, other]) == [1, 2]
    assert places([one, renamed(other)]) == [1, 1], "of two references it does not"


@pytest.mark.parametrize(("same", "expected"), [(0.03, [1, 2]), (0.08, [1, 1])])
def test_practically_the_same_is_said_of_the_error_and_not_of_its_square(same, expected):
    """0.20 and 0.25 N differ by 0.05 N, and their squares by 0.0225 N²."""
    rng = np.random.default_rng(3)
    holds = np.full(8, 0.5)
    errors = {name: own**2 + holds + 1e-5 * rng.standard_normal(8) for name, own in (("a", 0.2), ("b", 0.25))}
    assert places([force_row(name, one, holds, equivalence=same) for name, one in errors.items()]) == expected


def test_a_place_is_sure_where_it_is_one_and_not_shared():
    found = [Rank(place=1, low=low, high=high, tied=tied).unsure
             for low, high, tied in ((1, 1, False), (1, 2, False), (1, 1, True), (None, None, False))]  # fmt: skip
    assert found == [False, True, True, False]


@pytest.mark.parametrize("seed", range(20))
def test_neighbours_with_different_places_are_separated(seed):
    rng = np.random.default_rng(seed)
    rows = []
    for place in range(10):
        scores = 0.5 + 0.02 * place + rng.normal(0, rng.choice([0.002, 0.03]), 8)
        rows.append(mae_row(f"c{place}", scores, score=float(np.median(scores))))
        rows[-1]["replicates"]["scores"] = scores.tolist()
    found = ranks(rows)
    for one, other in itertools.pairwise(sorted(rows, key=lambda row: row["score"])):
        if found[one["cell"]].place < found[other["cell"]].place:
            assert difference(one, other).verdict == "better"
    beaten = {(one["cell"], other["cell"]) for one, other in itertools.permutations(rows, 2)
              if one["score"] < other["score"] and difference(one, other).verdict == "better"}  # fmt: skip
    for name, rank in found.items():
        assert rank.low == min(1 + sum(loser == name for _, loser in beaten), rank.place)
        assert rank.high == max(10 - sum(winner == name for winner, _ in beaten), rank.place)
