"""Linear models: closed forms, and what nearly collinear taxels cost."""

import numpy as np
import pytest

from tactbench.plugin import load_object, load_registry

ESTIMATORS = load_registry().estimators


def build(name, **params):
    descriptor = ESTIMATORS[name]
    kind = descriptor.kinds[0]
    return load_object(descriptor.where)(kind=kind, seed=0, threads=1, **{**descriptor.params, **params})


def z(X):
    return (X - X.mean(axis=0)) / X.std(axis=0)


def taxels(n=4400, p=19, seed=0):
    """A ramp on taxels that all follow it: what a sensor on a flat surface gives."""
    rng = np.random.default_rng(seed)
    force = np.linspace(0.0, 5.0, n)
    X = 3000.0 + force[:, None] * rng.uniform(50.0, 200.0, p) + rng.normal(0.0, 0.35, (n, p))
    return z(X), force + rng.normal(0.0, 0.6875, n)


@pytest.mark.parametrize("penalty", [0.01, 0.2])
def test_lasso_on_nearly_collinear_taxels_is_at_its_optimum(penalty):
    """The duality gap, computed here from its definition, bounds the distance from the optimum."""
    X, y = taxels()
    model = build("lasso", lambda_=penalty)
    model.fit(X, y)
    n, centred = len(y), y - y.mean()
    rest = centred - X @ model.coef_
    primal = 0.5 * rest @ rest / n + penalty * np.abs(model.coef_).sum()
    dual = rest / n * min(1.0, penalty / np.abs(X.T @ rest / n).max())
    gap = primal - (centred @ dual - 0.5 * n * dual @ dual)
    assert 0.0 <= gap <= 1e-5 * (centred @ centred) / n


def test_ridge_is_the_closed_form():
    rng = np.random.default_rng(1)
    X, y = z(rng.normal(size=(50, 4))), rng.normal(size=50)
    model = build("ridge", alpha=3.0)
    model.fit(X, y)
    expected = np.linalg.solve(X.T @ X + 3.0 * np.eye(4), X.T @ (y - y.mean()))
    np.testing.assert_allclose(model.coef_, expected, rtol=1e-9)


def test_trivial_answers_are_trivial():
    nothing = np.zeros((4, 1))
    mean = build("mean")
    mean.fit(nothing, np.array([0.0, 1.0, 2.0, 5.0]))
    assert set(mean.predict(nothing)) == {2.0}
    majority = build("majority")
    majority.fit(nothing, np.array([2, 1, 2, 0]))
    assert set(majority.predict(nothing)) == {2}


def test_a_discriminant_of_classes_with_one_mean_says_nothing_aloud():
    from tactbench.estimators.models import discriminant

    X = np.tile(np.eye(3), (4, 1))
    y = np.repeat([0, 1], 6)
    assert set(discriminant(kind="classification", seed=0, threads=1).fit(X, y).predict(X)) <= {0, 1}
