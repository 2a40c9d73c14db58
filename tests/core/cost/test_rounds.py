"""Timing in turns, on a clock that only the estimators move: every figure is exact. Fronts of what was timed."""

import gc
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from threadpoolctl import threadpool_info

from tactbench.core.cost.ladder import by_score, mark_fronts, timed
from tactbench.core.cost.precision import precise, quickest_enough
from tactbench.core.cost.rounds import WARM_UP_ROWS, TimedEstimator, Timing, measure
from tactbench.core.evaluation.metrics import metric_called
from tactbench.core.progress import Progress
from tactbench.plugin.simulation import CostPoint

N = 1000
BINARY = 2.0**-10  # durations that add up without rounding


class Clock:
    """Stands still unless an estimator works."""

    def __init__(self):
        self.now, self.log = 0.0, []

    def __call__(self):
        return self.now


class Worker:
    """Takes stated times, and answers nought."""

    def __init__(self, clock, name, fit_s, batch_s, row_s, broken_fit):
        self.clock, self.name, self.broken_fit = clock, name, broken_fit
        self.takes = {"fit": fit_s, "batch": batch_s, "row": row_s}

    def _work(self, what):
        self.clock.log.append((self.name, what, gc.isenabled()))
        self.clock.now += self.takes[what]

    def fit(self, X, y):
        if len(X) <= WARM_UP_ROWS:
            self.clock.now += 300.0  # a library imports something late
            return
        self._work("fit")
        assert max(pool["num_threads"] for pool in threadpool_info()) == 1
        if sum(entry[:2] == (self.name, "fit") for entry in self.clock.log) == self.broken_fit:
            raise RuntimeError("broken")

    def predict(self, X):
        if len(X) > 1 or self.clock.log:
            self._work("row" if len(X) == 1 else "batch")
        return np.zeros(len(X))


def timed_estimator(clock, name, *, fit_s=512 * BINARY, batch_s=256 * BINARY, row_s=BINARY, broken_fit=None):
    rows = np.zeros((N, 2))
    return TimedEstimator(
        name=name, build=lambda: Worker(clock, name, fit_s, batch_s, row_s, broken_fit), fold="roles", X_train=rows,
        y_train=np.zeros(N), X_test=rows, y_test=np.ones(N), n_classes=0, metric=metric_called("rmse"),
    )  # fmt: skip


@pytest.fixture(scope="module")
def three_rounds():
    """What four estimators took, and the clock: two slow ones, and one that breaks in its second fit."""
    clock = Clock()
    some = {"a": {}, "slow": {"fit_s": 2.0, "batch_s": 0.5, "row_s": 0.25}, "weak": {"broken_fit": 2},
            "too slow": {"fit_s": 21.0, "batch_s": 22.0}}  # fmt: skip
    estimators = {name: timed_estimator(clock, name, **more) for name, more in some.items()}
    return measure(estimators, rounds=3, seed=0, clock=clock, progress=Progress()), clock


def test_times_are_those_taken(three_rounds):
    found, _ = three_rounds
    assert (found["a"].fit_s, found["a"].batch_s) == ([512 * BINARY] * 3, [256 * BINARY] * 3)
    assert found["a"].latency_s == [BINARY] * (3 * 200)
    assert (found["slow"].fit_s, found["slow"].batch_s) == ([2.0] * 3, [0.5] * 3)
    assert found["slow"].latency_s == [0.25] * (3 * 20), "twenty calls a round where they take longer than 0.3 s"


def test_each_is_timed_in_every_round_in_changing_order_without_collections(three_rounds):
    _, clock = three_rounds
    turns = [name for name, what, _ in clock.log if what == "fit" and name in ("a", "slow")]
    assert {tuple(turns[place : place + 2]) for place in (0, 2, 4)} == {("a", "slow"), ("slow", "a")}
    assert not any(collecting for *_, collecting in clock.log)
    assert gc.isenabled()


def test_a_fit_beyond_the_budget_is_done_once_and_its_row_says_so(three_rounds):
    slow = three_rounds[0]["too slow"]
    assert (slow.fit_s, slow.batch_s) == ([21.0], [22.0])
    row = timed(timed_estimator(Clock(), "too slow"), slow)
    assert (row["fits"], row["batches"]) == (1, 1)


def test_an_estimator_that_breaks_ends_its_own_timing_only(three_rounds):
    weak = three_rounds[0]["weak"]
    assert (str(weak.trouble), len(weak.fit_s)) == ("broken", 1)


def test_a_row_has_medians_quartiles_and_every_part_of_the_delay():
    one = replace(timed_estimator(Clock(), "a"), delay_parts_ms={"sampling": 4.0, "link": 0.5, "window": 5.0})
    times = Timing([5.0, 1.0, 3.0, 2.0, 4.0], [2.0], [0.0001] * 198 + [0.05], [0.0003] * 199)
    found = timed(one, times)
    assert (found["fit_s_q1"], found["fit_s"], found["fit_s_q3"], found["fits"]) == (2.0, 3.0, 4.0, 5)
    assert found["batch_s_per_row"] == 2.0 / N
    assert found["answer_delay_ms"] == pytest.approx(4.0 + 0.5 + 5.0 + 0.3 + 0.1)
    assert (found["latency_ms_p95"], found["latency_ms_max"]) == (None, 50.0), "too few calls: the largest"
    unknown = timed(timed_estimator(Clock(), "a"), times)
    assert (unknown["answer_delay_ms"], unknown["answer_delay_ms_q1"]) == (None, None)


def row(name, score, fit_s, delay_ms, **more):
    return {
        "estimator": name, "score": score, "fit_s": fit_s, "answer_delay_ms": delay_ms, "is_baseline": False,
        "looks_at": "features", "status": "done", "front_fit": False, "front_delay": False, **more,
    }  # fmt: skip


@pytest.mark.parametrize(("higher", "sign"), [(True, 1.0), (False, -1.0)])
def test_fronts_are_of_what_is_better_than_the_best_answer_from_nothing(higher, sign):
    rows = [
        row("quick", sign * 0.6, 1.0, None),
        row("good", sign * 0.9, 5.0, 1.0),
        row("slower", sign * 0.7, 6.0, 4.0),
        row("no better", sign * 0.5, 0.5, 0.5),
        row("mean", sign * 0.5, 0.1, 0.1, is_baseline=True, looks_at="nothing"),
        row("time", sign * 1.0, 0.1, 0.1, is_baseline=True, looks_at="time"),
        row("gone", None, 0.1, 0.1, status="failed"),
    ]
    mark_fronts(rows, higher_is_better=higher)
    assert [one["estimator"] for one in rows if one["front_fit"]] == ["quick", "good"]
    assert [one["estimator"] for one in rows if one["front_delay"]] == ["good"]
    names = [one["estimator"] for one in by_score(rows, higher_is_better=higher)]
    assert names == ["time", "good", "slower", "quick", "no better", "mean", "gone"]


def cost_point(seconds, error, *, default=False, floor=0.3):
    return CostPoint(
        subject="pad", observable="taxel", label="way", seconds=seconds, error=error, worst=2 * error, unit="count",
        floor=floor, default=default, settings={"family": "newton"},
    )  # fmt: skip


POSITIVE = st.floats(1e-6, 1e3)


@given(st.lists(st.tuples(POSITIVE, POSITIVE), min_size=1, max_size=20))
def test_the_front_is_beaten_by_nobody_and_beats_everybody_else(pairs):
    points = [cost_point(*pair) for pair in pairs]
    best = precise(points)
    for point in points:
        beaten = any(o.seconds <= point.seconds and o.error <= point.error for o in best)
        assert beaten
    for one in best:
        assert not any(o.seconds < one.seconds and o.error <= one.error for o in points)
    assert [p.error for p in best] == sorted((p.error for p in best), reverse=True)


def test_the_quickest_point_that_will_do():
    quick, default, slow = cost_point(0.1, 0.5), cost_point(0.2, 0.05, default=True), cost_point(1.0, 0.01)
    assert quickest_enough([quick, default, slow]) is default
    assert quickest_enough([quick, cost_point(0.2, 0.2)]) is None
    assert quickest_enough([cost_point(1, 1, floor=math.inf)]) is None, "no noise is stated"
