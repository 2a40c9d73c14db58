"""One row a cell: what its replicates came to, and the interval of a median."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.core.statistics.paired import difference
from tactbench.core.statistics.rank import excess_of
from tactbench.core.statistics.ranking import ranks
from tactbench.core.statistics.replicates import (
    FEWEST,
    MedianInterval,
    against_reference,
    count_range,
    counted,
    least_coverage,
    median_interval,
    over_replicates,
    percent,
)
from tests.core.leaderboard.rows import row


def replicates(scores, sensor="a", estimator="lasso", **more):
    """Rows of one simulated cell, one a seed."""
    return [
        row(sensor, estimator, score=score, seed=seed, fit_s=float(seed),
            key=str(seed), cell=f"{sensor}/question/twin/deployable/{estimator}/{seed}", **more)
        for seed, score in enumerate(scores, 1)
    ]  # fmt: skip


SCORES = [0.5, 0.3, 0.9, 0.4, 0.6, 0.2, 0.8, 0.7]


def test_eight_replicates_are_one_row_with_their_median_and_its_interval():
    (found,) = over_replicates(replicates(SCORES))
    known = median_interval(SCORES)
    assert found["score"] == pytest.approx(0.55)
    assert (found["ci_low"], found["ci_high"]) == (known.low, known.high)
    assert (found["n_replicates"], found["replicate_unit"], found["seeds"]) == (8, "replicate", list(range(1, 9)))
    assert found["replicate_scores"] == SCORES
    assert (found["score_min"], found["score_max"], found["fit_s"]) == (0.2, 0.9, 4.5)
    assert found["ci_method"] == "order statistics of 8 replicates"


def test_times_are_those_of_the_host_that_timed_the_first_and_no_others():
    rows = [one | {"host": "ab"[one["seed"] > 3], "sim_s": 2.0} for one in replicates(SCORES)]
    rows[0] |= {"status": "timeout", "score": None}
    rows[1] |= {"fit_s": None, "host": "c"}
    (found,) = over_replicates(rows)
    assert (found["host"], found["fit_s"], found["seeds"]) == ("a", 3.0, list(range(2, 9)))


def test_figures_of_replicates_are_their_medians_counts_their_sums_and_means_are_of_all():
    def of(n):
        return {
            "events": {"alarms": n, "misses": 10 * n}, "confusion": [[n, 0], [1, n]],
            "counts": {"rows left out": n}, "chosen": {"k": n}, "scores": {"r2": n / 10},
            "delay_parts_ms": {"window": n, "link": 1.0}, "answer_delay_ms": n + 1.0,
        }  # fmt: skip

    rows = [one | of(n) for n, one in zip((1, 2, 6), replicates(SCORES[:3]), strict=True)]
    (found,) = over_replicates(rows)
    expected = of(2) | {
        "events": {"alarms": 3.0, "misses": 20}, "confusion": [[9, 0], [3, 9]], "counts": {"rows left out": 9},
    }  # fmt: skip
    assert {name: found[name] for name in expected} == expected
    assert (found["ci_method"], found["replicates"]) == ("", {})
    rows[0] |= {"events": {}, "confusion": None}
    (found,) = over_replicates(rows)
    assert (found["events"], found["confusion"]) == ({"alarms": 4.0, "misses": 40}, None)


def test_one_simulated_row_whose_split_holds_out_enough_keeps_its_own_interval():
    kept = {"unit": "placement", "names": list("abcdef"), "strata": None, "sums": [], "own": [0.5] * 6}
    (found,) = over_replicates([row(replicates=kept)])
    assert (found["replicate_unit"], found["ci_low"], found["ci_high"]) == ("placement", *[
        pytest.approx(row()[end]) for end in ("ci_low", "ci_high")
    ])  # fmt: skip
    assert over_replicates([row()])[0]["ci_low"] is None


def test_how_many_replicates_is_written():
    assert [counted(1, "session"), counted(2, "session"), counted(3, "press")] == [
        "1 session", "2 sessions", "3 presses",
    ]  # fmt: skip
    assert [count_range(n, "session") for n in ([5, 5], [8, 5])] == ["5 sessions", "5 to 8 sessions"]
    assert [percent(*one) for one in ((5, "replicate"), (5, "session"), (8, "replicate"))] == ["93.8 %", "95 %", "95 %"]


def test_fewer_than_five_have_no_interval_and_share_a_rank():
    rows = over_replicates([*replicates(SCORES[:4]), *replicates(SCORES[4:], "b")])
    assert all(one["ci_low"] is None and one["ci_high"] is None for one in rows)
    assert {(one.place, one.low, one.high) for one in ranks(rows).values()} == {(1, 1, 2)}


def test_rows_are_the_same_in_any_order_and_aggregated_once():
    rows = replicates(SCORES)
    found = over_replicates(rows)
    assert over_replicates(found) == found
    assert over_replicates(rows[::-1]) == found


def test_what_some_replicates_remark_is_told_with_their_number_and_a_stopped_one_takes_no_other_down():
    told = {one["seed"]: ["always", "at times"][: 2 if one["seed"] < 3 else 1] for one in replicates(SCORES)}
    rows = [one | dict.fromkeys(("remarks", "findings"), told[one["seed"]]) for one in replicates(SCORES)]
    rows[2] |= {"status": "timeout", "score": None, "reason": "10 s were not enough"}
    (found,) = over_replicates(rows)
    assert (found["status"], found["n_replicates"]) == ("done", 7)
    stopped = "replicate with seed 3: timeout: 10 s were not enough"
    assert found["remarks"] == [*found["findings"], stopped]
    assert found["findings"] == ["always", "in 2 of 7 replicates: at times"]


def test_recordings_keep_the_interval_over_what_is_held_out_and_fewer_than_five_have_their_own_scores():
    own = [0.5, 0.3, None, 0.4, 0.6, 0.2]
    kept = {"unit": "object", "names": list("abcdef"), "strata": None, "sums": [], "own": own}
    (found,) = over_replicates([row(simulated=False, replicates=kept)])
    assert (found["n_replicates"], found["replicate_unit"], found["score_min"]) == (6, "object", 0.2)
    assert (found["ci_low"], found["ci_high"]) == pytest.approx((0.4, 0.6))
    few = kept | {"names": ["a", "b"], "own": own[:2]}
    (found,) = over_replicates([row(simulated=False, replicates=few, ci_low=None, ci_high=None)])
    assert (found["replicate_scores"], found["replicates"]) == ([0.5, 0.3], {})
    # Rows of versions that took finer units do not keep the units' own scores.
    (found,) = over_replicates([row(simulated=False, replicates={name: kept[name] for name in kept if name != "own"})])
    assert (found["ci_low"], found["ci_high"], found["replicates"]) == (None, None, {})
    (found,) = over_replicates([one | {"simulated": False} for one in replicates(SCORES)])
    assert (found["n_replicates"], found["ci_low"]) == (1, None), "seeds asked of the same recordings are no replicates"
    assert found["score"] in SCORES


def test_errors_of_force_are_compared_beyond_their_floor():
    known = {"metric": "rmse", "unit": "N", "reference_floor": 0.3}
    rows = replicates([score + 0.2 for score in SCORES]) + replicates([score + 0.3 for score in SCORES], "b")
    beyond = [one | known | {"score_beyond_floor": (one["score"] ** 2 - 0.09) ** 0.5} for one in rows]
    one, other = over_replicates(beyond)
    found = difference(one, other)
    assert "beyond the floor" in found.method
    own, others = (each["replicates"]["beyond"] for each in (one, other))
    assert one["replicates"]["excess"] == pytest.approx(np.square(own))
    assert found.value == pytest.approx(np.mean(own) - np.mean(others))
    assert excess_of(one) == pytest.approx(np.median(one["replicates"]["excess"]))


def test_five_have_their_range_and_eight_the_ends_of_the_published_formula():
    assert median_interval([3.0, 1.0, 5.0, 2.0, 4.0]) == MedianInterval(1.0, 5.0, 1 - 2 / 2**5)
    # Hettmansperger and Sheather 1986, n = 8, k = 1: 0.9922 and 0.9297 enclose 0.95.
    share = (127 / 128 - 0.95) / (127 / 128 - 119 / 128)
    weight = 7 * share / (1 + 6 * share)
    found = median_interval(range(8))
    assert (found.low, found.high) == pytest.approx((weight, 7 - weight), rel=1e-12)


@given(st.lists(st.floats(-1e6, 1e6), min_size=FEWEST, max_size=30))
def test_the_sample_median_lies_in_it_and_order_does_not_matter(values):
    found = median_interval(values)
    assert found.low <= np.median(values) <= found.high
    assert median_interval(values[::-1]) == found


@pytest.mark.parametrize("draw", ["standard_normal", "standard_exponential", "standard_cauchy"])
@pytest.mark.parametrize("n", [5, 8, 20])
def test_it_covers_what_it_says_whatever_the_distribution(draw, n):
    rng = np.random.default_rng([n, len(draw)])
    centre = np.log(2) if draw == "standard_exponential" else 0.0
    trials = 4000
    found = [median_interval(values) for values in getattr(rng, draw)((trials, n))]
    covered = np.mean([one.low <= centre <= one.high for one in found])
    # Four standard errors of a share, and 0.015 by which interpolation of skewed values may be off.
    assert abs(covered - found[0].level) < 4 * np.sqrt(0.05 * 0.95 / trials) + 0.015


@pytest.mark.parametrize("n", [7, 8, 10])
def test_of_two_far_groups_it_covers_less_and_never_less_than_it_says(n):
    rng, trials = np.random.default_rng(n), 4000
    values = rng.choice([-1.0, 1.0], size=(trials, n)) + 0.1 * rng.standard_normal((trials, n))
    covered = np.mean([found.low <= 0 <= found.high for found in map(median_interval, values)])
    assert least_coverage(n) - 4 * np.sqrt(0.05 * 0.95 / trials) < covered < 0.95


def forces(true, noisy, estimator, simulated=True, **more):
    """Rows of an answer to force, one a campaign, with its errors against the true force and the noisy reference."""
    return [
        one | {"true_score": value, "true_ci_low": None, "true_ci_high": None, "simulated": simulated, **more}
        for one, value in zip(replicates(noisy, estimator=estimator, metric="rmse", unit="N"), true, strict=True)
    ]  # fmt: skip


NOISY = [0.690, 0.688, 0.692, 0.689, 0.691, 0.687]
"""Errors against a reference whose noise is all that they show."""
BETTER, WORSE = ([value + 1e-3 * place for place in range(6)] for value in (0.030, 0.060))


def test_a_better_answer_by_the_true_force_is_first_where_the_noise_of_the_reference_hides_it():
    rows = [*forces(BETTER, [one + 1e-4 for one in NOISY], "better"), *forces(WORSE, NOISY, "worse"),
            *forces([1.6] * 6, [1.75] * 6, "mean", is_baseline=True)]  # fmt: skip
    found = {one["estimator"]: one for one in over_replicates(rows)}
    better, worse = found["better"], found["worse"]
    assert (better["metric"], better["score"]) == ("true_rmse", pytest.approx(0.0325))
    assert better["reference_score"] == pytest.approx(0.6896)
    assert better["ci_low"] < 0.0325 < better["ci_high"] < worse["ci_low"]
    assert better["baseline"] == 1.6
    assert (better["replicate_scores"], better["reference_scores"][0]) == (BETTER, pytest.approx(0.6901))
    assert {one: rank.place for one, rank in ranks([better, worse]).items()} == {better["cell"]: 1, worse["cell"]: 2}
    apart = difference(better, worse)
    assert (apart.verdict, apart.value) == ("better", pytest.approx(-0.03))
    before = against_reference(better)
    assert (before["metric"], before["score"]) == ("rmse", better["reference_score"])
    assert over_replicates(list(found.values())) == list(found.values())


def test_where_one_answer_or_a_real_rig_knows_no_true_force_all_are_ranked_by_the_reference():
    one_unknown = [*forces(BETTER, NOISY, "a"), *replicates(NOISY, estimator="b", metric="rmse")]
    real = forces([None] * 6, NOISY, "a", simulated=False)
    for rows in (one_unknown, real):
        assert {(one["metric"], one.get("reference_score")) for one in over_replicates(rows)} <= {("rmse", None)}


def filled(metric="rmse", scores=None, **more):
    given = scores or {"lasso": 0.7, "mean": 1.6, "median": 1.5, "time-index": 0.6}
    looks = {"lasso": "features", "time-index": "time", "clock": "time"}
    rows = [
        row(estimator=name, score=score, cell=f"c-{name}", metric=metric, is_baseline=name not in ("lasso", "clock"),
            looks_at=looks.get(name, "nothing"), **more)
        for name, score in given.items()
    ]  # fmt: skip
    return {one["estimator"]: one for one in over_replicates(rows)}


def test_the_best_of_those_that_look_at_nothing_whatever_comes_first():
    assert filled()["lasso"]["baseline"] == 1.5
    shares = filled("macro_f1", {"lasso": 0.5, "majority": 0.07, "chance": 0.2})
    assert shares["lasso"]["baseline"] == 0.2


def test_an_answer_that_looks_at_the_time_is_held_against_those_that_do_too():
    rows = filled(scores={"lasso": 0.7, "clock": 0.7, "mean": 1.6, "time-index": 0.6})
    assert rows["clock"]["baseline"] == 0.6
    assert rows["lasso"]["baseline"] == 1.6


def test_without_a_finished_trivial_answer_there_is_no_baseline():
    assert filled(scores={"lasso": 0.7})["lasso"]["baseline"] is None
    assert filled(scores={"lasso": 0.7, "time-index": 0.6})["lasso"]["baseline"] is None
