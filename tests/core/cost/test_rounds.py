"""Timing in turns: on a clock that only the estimators move, every figure is exact."""

import gc
from dataclasses import replace

import numpy as np
import pytest
from threadpoolctl import threadpool_info

from tactbench.core.cost.ladder import by_score, mark_fronts, timed
from tactbench.core.cost.rounds import WARM_UP_ROWS, TimedEstimator, Timing, measure
from tactbench.core.evaluation.metrics import metric_called
from tactbench.core.matrix.progress import Progress

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
        threads = max(pool["num_threads"] for pool in threadpool_info())
        self.clock.log.append((self.name, what, gc.isenabled(), threads))
        took = self.takes[what]
        self.clock.now += next(took) if hasattr(took, "__next__") else took

    def fit(self, X, y):
        if len(X) <= WARM_UP_ROWS:
            self.clock.now += 300.0  # a library imports something late
            return
        self._work("fit")
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


def run(clock, *timed_estimators, rounds=5):
    named = {one.name: one for one in timed_estimators}
    return measure(named, rounds=rounds, seed=3, clock=clock, progress=Progress())


def test_times_are_those_taken_each_in_every_round_in_changing_order_without_collections_on_one_thread():
    clock = Clock()
    names = ["a", "b", "c", "d"]
    slow = {"fit_s": 2.0, "batch_s": 0.5, "row_s": 0.25}
    found = run(clock, *(timed_estimator(clock, name, **(slow if name == "b" else {})) for name in names))
    assert (found["a"].fit_s, found["a"].batch_s) == ([512 * BINARY] * 5, [256 * BINARY] * 5)
    assert found["a"].latency_s == [BINARY] * (5 * 200)
    assert (found["b"].fit_s, found["b"].batch_s) == ([2.0] * 5, [0.5] * 5)
    assert found["b"].latency_s == [0.25] * (5 * 20), "twenty calls a round where they take longer than 0.3 s"
    turns = [name for name, what, *_ in clock.log if what == "fit"]
    rounds = [turns[place : place + 4] for place in range(0, 20, 4)]
    assert all(sorted(one) == names for one in rounds)
    assert len({tuple(one) for one in rounds}) > 1
    assert {(collecting, threads) for *_, collecting, threads in clock.log} == {(False, 1)}
    assert gc.isenabled()


def test_a_fit_beyond_the_budget_is_done_once_and_its_row_says_so():
    clock = Clock()
    slow = timed_estimator(clock, "slow", fit_s=21.0, batch_s=22.0)
    found = run(clock, slow, timed_estimator(clock, "a"))
    assert (found["slow"].fit_s, found["slow"].batch_s, len(found["a"].fit_s)) == ([21.0], [22.0], 5)
    row = timed(slow, found["slow"])
    assert (row["fits"], row["batches"]) == (1, 1)


def test_an_estimator_that_breaks_ends_its_own_timing_only():
    clock = Clock()
    found = run(clock, timed_estimator(clock, "weak", broken_fit=3), timed_estimator(clock, "a"))
    assert (str(found["weak"].trouble), len(found["weak"].fit_s)) == ("broken", 2)
    assert (found["a"].trouble, len(found["a"].fit_s)) == (None, 5)


def test_a_row_has_medians_quartiles_and_every_part_of_the_delay():
    one = replace(timed_estimator(Clock(), "a"), delay_parts_ms={"sampling": 4.0, "link": 0.5, "window": 5.0})
    times = Timing([5.0, 1.0, 3.0, 2.0, 4.0], [2.0], [0.0001] * 198 + [0.05], [0.0003] * 199)
    found = timed(one, times)
    assert (found["fit_s_q1"], found["fit_s"], found["fit_s_q3"], found["fits"]) == (2.0, 3.0, 4.0, 5)
    assert found["batch_s_per_row"] == 2.0 / N
    assert found["answer_delay_ms"] == pytest.approx(4.0 + 0.5 + 5.0 + 0.3 + 0.1)
    assert found["answer_delay_ms"] == pytest.approx(sum(found["delay_parts_ms"].values()))
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
