"""Objects on several data sets in Python: one table, each cell once, the same numbers as alone."""

import numpy as np
import pytest
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.linear_model import LogisticRegression, Ridge
from sklearn.model_selection import GridSearchCV, GroupKFold, ShuffleSplit

import tactbench
from tactbench.core.errors import UnknownNameError, UsageError
from tactbench.core.spec.row import DIRECTIONS
from tests.core.evaluation.made import grasps, label_task, sessions


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    """Two data sets of five sessions each."""
    folders = {name: tmp_path_factory.mktemp(name) for name in ("soft", "hard")}
    for name, folder in folders.items():
        sessions(folder, "abcde" if name == "soft" else "fghij", n=80)
    return folders


class Counting(RegressorMixin, BaseEstimator):
    """The mean, and how often it was fitted in this process."""

    fitted = 0

    def fit(self, X, y):
        type(self).fitted += 1
        self.mean_ = np.mean(y)
        return self

    def predict(self, X):
        return np.full(len(X), self.mean_)


def median_of_errors(y, predicted):
    return np.median(np.abs(y - predicted))


def test_a_table_of_two_data_sets_has_the_scores_of_each_alone(data, tmp_path):
    models = {"search": GridSearchCV(Ridge(), {"alpha": [1.0, 9.0]}, cv=GroupKFold(2)), "ols": "ols"}
    found = tactbench.run(data=data, estimators=models, tasks="force", out=tmp_path, jobs=2)
    rows = {(row["data"], row["estimator"]): row for row in found}
    assert rows.keys() == {(name, one) for name in data for one in (*models, "mean", "time-index")}
    assert {row["status"] for row in found} == {"done"}
    for name, folder in data.items():
        alone = tactbench.evaluate(models["search"], "force", folder)
        mine = rows[name, "search"]
        assert (mine["score"], mine["ci_low"]) == (alone.score, alone.interval[0])
        assert mine["latency_ms_p50"] is None, "another cell is at work meanwhile"
    assert all(f"{name} · Force" in repr(found) for name in data)
    compared = found.compare("search", "ols")
    assert [pair["replicates"] for pair in compared] == [5, 5]
    assert len(tactbench.results(tmp_path / "soft")) == 4
    with pytest.raises(UnknownNameError):
        found.compare("search", "lasso")


def test_what_ended_is_found_again_while_object_metric_and_data_are_the_same(data, tmp_path):
    def run(model=None, **options):
        before = Counting.fitted
        given = {"data": {"soft": data["soft"]}, "estimators": {"mine": model or Counting()}, "tasks": "force"}
        (row,) = (one for one in tactbench.run(**given, out=tmp_path, jobs=1, **options) if one["estimator"] == "mine")
        return row, Counting.fitted - before

    first, fits = run()
    assert (fits, first["latency_ms_p50"] is not None) == (5, True)
    assert run() == (first, 0)
    other = Counting()
    other.offset = 1.0
    assert run(other)[1] == 5
    assert run(metric=median_of_errors, greater_is_better=False)[1] == 5
    assert run(metric=median_of_errors, greater_is_better=False)[1] == 0
    assert run(split=GroupKFold(2), groups="session")[1] == 2


def test_an_object_whose_source_cannot_be_told_is_computed_anew_and_says_so(data, tmp_path):
    class Local(Counting):
        fitted = 0

    for _ in range(2):
        found = tactbench.run(data={"soft": data["soft"]}, estimators=Local(), tasks="force", out=tmp_path, jobs=1)
        (row,) = (one for one in found if one["estimator"] == "Local")
        assert any("anew" in remark for remark in row["remarks"])
    assert Local.fitted == 10
    assert "Local" not in {row["estimator"] for row in tactbench.results(tmp_path / "soft")}


def test_options_may_differ_between_data_sets_and_estimators(data, tmp_path):
    drawn = ShuffleSplit(3, test_size=0.2)  # without a seed: all are tested on the folds that it draws first
    found = tactbench.run(
        data=data, estimators={"mine": Ridge(), "other": Ridge(10.0)}, tasks={"soft": "force", "hard": ["force"]},
        split={"soft": drawn}, metric={"hard": median_of_errors}, greater_is_better={"hard": False}, jobs=1,
        out=tmp_path,
    )  # fmt: skip
    rows = {(row["data"], row["estimator"]): row for row in found}
    assert rows["soft", "mine"]["ci_low"] is None
    assert rows["soft", "mine"]["metric"] == "rmse"
    assert rows["hard", "mine"]["metric"] == f"median_of_errors{DIRECTIONS[0]}"
    assert rows["soft", "mine"]["fold_sizes"] == rows["soft", "other"]["fold_sizes"]


def test_each_estimator_may_have_a_split_of_its_own(data, tmp_path):
    found = tactbench.run(
        data={"soft": data["soft"]}, estimators={"mine": Ridge(), "other": Ridge(10.0)}, tasks="force", jobs=1,
        out=tmp_path, split={"mine": GroupKFold(2), "other": GroupKFold(4)}, groups="session",
    )  # fmt: skip
    folds = {row["estimator"]: len(row["fold_sizes"]) for row in found if not row["is_baseline"]}
    assert folds == {"mine": 2, "other": 4}


def test_sensors_of_a_data_set_stand_in_one_table_and_a_failing_object_is_a_row(tmp_path):
    sessions(tmp_path / "in", "abcde", n=40, called="left")
    sessions(tmp_path / "in", "fghij", n=40, called="right")
    models = {"mine": Ridge(), "classes": LogisticRegression()}
    found = tactbench.run(
        data={"both": tmp_path / "in"}, estimators=models, tasks="force", out=tmp_path / "out", jobs=1
    )
    status = {(row["sensor"], row["estimator"]): row["status"] for row in found if not row["is_baseline"]}
    assert status == {
        (name, one): "failed" if one == "classes" else "done" for name in ("left", "right") for one in models
    }
    assert len(found.table.blocks) == 1


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"data": []}, "data="),
        ({"estimators": ()}, "estimators="),
        ({"tasks": ()}, "tasks="),
        ({"tasks": {"soft": "force"}}, "tasks="),
        ({"jobs": 0}, "jobs=0"),
        ({"task": "force"}, "`task`"),
        ({"spilt": "session"}, "'split'"),
        ({"split": {"sof": "session"}}, "split="),
        ({"split": ShuffleSplit(3), "groups": "sesion"}, "groups='sesion'"),
    ],
)
def test_mistakes_are_named_before_anything_is_computed(data, tmp_path, given, said):
    with pytest.raises(UsageError, match=said):
        tactbench.run(**{"data": data, "estimators": Ridge(), "tasks": "force", "out": tmp_path / "out", **given})
    assert not (tmp_path / "out").exists()


def test_answers_are_drawn_over_the_truth_or_as_how_often_each_class_is_taken_for_which(data, tmp_path):
    pytest.importorskip("pandas")
    found = tactbench.evaluate(Ridge(), "force", data["soft"])
    figure = found.plot()
    (axes,) = figure.axes
    assert len(axes.collections[0].get_offsets()) == len(found.predictions)
    assert list(found.predictions) == ["recording", "row", "time_s", "fold", "y_true", "y_pred"]
    assert set(found.predictions["fold"]) == set(found.fold_scores)

    classes = tactbench.evaluate(LogisticRegression(), label_task("kind"), grasps(tmp_path))
    (axes,) = classes.plot().axes
    assert axes.images[0].get_array().shape == (2, 2)
