"""What is done with estimators that misbehave: they may come from anybody."""

import re
import warnings
from collections import Counter
from functools import partial

import numpy as np
import pytest
from sklearn import config_context
from sklearn.linear_model import Ridge
from sklearn.model_selection import GridSearchCV, GroupKFold
from sklearn.pipeline import make_pipeline

from tactbench.core.errors import DataError, PluginContractError
from tactbench.core.evaluation.fitting import answers, fit, routed
from tactbench.core.evaluation.folds import PLAIN, load_task
from tactbench.core.evaluation.sets import prepared
from tactbench.core.plugins.registry import installed

from .made import evaluated, force_task, label_task, ramp, record, sessions


class Answering:
    """Answers with what it is given, or the mean of what it learned; it may complain while it learns."""

    def __init__(self, given=None, complaint=None):
        self.given, self.complaint = given, complaint

    def fit(self, X, y):
        if isinstance(self.complaint, Exception):
            raise self.complaint
        if self.complaint:
            warnings.warn(self.complaint, RuntimeWarning, stacklevel=2)
        self.mean = np.mean(y)

    def predict(self, X):
        return np.full(len(X), self.mean) if self.given is None else self.given


@pytest.mark.parametrize(
    ("given", "n_classes", "says"),
    [
        (np.zeros((3, 1)), 0, r"shape \(3, 1\)"),
        (np.array([0.0, np.nan, np.inf]), 0, "2 values"),
        (np.array(["a", "b", "c"]), 3, "type"),
        (np.array([0.0, 0.5, 1.0]), 3, "regressor"),
    ],
)
def test_an_answer_that_cannot_be_scored_is_refused_naming_the_estimator(given, n_classes, says):
    with pytest.raises(PluginContractError, match=rf"'theirs'.*{says}"):
        answers(Answering(given), np.zeros((3, 2)), "theirs", n_classes)


def test_what_an_estimator_warns_of_is_counted_and_what_it_refuses_is_an_error_under_its_name():
    counts = Counter()
    for _ in range(2):
        fit(Answering(None, "did not converge"), np.zeros((3, 1)), np.arange(3), "theirs", counts)
    ((what, n),) = counts.items()
    assert ("theirs" in what, what.split()[-1], n) == (True, "RuntimeWarning", 2)
    with pytest.raises(DataError, match=r"'theirs'.*too small"):
        fit(Answering(None, ValueError("too small")), np.zeros((3, 1)), np.arange(3), "theirs", Counter())


def test_a_score_that_is_undefined_is_left_out_or_refused_never_nan(tmp_path):
    X, force = ramp(0)
    paths = [
        record(tmp_path / f"{role}.h5", X, y, session=role, role=role)
        for role, y in (("train", force), ("test", 0 * force + 2))
    ]
    result = evaluated(force_task(), paths, "mean", split="roles")
    assert "r2" not in result.scores
    with pytest.raises(DataError, match=r"r2.*1600"):
        evaluated(force_task(metric="r2"), paths, "mean", split="roles")


def test_folds_that_choose_differently_are_reported_each(tmp_path):
    """A middle value of two folds would be a penalty that nobody chose."""

    def noisy(place, n):
        noise = (0.1, 3.0)[place % 2]
        return ramp(place, n, noise=20.0 * noise, label_noise=noise)

    ridge = installed().estimators["ridge"]
    result = evaluated(force_task(), sessions(tmp_path, "abcd", make=noisy), ridge)
    allowed = {"alpha": ridge.grid["alpha"], "k": ridge.window_grid}
    assert any(" of fold " in name for name in result.chosen), result.chosen
    assert all(value in allowed[name.split()[0]] for name, value in result.chosen.items())


def test_the_same_seed_gives_the_same_score_bit_by_bit_with_one_thread_or_two(tmp_path):
    paths = sessions(tmp_path, "ab", 1600, partial(ramp, label_noise=0.5))
    first, second, other = (
        evaluated(force_task(), paths, "forest", params={"n_estimators": 20}, seed=seed, threads=threads)
        for seed, threads in ((0, 1), (0, 2), (1, 1))
    )
    assert np.array_equal(first.sets["test"].y_pred, second.sets["test"].y_pred)
    assert (first.score, first.ci_low, first.ci_high) == (second.score, second.ci_low, second.ci_high)
    assert other.score != first.score


def test_a_number_that_cannot_be_computed_with_is_named(tmp_path):
    X, force = ramp(0, n=200)
    for column, name in ((force, "the target"), (X[:, 1], "t1")):
        column[100:] = 1e300
        with pytest.raises(DataError, match=rf"'{name}', {name}.*1e\+300"):
            load_task(force_task(), [record(tmp_path / f"{name}.h5", X, force)], "deployable")


def test_a_class_that_no_training_row_has_is_named(tmp_path):
    paths = [record(tmp_path / f"{n}.h5", *ramp(n), session=f"{n}", labels={"kind": "abc"[n]}) for n in range(3)]
    result = evaluated(label_task(), paths, "logistic", split="session")
    assert result.score == 0.0
    assert [re.findall("'(.)' in (.)", found) for found in result.findings] == [[("a", "0"), ("b", "1"), ("c", "2")]]


def test_training_rows_too_few_to_choose_by_are_refused_and_not_where_nothing_is_chosen(tmp_path):
    paths = sessions(tmp_path, "ab", n=4)
    with pytest.raises(DataError, match="hyper-parameters"):
        evaluated(force_task(), paths, "ridge", split="session")
    assert evaluated(force_task(), paths, "mean", split="session").n_test == 8


class Grouped(Answering):
    def fit(self, X, y, groups):
        super().fit(X, y)


def test_arguments_of_fit_are_cut_to_the_training_rows(tmp_path):
    data = load_task(force_task(), sessions(tmp_path, n=20), "deployable", "session")
    train = prepared(data.assignments[0], data.data, data.rules, 0, Counter()).train
    given = {name: of(train) for name, of in routed(Grouped(), data, {"row": np.arange(60), "way": "x"}).items()}
    assert {name: list(value) for name, value in given.items()} == {
        "groups": ["b"] * 20 + ["c"] * 20, "row": [*range(20, 60)], "way": ["x"],
    }  # fmt: skip
    search = make_pipeline(GridSearchCV(Ridge(), {"alpha": [1.0, 2.0]}, cv=GroupKFold(2)))
    assert [*routed(search, data, {})] == ["gridsearchcv__groups"]
    assert routed(Answering(), data, {}) == {}
    with config_context(enable_metadata_routing=True):
        assert [*routed(search, data, {})] == ["groups"]


def test_answers_that_overflow_are_named(tmp_path):
    paths = sessions(tmp_path, "ab", n=100)
    far = Answering(np.full(100, 1e308))
    with pytest.raises(PluginContractError, match=r"'Answering'.*1e\+308"):
        evaluated(force_task(), paths, PLAIN, given=far)
