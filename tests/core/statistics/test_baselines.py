"""The baseline column: the best trivial answer that used the same knowledge."""

from tactbench.core.statistics.replicates import over_replicates
from tests.core.leaderboard.rows import row


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
