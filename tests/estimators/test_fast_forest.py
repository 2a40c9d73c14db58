"""The extra: skipped with its reason where it is missing, never plain scikit-learn under its name where it is not."""

import sys
import warnings
from collections import Counter

import numpy as np
import pytest

from tactbench.core.evaluation.fitting import fit
from tactbench.core.provenance.source import versions
from tactbench.plugin import NotApplicable, load_object, load_registry

REGISTRY = load_registry()
FAST = REGISTRY.estimators["forest-fast"]


def build(kind="classification", **params):
    return load_object(FAST.where)(kind=kind, seed=1, threads=1, **{**FAST.params, **params})


def cloud(n=400, seed=0):
    rng = np.random.default_rng(seed)
    X = rng.normal(size=(n, 3))
    return X, (X[:, 0] * X[:, 1] > 0).astype(np.int64)


@pytest.fixture
def extra():
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="distutils Version classes", category=DeprecationWarning)
        pytest.importorskip("sklearnex", reason="the extra [fast] is not installed")


def test_without_the_extra_the_reason_names_the_command(monkeypatch):
    """A cell that is not applicable is skipped with the reason, and is no failure."""
    monkeypatch.setitem(sys.modules, "sklearnex", None)
    monkeypatch.delitem(sys.modules, "sklearnex.ensemble", raising=False)
    with pytest.raises(NotApplicable, match=r"tactbench\[fast\]"):
        build()


def test_a_cell_of_it_is_keyed_by_the_version_of_the_extra():
    assert set(versions(FAST.distributions)) - set(versions()) == {"scikit-learn-intelex", "daal"}


@pytest.mark.parametrize("kind", ["classification", "regression"])
def test_one_row_and_many_give_the_same_answers_and_nothing_is_warned_of(extra, kind):
    X, y = cloud()
    counts = Counter()
    model = build(kind, n_estimators=20)
    fit(model, X, y if kind == "classification" else X[:, 0] ** 2, "forest-fast", counts)
    assert counts == {}
    single = np.array([model.predict(row[None])[0] for row in X[:50]])
    # Sums over trees may be taken in another order for one row: the last bits of a mean.
    np.testing.assert_allclose(single, model.predict(X)[:50], rtol=1e-12)


def test_what_falls_back_to_plain_scikit_learn_is_refused(extra):
    X, y = cloud(12)
    with pytest.raises(NotApplicable, match="6025"):
        build(n_estimators=6025, max_depth=1).fit(X, y)
