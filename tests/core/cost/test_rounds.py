"""Timing turn and turn about: on a clock that only the estimators move, every figure is exact."""

import gc

import numpy as np
import pytest
from threadpoolctl import threadpool_info

from tactbench.core.cost.ladder_rows import timed
from tactbench.core.cost.rounds import REPEATS, WARM_UP_ROWS, measure
from tactbench.core.cost.timed_estimators import TimedEstimator
from tactbench.core.evaluation.metrics import metric_called
from tactbench.core.matrix.progress import Progress

N = 1000
BINARY = 2.0**-10  # durations that add up without rounding


class Hours:
    """A clock that stands still unless somebody works."""

    def __init__(self):
        self.now = 0.0
        self.log = []

    def __call__(self):
        return self.now


class Worker:
    """Takes stated times, and answers nought."""

    def __init__(self, clock, name, fit_s, batch_s, row_s, broken_fit=None):
        self.clock, self.name, self.broken_fit = clock, name, broken_fit
        self.takes = {"fit": fit_s, "batch": batch_s, "row": row_s}

    def _work(self, what):
        self.clock.log.append((self.name, what, gc.isenabled()))
        took = self.takes[what]
        self.clock.now += next(took) if hasattr(took, "__next__") else took

    def fit(self, X, y):
        if len(X) <= WARM_UP_ROWS:
            return
        self._work("fit")
        fits = sum(entry[:2] == (self.name, "fit") for entry in self.clock.log)
        if self.broken_fit is not None and fits >= self.broken_fit:
            raise RuntimeError("broken")

    def predict(self, X):
        if len(X) > 1 or self.clock.log:
            self._work("row" if len(X) == 1 else "batch")
        return np.zeros(len(X))


def timed_estimator(clock, name, *, fit_s=512 * BINARY, batch_s=256 * BINARY, row_s=BINARY, **more):
    rows = np.zeros((N, 2))
    return TimedEstimator(
        name=name, build=lambda: Worker(clock, name, fit_s, batch_s, row_s, **more), fold="roles", X_train=rows,
        y_train=np.zeros(N), X_test=rows, y_test=np.ones(N), n_classes=0, metric=metric_called("rmse"), trained_on=(),
    )  # fmt: skip


def run(clock, *timed_estimators, rounds=5, threads=1):
    named = {one.name: one for one in timed_estimators}
    return measure(named, rounds=rounds, threads=threads, seed=3, clock=clock, progress=Progress())


def test_what_took_so_long_is_said_to_have_taken_so_long():
    clock = Hours()
    found = run(clock, timed_estimator(clock, "a"), timed_estimator(clock, "b", fit_s=2.0, batch_s=0.5, row_s=0.25))
    assert found["a"].fit_s == [512 * BINARY] * 5
    assert found["a"].batch_s == [256 * BINARY] * 5
    assert set(found["a"].latency_s) == {BINARY}
    assert len(found["a"].latency_s) == 5 * 200
    assert found["b"].fit_s == [2.0] * 5
    assert found["b"].batch_s == [0.5] * 5
    assert found["b"].latency_s == [0.25] * (5 * 20), "twenty calls a round where they take longer than 0.3 s"


def test_everybody_has_one_turn_in_every_round_and_not_always_in_the_same_order():
    clock = Hours()
    names = ["a", "b", "c", "d"]
    run(clock, *(timed_estimator(clock, name) for name in names))
    turns = [name for name, what, _ in clock.log if what == "fit"]
    rounds = [turns[place : place + 4] for place in range(0, 20, 4)]
    assert all(sorted(one) == names for one in rounds)
    assert len({tuple(one) for one in rounds}) > 1


def test_nobody_collects_garbage_while_a_clock_runs_and_everybody_may_afterwards():
    clock = Hours()
    assert gc.isenabled()
    run(clock, timed_estimator(clock, "a", broken_fit=2), timed_estimator(clock, "b"))
    assert not any(collecting for _, _, collecting in clock.log)
    assert gc.isenabled()


@pytest.mark.parametrize("kept_before", [True, False])
def test_what_was_kept_from_collections_before_is_afterwards_and_nothing_else(kept_before):
    was_kept = gc.get_freeze_count() > 0
    (gc.freeze if kept_before else gc.unfreeze)()
    kept = gc.get_freeze_count()
    try:
        run(Hours(), timed_estimator(Hours(), "a"))
        assert gc.get_freeze_count() >= kept if kept_before else gc.get_freeze_count() == 0
    finally:
        (gc.freeze if was_kept else gc.unfreeze)()


def test_a_fit_beyond_the_budget_is_done_once_and_its_row_says_so():
    clock = Hours()
    slow = timed_estimator(clock, "slow", fit_s=21.0, batch_s=22.0)
    found = run(clock, slow, timed_estimator(clock, "a"))
    assert found["slow"].fit_s == [21.0]
    assert found["slow"].batch_s == [22.0]
    assert len(found["slow"].latency_s) == 5 * 200
    notes = timed(slow, found["slow"], {}, 5)["notes"]
    assert notes == [
        "fitted in 1 of 5 rounds: one took more than 20 s",
        "all test rows answered in 1 of 5 rounds: one took more than 20 s",
    ]
    assert len(found["a"].fit_s) == 5


def test_an_estimator_that_breaks_ends_its_own_timing_only():
    clock = Hours()
    found = run(clock, timed_estimator(clock, "weak", broken_fit=3), timed_estimator(clock, "a"))
    assert str(found["weak"].trouble) == "broken"
    assert len(found["weak"].fit_s) == 2
    assert found["a"].trouble is None
    assert len(found["a"].fit_s) == 5


def test_a_short_fit_is_repeated_so_that_one_interruption_is_not_all_that_is_measured():
    clock = Hours()
    interrupted = (1.0 if place % REPEATS == 3 else BINARY for place in range(10**6))
    found = run(clock, timed_estimator(clock, "a", fit_s=interrupted), rounds=1)
    assert found["a"].fit_s == [BINARY]
    fits = sum(what == "fit" for _, what, _ in clock.log)
    assert fits == 4, "the interruption itself used up the time for repeats"


def test_what_a_library_does_once_is_no_part_of_a_fit():
    clock = Hours()
    imports = iter([300.0])

    class Late(Worker):
        def fit(self, X, y):
            self.clock.now += next(imports, 0.0)
            super().fit(X, y)

    one = timed_estimator(clock, "a")
    late = TimedEstimator(**{**one.__dict__, "build": lambda: Late(clock, "a", 1.0, 1.0, 1.0)})
    assert run(clock, late)["a"].fit_s == [1.0] * 5
    assert clock.now > 300.0


@pytest.mark.parametrize("threads", [1, 2])
def test_numerical_libraries_keep_to_the_threads_that_are_stated(threads):
    clock, seen = Hours(), []

    class Counting(Worker):
        def _work(self, what):
            super()._work(what)
            seen.append(max(pool["num_threads"] for pool in threadpool_info()))

    one = timed_estimator(clock, "a")
    counting = Counting(clock, "a", 1.0, 1.0, 1.0)
    run(clock, TimedEstimator(**{**one.__dict__, "build": lambda: counting}), rounds=1, threads=threads)
    assert set(seen) == {threads}


def test_a_model_that_is_not_the_scored_one_is_told_of():
    clock = Hours()
    one = timed_estimator(clock, "a")
    times = run(clock, one, rounds=1)["a"]
    # Noughts against ones: an rmse of exactly 1.
    assert timed(one, times, {"fold roles": 1.0}, 1)["notes"] == []
    assert timed(one, times, {"fold roles": 0.9}, 1)["notes"] == [
        "the timed model scores 1 on fold roles, the cell's 0.9"
    ]
