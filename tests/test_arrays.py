"""Arrays as recordings: scored without any file of one's own, checked as imports are."""

import numpy as np
import pytest
from sklearn.linear_model import LogisticRegression, Ridge
from sklearn.model_selection import cross_validate
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

import tactbench
from tactbench.core.errors import MappingError, UsageError
from tests.here import make_here


def board(seed=0, sessions=6, n=80):
    """Readings of three taxels, a force, times and sessions."""
    rng = np.random.default_rng(seed)
    force = rng.uniform(0, 5, sessions * n)
    X = force[:, None] * [1.0, 2.0, 3.0] + rng.normal(0, 0.2, (len(force), 3))
    return X, force, np.tile(np.arange(n) * 0.01, sessions), np.repeat(np.arange(sessions), n)


@pytest.mark.parametrize("task", ["force", "grip"])
def test_arrays_are_scored_as_cross_validate_scores_them(task):
    X, force, time_s, groups = board()
    recordings = tactbench.from_arrays(X, force, time_s=time_s, groups=groups, task=task, unit="N", sensor="my-board")
    data = tactbench.load_task(task, recordings)
    np.testing.assert_allclose(data.X, X, rtol=0)
    np.testing.assert_allclose(data.y, force, rtol=0)
    model = make_pipeline(StandardScaler(), Ridge())
    theirs = cross_validate(model, X, force, cv=data.folds, scoring="neg_root_mean_squared_error")["test_score"]
    found = tactbench.evaluate(model, task, recordings)
    np.testing.assert_allclose(list(found.fold_scores.values()), -theirs, rtol=1e-9)  # scaled twice
    assert found.interval[0] < found.score < found.trivial["mean"]
    assert found.row["unit"] == "N"
    assert found.row["answer_delay_ms"] > 0


def test_simulated_arrays_are_marked_as_such_and_not_as_the_twin():
    X, force, _, groups = board()
    shown = repr(tactbench.evaluate(Ridge(), "force", tactbench.from_arrays(X, force, groups=groups, task="force")))
    assert "SIMULATED" in shown
    assert "twin" not in shown
    measured = tactbench.from_arrays(X, force, groups=groups, task="force", simulated=False)
    assert "SIMULATED" not in repr(tactbench.evaluate(Ridge(), "force", measured))


def test_times_are_none_where_none_are_given():
    X, force, _, groups = board()
    found = tactbench.evaluate(Ridge(), "force", tactbench.from_arrays(X, force, groups=groups, task="force"))
    assert found.row["answer_delay_ms"] is None
    assert found.trivial["time-index"] is None


@pytest.mark.parametrize(
    ("labels", "classes"),
    [(["soft", "hard"], ["hard", "soft"]), ([2, 10], ["02", "10"]), ([False, True], ["False", "True"])],
)
def test_what_is_no_number_on_a_scale_is_a_class(labels, classes):
    X, force, _, groups = board()
    recordings = tactbench.from_arrays(X, np.array(labels)[(force > 2.5).astype(int)], groups=groups, task="kind")
    found = tactbench.evaluate(LogisticRegression(), "kind", recordings)
    assert found.row["classes"] == classes
    assert found.score > 0.9


def test_a_vector_is_answered_by_component():
    X, force, _, groups = board()
    recordings = tactbench.from_arrays(X, np.column_stack([force, -force]), groups=groups, task="place", unit="mm")
    found = tactbench.evaluate(Ridge(), "place", recordings)
    assert found.row["metric"] == "mean_euclidean_error"
    assert {"y_pred_y0", "y_pred_y1"} <= set(found.predictions)


def test_a_frame_is_taken_by_the_names_of_its_columns():
    pd = pytest.importorskip("pandas")
    X, force, time_s, groups = board()
    frame = pd.DataFrame(X, columns=["left", "mid", "right"]).assign(F=force, t=time_s, run=groups)
    recordings = tactbench.from_arrays(frame, "F", time_s="t", groups="run", task="force")
    data = tactbench.load_task("force", recordings)
    assert data.feature_names == ("left", "mid", "right")
    named = pd.DataFrame(X, columns=[0, "pad 2 (kPa)", "_c"])
    numbered = tactbench.from_arrays(named, force, groups=groups, task="force")
    assert tactbench.load_task("force", numbered).feature_names == ("x0", "pad_2_kPa_", "x_c")
    np.testing.assert_array_equal(data.X, X)
    with pytest.raises(UsageError, match="groups='ran'"):
        tactbench.from_arrays(frame, "F", groups="ran")


def test_what_an_import_finds_is_found():
    X, force, time_s, groups = board()
    given_away = tactbench.from_arrays(np.column_stack([X, force]), force, groups=groups, task="force")
    assert any("x3" in one for one in tactbench.evaluate(Ridge(), "force", given_away).row["stamps"])
    holed = X.copy()
    holed[3, 1] = np.nan
    data = tactbench.load_task("force", tactbench.from_arrays(holed, force, groups=groups, task="force"))
    assert len(data.y) == len(force) - 1
    holed[:80, 1] = np.nan
    with pytest.raises(MappingError):
        tactbench.from_arrays(holed, force, groups=groups)
    backwards = time_s.copy()
    backwards[5] = 0.0
    with pytest.raises(ValueError, match="back"):
        tactbench.evaluate(
            Ridge(), "force", tactbench.from_arrays(X, force, time_s=backwards, groups=groups, task="force")
        )


def test_a_run_takes_them(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    make_here(monkeypatch)
    X, force, time_s, groups = board()
    recordings = tactbench.from_arrays(X, force, time_s=time_s, groups=groups, task="force")
    found = tactbench.run(task="force", recordings=recordings, estimator=["ols", Ridge()])
    assert {row["estimator"] for row in found} == {"ols", "Ridge", "mean", "time-index"}
