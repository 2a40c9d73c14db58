"""What every rung of the ladder keeps, and what single ones promise."""

import warnings

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from tactbench.core.matrix.plan import plan_cells
from tactbench.core.plugins.registry import Owned
from tactbench.core.spec.matrix import EstimatorChoice, MatrixSpec, TaskChoice
from tactbench.plugin import NotApplicable, TaskDescriptor, load_object, load_registry

REGISTRY = load_registry()
ESTIMATORS = REGISTRY.estimators
PAIRS = [(descriptor.name, kind) for descriptor in ESTIMATORS for kind in descriptor.kinds]
CURVED = ("knn", "svm", "boosting", "mlp", "forest-10")


@pytest.fixture(autouse=True)
def _one_thread():
    """As in a cell: more threads than cores that are free only wait for each other."""
    for name in ("boosting", "mlp"):
        build(name, "regression")  # the limit holds for libraries that are loaded
    with threadpool_limits(limits=1):
        yield


def build(name, kind, *, seed=0, threads=1, **params):
    descriptor = ESTIMATORS[name]
    few = {"n_estimators": 5} if "n_estimators" in descriptor.params else {}
    try:
        return load_object(descriptor.where)(
            kind=kind, seed=seed, threads=threads, **{**descriptor.params, **few, **params}
        )
    except NotApplicable as reason:
        pytest.skip(str(reason))


def rings(kind, n=600, seed=0):
    """Rows of two noisy features whose answer is their distance from the middle: no plane tells it."""
    rng = np.random.default_rng(seed)
    X = rng.normal(size=(n, 2))
    radius = np.hypot(*X.T)
    return X, (radius > np.median(radius)).astype(np.int64) if kind != "regression" else radius


@pytest.mark.parametrize(("name", "kind"), PAIRS)
def test_the_same_seed_answers_the_same_and_parameters_are_those_the_code_accepts(name, kind):
    descriptor = ESTIMATORS[name]
    assert set(descriptor.grid) <= set(descriptor.params), "what is searched can also be given"
    assert 0 in descriptor.window_grid
    X, y = rings(kind, 200)
    answers = []
    for _ in range(2):
        model = build(name, kind, seed=7)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # 200 rows are too few for a network to converge on
            model.fit(X, y)
        answers.append(model.predict(X))
    assert answers[0].shape == (200,)
    np.testing.assert_array_equal(*answers)


@pytest.mark.parametrize("name", CURVED)
@pytest.mark.parametrize("kind", ["regression", "classification"])
def test_what_is_not_linear_learns_a_ring(name, kind):
    X, y = rings(kind, 3000)
    X_new, y_new = rings(kind, 3000, seed=1)
    model = build(name, kind)
    model.fit(X, y)
    # The mean answer is wrong by the variance, a quarter for two equal classes; a third of it is far from luck.
    assert np.mean((model.predict(X_new) - y_new) ** 2) < np.var(y_new) / 3


@pytest.mark.parametrize("name", ["svm", "mlp"])
def test_the_unit_of_the_target_changes_nothing_but_the_unit_of_the_answer(name):
    X, y = rings("regression", 300)
    answers = []
    for factor in (1.0, 2.0**-10):  # a power of two: not a bit is rounded otherwise
        model = build(name, "regression")
        model.fit(X, y * factor)
        answers.append(model.predict(X) / factor)
    np.testing.assert_array_equal(*answers)


def test_support_vectors_are_taught_every_nth_row_and_no_more_than_stated():
    X, y = rings("classification", 601)
    thinned, by_hand = build("svm", "classification", rows=150), build("svm", "classification")
    thinned.fit(X, y)
    by_hand.fit(X[::5], y[::5])  # 601 rows, 150 at most: every fifth, 121 of them
    np.testing.assert_array_equal(thinned.predict(X), by_hand.predict(X))
    assert thinned.model.shape_fit_[0] == 121


def test_all_leaves_the_first_baseline_of_the_task_first():
    """The first one is the `baseline` column, whatever others are installed and however they are called."""
    registry = load_registry()
    spec = registry.tasks["force"].spec.model_copy(update={"name": "backwards", "baselines": ("time-index",)})
    registry.tasks.add(Owned(TaskDescriptor(spec=spec), "made", "made", "1"))
    choice = TaskChoice(name="backwards", estimators=(EstimatorChoice(name="all"),))
    cells = plan_cells(MatrixSpec(repeats=1, tasks=(choice,)), ("biotac",), registry)
    assert [cell.estimator for cell in cells if cell.baseline] == ["time-index", "mean"]
    assert {cell.estimator for cell in cells} == {one.name for one in ESTIMATORS if "regression" in one.kinds}


def test_all_beside_a_name_with_parameters_keeps_both():
    asked = (EstimatorChoice(name="forest", params={"max_depth": 3}), EstimatorChoice(name="all"))
    choice = TaskChoice(name="curvature", estimators=asked)
    names = [cell.name for cell in plan_cells(MatrixSpec(repeats=1, tasks=(choice,)), ("biotac",), REGISTRY)]
    assert sum("/forest/" in name or "/forest,max_depth=3/" in name for name in names) == 2
