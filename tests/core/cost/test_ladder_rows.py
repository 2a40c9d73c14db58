"""Verdicts, fronts and order of the ladder's rows."""

import pytest

from tactbench.core.cost.ladder_rows import by_score, mark_fronts, stopped, timed
from tactbench.core.cost.rounds import Timing
from tactbench.core.errors import NotApplicable
from tests.core.cost.test_rounds import Hours, contestant


def row(name, score, fit_s, latency, *, baseline=False, status="done", looks_at="features"):
    return {
        "estimator": name, "looks_at": looks_at, "score": score, "fit_s": fit_s, "latency_ms_p50": latency,
        "is_baseline": baseline, "status": status, "front_fit": False, "front_latency": False,
    }  # fmt: skip


def test_a_front_for_each_time_and_baselines_and_failures_on_none():
    rows = [
        row("quick", 0.5, 1.0, 3.0),
        row("good", 0.9, 5.0, 1.0),
        row("poor", 0.4, 2.0, 4.0),
        row("time", 1.0, 0.1, 0.1, baseline=True, looks_at="time"),
        row("gone", 1.0, 0.1, 0.1, status="failed"),
    ]
    mark_fronts(rows, higher_is_better=True)
    assert [one["estimator"] for one in rows if one["front_fit"]] == ["quick", "good"]
    assert [one["estimator"] for one in rows if one["front_latency"]] == ["good"]
    errors = [{**one, "front_fit": False, "front_latency": False} for one in rows]
    mark_fronts(errors, higher_is_better=False)
    assert [one["estimator"] for one in errors if one["front_fit"]] == ["quick", "poor"]


@pytest.mark.parametrize(("higher", "sign"), [(True, 1.0), (False, -1.0)])
def test_nobody_who_is_no_better_than_the_best_answer_from_nothing_is_on_a_front(higher, sign):
    rows = [
        row("good", sign * 0.9, 5.0, 5.0),
        row("same", sign * 0.5, 1.0, 1.0),
        row("below", sign * 0.4, 0.5, 0.5),
        row("poorer trivial", sign * 0.1, 0.1, 0.1, baseline=True, looks_at="nothing"),
        row("trivial", sign * 0.5, 0.1, 0.1, baseline=True, looks_at="nothing"),
        row("time", sign * 0.95, 0.1, 0.1, baseline=True, looks_at="time"),
    ]
    mark_fronts(rows, higher_is_better=higher)
    assert [one["estimator"] for one in rows if one["front_fit"] or one["front_latency"]] == ["good"]


def test_the_best_score_comes_first_and_no_score_last():
    rows = [row("a", 0.5, 1, 1), row("none", None, None, None), row("b", 0.9, 1, 1)]
    assert [one["estimator"] for one in by_score(rows, higher_is_better=True)] == ["b", "a", "none"]
    assert [one["estimator"] for one in by_score(rows, higher_is_better=False)] == ["a", "b", "none"]


@pytest.mark.parametrize(
    ("usual_ms", "rare_ms", "rare", "hundred", "thousand"),
    [
        (0.9, 0.9, 0, True, True),
        (1.1, 1.1, 0, True, False),
        (11.0, 11.0, 0, False, False),
        (1.0, 1.0, 0, True, False),  # the period itself is too late
        (0.1, 50.0, 10, False, False),  # one call in ten misses the beat
        (0.1, 50.0, 4, True, True),  # one in twenty-five: the definition lets it
    ],
)
def test_a_loop_is_kept_by_its_95th_percentile(usual_ms, rare_ms, rare, hundred, thousand):
    latency = [usual_ms / 1e3] * (100 - rare) + [rare_ms / 1e3] * rare
    found = timed(contestant(Hours(), "a"), Timing([1.0], [1.0], latency), {}, 1, 20.0)
    assert (found["loop_100_hz"], found["loop_1000_hz"]) == (hundred, thousand)


def test_quartiles_and_rows_are_those_of_the_times():
    found = timed(contestant(Hours(), "a"), Timing([5.0, 1.0, 3.0, 2.0, 4.0], [2.0], [0.004]), {}, 5, 20.0)
    assert (found["fit_s_q1"], found["fit_s"], found["fit_s_q3"]) == (2.0, 3.0, 4.0)
    assert found["batch_s_per_row"] == 2.0 / 1000
    assert found["latency_ms_p50"] == 4.0
    assert found["fits"] == 5
    assert found["data_s"] is None
    assert found["data_kind"] is None


def test_what_stops_an_estimator_stands_in_its_row():
    assert stopped(NotApplicable("needs a licence")) == {"status": "skipped", "reason": "needs a licence"}
    assert stopped(ValueError("no")) == {"status": "failed", "reason": "ValueError: no"}
