"""What scikit-learn's users bring: splitters, metrics, fit parameters, windows and arrays of their own."""

import numpy as np
import pytest
import sklearn
from sklearn.ensemble import StackingRegressor
from sklearn.linear_model import LogisticRegression, LogisticRegressionCV, Ridge
from sklearn.metrics import make_scorer, mean_absolute_error, median_absolute_error
from sklearn.model_selection import (
    GridSearchCV,
    GroupKFold,
    KFold,
    LeaveOneGroupOut,
    ShuffleSplit,
    StratifiedKFold,
    TimeSeriesSplit,
    cross_validate,
)
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

import tactbench
from tactbench.core.errors import DataError, NotApplicable, UsageError
from tactbench.core.spec.row import DIRECTIONS
from tests.core.evaluation.made import grasps, label_task, ramp, record

LOWER, HIGHER = DIRECTIONS


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Six sessions of presses."""
    folder = tmp_path_factory.mktemp("presses")
    for place, name in enumerate("abcdef"):
        record(folder / f"{name}.h5", *ramp(place, n=60), session=name, annotations={"press": np.arange(60) // 20})
    return folder


def scaled(model):
    return make_pipeline(StandardScaler(), model)


def nested():
    return GridSearchCV(scaled(Ridge()), {"ridge__alpha": [1e-3, 1.0, 100.0]}, cv=GroupKFold(3))


# Splits


@pytest.mark.parametrize(
    ("split", "groups"),
    [
        (LeaveOneGroupOut(), "recording"),
        (GroupKFold(5), np.arange(360) // 30),
        (ShuffleSplit(2, test_size=0.25, random_state=0), None),
        ([(np.arange(180), np.arange(180, 360)), (np.arange(180, 360), np.arange(180))], None),
    ],
)
def test_folds_of_a_splitter_are_those_of_cross_validate(folder, split, groups):
    model = scaled(Ridge())
    data = tactbench.load_task("force", folder, split=split, groups=groups)
    labels = data.per_row("groups", groups) if groups is not None else None
    cv = list(split.split(data.X, data.y, labels)) if hasattr(split, "split") else split
    for (train, test), (given, tested) in zip(data.folds, cv, strict=True):
        np.testing.assert_array_equal(train, np.sort(given))
        np.testing.assert_array_equal(test, np.sort(tested))
    theirs = cross_validate(model, data.X, data.y, cv=cv, scoring="neg_root_mean_squared_error")["test_score"]
    found = tactbench.evaluate(model, "force", folder, split=split, groups=groups)
    # Scaled twice, a number differs in its last digits.
    np.testing.assert_allclose(list(found.fold_scores.values()), -theirs, rtol=1e-9)


def test_what_a_splitter_holds_out_is_the_unit_of_the_interval(folder):
    by_session = tactbench.evaluate(Ridge(), "force", folder, split=GroupKFold(3), groups="session")
    assert "6 sessions" in by_session.row["ci_method"]
    assert by_session.interval[0] < by_session.score < by_session.interval[1]
    assert by_session.row["stamps"] == []
    few = tactbench.evaluate(Ridge(), "force", folder, split=GroupKFold(3), groups=np.arange(360) // 90)
    assert few.interval is None
    assert len(few.row["replicate_scores"]) == 4
    none = tactbench.evaluate(Ridge(), "force", folder, split=KFold(6))
    assert (none.interval, none.row["stamps"]) == (None, [])  # each fold is a recording


@pytest.mark.parametrize(
    ("split", "groups", "said"),
    [
        (KFold(4), "session", "session b"),
        (KFold(3, shuffle=True, random_state=0), None, "recording a"),
        (TimeSeriesSplit(7), None, "recording a"),
    ],
)
def test_a_group_on_both_sides_is_stamped(folder, split, groups, said):
    found = tactbench.evaluate(Ridge(), "force", folder, split=split, groups=groups)
    assert [one.startswith("leaks: ") and said in one for one in found.row["stamps"]] == [True]
    assert "leaks" in repr(found)


def test_classes_are_stratified_as_scikit_learn_does(tmp_path):
    path = grasps(tmp_path)
    found = tactbench.evaluate(
        LogisticRegression(), label_task("kind"), path, split=StratifiedKFold(4), groups="object", metric="f1_macro"
    )
    assert len(found.fold_scores) == 4
    assert "12 objects" in found.row["ci_method"]
    assert found.score == pytest.approx(found.row["scores"]["macro_f1"], rel=1e-12)  # rounding


# Metrics


@pytest.mark.parametrize(
    ("metric", "more", "named"),
    [
        ("mae", {}, "mae"),
        ("neg_median_absolute_error", {}, f"median_absolute_error{LOWER}"),
        (make_scorer(median_absolute_error, greater_is_better=False), {}, f"median_absolute_error{LOWER}"),
        (median_absolute_error, {"greater_is_better": False}, f"median_absolute_error{LOWER}"),
        (lambda y, p: np.corrcoef(y, p)[0, 1], {"greater_is_better": True}, f"<lambda>{HIGHER}"),
    ],
)
def test_a_metric_is_a_name_a_scorer_or_a_function(folder, metric, more, named):
    found = tactbench.evaluate(Ridge(), "force", folder, metric=metric, **more)
    assert found.row["metric"] == named
    low, high = found.interval
    assert low < found.score < high
    assert next(iter(found))["estimator"] == "Ridge"
    assert set(found.recording_scores) == set("abcdef")


def test_a_scorer_gives_what_cross_validate_gives(folder):
    data = tactbench.load_task("force", folder)
    scorer = make_scorer(mean_absolute_error, greater_is_better=False)
    theirs = cross_validate(scaled(Ridge()), data.X, data.y, cv=data.folds, scoring=scorer)["test_score"]
    found = tactbench.evaluate(scaled(Ridge()), "force", folder, metric=scorer)
    np.testing.assert_allclose(list(found.fold_scores.values()), -theirs, rtol=1e-9)  # scaled twice
    same = tactbench.evaluate(scaled(Ridge()), "force", folder, metric="mae")
    assert found.score == pytest.approx(same.score, rel=1e-12)  # order of the sum
    # The scale of a mean error is known to be reciprocal, that of a function is not.
    np.testing.assert_allclose(found.interval, same.interval, rtol=0.2)
    compared = found.compare("StandardScaler+Ridge", "mean")[0]
    assert (compared["verdict"], compared["replicates"]) == ("better", 6)


def test_a_metric_that_fails_is_told_as_such(folder):
    def wrong(y, p):
        raise KeyError("x")

    with pytest.raises(UsageError, match=r"metric wrong .*KeyError: 'x'"):
        tactbench.evaluate(Ridge(), "force", folder, metric=wrong, greater_is_better=True)
    with pytest.raises(DataError):
        tactbench.evaluate(Ridge(), "force", folder, metric=lambda y, p: np.nan, greater_is_better=True)


# What fit takes


def test_groups_reach_the_search_within_a_fold(folder):
    found = tactbench.evaluate(nested(), "force", folder, split=GroupKFold(3), groups="session")
    data = tactbench.load_task("force", folder, split=GroupKFold(3), groups="session")
    theirs = cross_validate(
        nested(), data.X, data.y, groups=data.groups, cv=GroupKFold(3), params={"groups": data.groups},
        scoring="neg_root_mean_squared_error",
    )["test_score"]  # fmt: skip
    np.testing.assert_allclose(list(found.fold_scores.values()), -theirs, rtol=1e-9)  # scaled twice
    by_name = tactbench.evaluate(nested(), "force", folder)  # by session, and by session inside
    assert by_name.score < by_name.trivial["mean"]
    inside = make_pipeline(StandardScaler(), GridSearchCV(Ridge(), {"alpha": [0.1, 1.0]}, cv=GroupKFold(3)))
    assert tactbench.evaluate(inside, "force", folder).score < by_name.trivial["mean"]
    own = tactbench.evaluate(LogisticRegressionCV(Cs=2, cv=2), label_task("press"), folder, split=KFold(6))
    assert own.row["status"] == "done", "its own cross-validation takes no groups"


@sklearn.config_context(enable_metadata_routing=True)
def test_groups_and_weights_are_routed(folder):
    ridge = Ridge().set_fit_request(sample_weight=True).set_score_request(sample_weight=False)
    found = tactbench.evaluate(
        GridSearchCV(ridge, {"alpha": [0.1, 100.0]}, cv=GroupKFold(3)), "force", folder,
        split=GroupKFold(3), groups="session", params={"sample_weight": np.ones(360)},
    )  # fmt: skip
    assert found.score < found.trivial["mean"]


def test_weights_are_those_of_the_rows_of_the_fold(folder):
    data = tactbench.load_task("force", folder)
    weights = 1.0 + np.arange(len(data.y)) % 7
    found = tactbench.evaluate(Ridge(), "force", folder, params={"sample_weight": weights})
    theirs = cross_validate(
        scaled(Ridge()), data.X, data.y, cv=data.folds, params={"ridge__sample_weight": weights},
        scoring="neg_root_mean_squared_error",
    )["test_score"]  # fmt: skip
    np.testing.assert_allclose(list(found.fold_scores.values()), -theirs, rtol=1e-9)  # rounding of two scales


# Windows


class LastOfWindow:
    """Least squares on the last rows of windows, in plain numpy."""

    def fit(self, X, y):
        assert X.ndim == 3
        self.seen, self.coef = X.shape, np.linalg.lstsq(self._columns(X), y, rcond=None)[0]
        return self

    def predict(self, X):
        return self._columns(X) @ self.coef

    def _columns(self, X):
        return np.column_stack([X[:, -1], np.ones(len(X))])


def test_windows_lie_in_one_recording_and_are_labelled_at_their_end(folder):
    rows = tactbench.load_task("force", folder)
    data = tactbench.load_task("force", folder, window=8, step=3)
    ends = np.concatenate([np.arange(start + 7, start + 60, 3) for start in range(0, 360, 60)])
    np.testing.assert_array_equal(data.X, rows.X[ends[:, None] + np.arange(-7, 1)])
    np.testing.assert_array_equal(data.y, rows.y[ends])
    np.testing.assert_array_equal(data.groups, rows.groups[ends])
    assert [len(test) for _, test in data.folds] == [18] * 6
    slow = tactbench.load_task("force", folder, "deployable@every=2", window=4)
    np.testing.assert_array_equal(slow.X[0], rows.X[:8:2])


def test_an_object_that_takes_windows_is_scored_with_their_delay(folder):
    one = tactbench.evaluate(Ridge(alpha=1e-9), "force", folder)
    found = tactbench.evaluate(LastOfWindow(), "force", folder, window=1)
    assert found.score == pytest.approx(one.score, rel=1e-6)  # the penalty
    longer = tactbench.evaluate(LastOfWindow(), "force", folder, window=11, step=5)
    parts = longer.row["delay_parts_ms"]
    # The mean over 11 samples 10 ms apart would be late by five of them: docs/glossary.md.
    assert parts["window"] == pytest.approx(50.0, rel=1e-6)  # of the clock
    assert longer.row["answer_delay_ms"] == pytest.approx(sum(parts.values()))
    assert longer.interval is not None
    assert (longer.predictions["row"][:3] == [10, 15, 20]).all()
    assert longer.row["stamps"] == []


@pytest.mark.parametrize("split", ["press", "in-session", KFold(4)])
def test_no_row_stands_in_windows_of_both_sides(folder, split):
    rows, data = tactbench.load_task("force", folder), tactbench.load_task("force", folder, split=split, window=5)
    known = {row.tobytes(): place for place, row in enumerate(rows.X)}
    places = np.array([[known[row.tobytes()] for row in window] for window in data.X])
    for train, test in data.folds:
        assert len(train)
        assert not np.intersect1d(places[train], places[test]).size


def test_windows_that_cannot_be_are_refused(folder):
    with pytest.raises(DataError, match="window=61"):
        tactbench.load_task("force", folder, window=61)
    with pytest.raises(NotApplicable, match="first-frame"):
        tactbench.load_task("force", folder, "first-frame", window=2)
    with pytest.raises(DataError, match="5 x 3"):
        tactbench.evaluate(Ridge(), "force", folder, window=5)


def test_a_scaled_window_is_that_of_the_training_windows(folder):
    found = []

    class Keeps(LastOfWindow):
        def fit(self, X, y):
            found.append(X)
            return super().fit(X, y)

    tactbench.evaluate(Keeps(), "force", folder, window=4)
    np.testing.assert_allclose([one.mean(axis=(0, 1)) for one in found], 0.0, atol=1e-9)  # of values about 1000
    np.testing.assert_allclose([one.std(axis=(0, 1)) for one in found], 1.0, rtol=1e-9)


def test_an_object_that_predicts_only_once_it_is_fitted_is_an_estimator(folder):
    stacked = StackingRegressor([("ridge", Ridge())])
    assert not hasattr(stacked, "predict")
    found = tactbench.evaluate(stacked, "force", folder)
    assert found.score < found.trivial["mean"]
