"""Verdicts, fronts and order of the ladder's rows."""

from dataclasses import replace

import pytest

from tactbench.core.cost.ladder_rows import by_score, mark_fronts, stopped, timed
from tactbench.core.cost.rounds import Timing
from tactbench.core.errors import NotApplicable
from tactbench.core.report.costs import line
from tests.core.cost.test_rounds import Hours, timed_estimator


def row(name, score, fit_s, delay, *, baseline=False, status="done", looks_at="features"):
    return {
        "estimator": name, "looks_at": looks_at, "score": score, "fit_s": fit_s, "answer_delay_ms": delay,
        "is_baseline": baseline, "status": status, "front_fit": False, "front_delay": False,
    }  # fmt: skip


def at_once(name, **parts_ms):
    """An estimator of whose delay all that no machine decides is known."""
    return replace(
        timed_estimator(Hours(), name), delay_parts_ms={"sampling": 0.0, "link": 0.0, "window": 0.0, **parts_ms}
    )


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
    assert [one["estimator"] for one in rows if one["front_delay"]] == ["good"]
    errors = [{**one, "front_fit": False, "front_delay": False} for one in rows]
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
    assert [one["estimator"] for one in rows if one["front_fit"] or one["front_delay"]] == ["good"]


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
        (0.1, 50.0, 20, False, False),  # one call in ten misses the beat
        (0.1, 50.0, 8, True, True),  # one in twenty-five: the definition lets it
    ],
)
def test_a_loop_is_kept_by_its_95th_percentile(usual_ms, rare_ms, rare, hundred, thousand):
    latency = [usual_ms / 1e3] * (200 - rare) + [rare_ms / 1e3] * rare
    found = timed(at_once("a"), Timing([1.0], [1.0], latency, [0.0] * 200), {}, 1)
    assert (found["loop_100_hz"], found["loop_1000_hz"]) == (hundred, thousand)


def test_too_few_calls_for_a_95th_percentile_are_judged_by_the_largest():
    found = timed(at_once("a"), Timing([1.0], [1.0], [0.0001] * 198 + [0.05], [0.0] * 199), {}, 1)
    assert (found["latency_ms_p95"], found["latency_ms_max"]) == (None, 50.0)
    assert not found["loop_100_hz"]


def test_a_loop_waits_for_every_part_of_the_delay_and_is_told_of_the_longest():
    parts = {"sampling": 4.0, "link": 0.5, "window": 5.0}
    times = Timing([1.0], [1.0], [0.0001] * 200, [0.0003] * 200)
    found = timed(at_once("a", **parts), times, {}, 1)
    assert found["answer_delay_ms"] == pytest.approx(4.0 + 0.5 + 5.0 + 0.3 + 0.1)
    assert found["loop_100_hz"]
    later = timed(at_once("a", **parts | {"window": 5.2}), times, {}, 1)
    assert not later["loop_100_hz"]
    shown = line({**row("a", None, None, None), "reason": "", **later}, "N")
    assert shown["100 Hz loop"] == "no (window)"


def test_a_delay_that_is_not_known_is_no_verdict_and_on_no_front():
    found = timed(timed_estimator(Hours(), "a"), Timing([1.0], [1.0], [0.001] * 200, [0.0] * 200), {}, 1)
    assert (found["answer_delay_ms"], found["loop_100_hz"], found["loop_1000_hz"]) == (None, None, None)
    rows = [row("a", 0.9, 1.0, None), row("b", 0.5, 2.0, 3.0)]
    mark_fronts(rows, higher_is_better=True)
    assert [one["estimator"] for one in rows if one["front_delay"]] == ["b"]


def test_quartiles_and_rows_are_those_of_the_times():
    found = timed(timed_estimator(Hours(), "a"), Timing([5.0, 1.0, 3.0, 2.0, 4.0], [2.0], [0.004]), {}, 5)
    assert (found["fit_s_q1"], found["fit_s"], found["fit_s_q3"]) == (2.0, 3.0, 4.0)
    assert found["batch_s_per_row"] == 2.0 / 1000
    assert found["latency_ms_p50"] == 4.0
    assert found["fits"] == 5
    assert found["data_s"] is None
    assert found["data_kind"] is None


def test_what_stops_an_estimator_stands_in_its_row():
    assert stopped(NotApplicable("needs a licence")) == {"status": "skipped", "reason": "needs a licence"}
    assert stopped(ValueError("no")) == {"status": "failed", "reason": "ValueError: no"}
