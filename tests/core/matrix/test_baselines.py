"""The baseline column: the best trivial answer that used the same knowledge."""

import pytest

from tactbench.core.leaderboard.table import build_table
from tactbench.core.matrix.summary import fill_baselines
from tests.core.leaderboard.rows import row


def filled(metric="rmse", scores=None, **more):
    given = scores or {"lasso": 0.7, "mean": 1.6, "median": 1.5, "time-index": 0.6}
    looks = {"lasso": "features", "time-index": "time", "clock": "time"}
    rows = [
        row(estimator=name, score=score, cell=f"c-{name}", metric=metric, is_baseline=name not in ("lasso", "clock"),
            looks_at=looks.get(name, "nothing"), **more)
        for name, score in given.items()
    ]  # fmt: skip
    fill_baselines(rows)
    return {one["estimator"]: one for one in rows}


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


@pytest.mark.parametrize(("metric", "good", "bad"), [("rmse", 0.3, 1.5), ("rmse", 0.3, 2.0), ("macro_f1", 0.5, 0.1)])
def test_nobody_who_is_no_better_has_a_place(metric, good, bad):
    trivial = {"mean": 1.6, "median": 1.5} if metric == "rmse" else {"chance": 0.2, "majority": 0.07}
    rows = [*filled(metric, {"lasso": good, **trivial}, sensor="a").values()]
    rows += filled(metric, {"lasso": bad, **trivial}, sensor="b").values()
    for one in rows:
        one["cell"] = f"{one['sensor']}-{one['estimator']}"
    table = build_table(rows)
    (block,) = table.blocks
    places = {line.row["cell"]: line.texts["place"] for line in block.lines}
    assert places.pop("a-lasso") == "1"
    assert places.pop("b-lasso") == "–"
    assert set(places.values()) == {""}
    kinds = {line.row["cell"]: line.kind for line in block.lines}
    assert kinds["b-lasso"] == "result"
    order = [line.row["cell"] for line in block.lines]
    assert order[:2] == ["a-lasso", "b-lasso"]
    assert any(note.startswith("–  no better than the trivial answer of its own sensor") for note in table.notes)
