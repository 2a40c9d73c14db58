"""The embedding: which rows, which features."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from tactbench.core.errors import DataError, NotApplicable
from tactbench.core.evaluation.dataset import load_dataset
from tactbench.core.evaluation.protocols import KARL2016
from tactbench.core.evaluation.sets import keep, part, scale_of
from tactbench.core.evaluation.splits import make_splits
from tactbench.core.plugins.registry import load_object
from tactbench.core.report.figures import embedding_map
from tactbench.core.report.figures.embedding_map import embed

from .made import REGISTRY, group_of, opened, record, results


@pytest.fixture(autouse=True)
def few_steps(monkeypatch):
    """As few as t-SNE can take: nobody looks at where its points end up."""
    monkeypatch.setattr(embedding_map, "ITERATIONS", 250)


def the_first(folder):
    panel = group_of(folder, "curvature").panels[0]
    return opened(folder), panel.row, panel.answers["test"]


def test_the_features_are_those_the_estimator_answered_from(finished):
    """A forest grown again on the training set gives, on these features, the very answers of the cell."""
    material, row, test = the_first(finished)
    X = embedding_map._features(material, row, test)
    task = REGISTRY.tasks["curvature"].spec
    data = load_dataset(task, material.recordings(row))
    (roles,) = make_splits(data, "roles", row["seed"])
    train = keep(data, KARL2016, roles.train, "set", Counter())
    learnt = part(train, scale_of(KARL2016, train, train), 0)
    forest = REGISTRY.estimators["forest"]
    settings = {**forest.params, **row["params"]}
    model = load_object(forest.where)(kind="classification", seed=row["seed"], threads=1, **settings)
    np.testing.assert_array_equal(model.fit(learnt.X, learnt.y).predict(X), test.y_pred)


def test_it_is_of_every_nth_row_and_not_of_other_recordings_or_folds(finished, tmp_path, monkeypatch):
    monkeypatch.setattr(embedding_map, "AT_MOST", 100)
    material, row, test = the_first(finished)
    rows, xy = embed(material, row, test)
    np.testing.assert_array_equal(rows, np.arange(0, len(test), 3))
    assert xy.shape == (len(rows), 2)
    with pytest.raises(NotApplicable, match="a test set a fold"):
        embed(material, row, replace(test, fold=np.arange(len(test))))
    material, row, test = the_first(results(tmp_path, sensors=("alpha",), tasks=("curvature",)))
    for path in (tmp_path / "recordings" / "alpha").glob("*.h5"):
        path.unlink()
    record(tmp_path / "recordings", "alpha", 2.0, 0, 40)
    with pytest.raises(DataError, match="other test rows than were answered"):
        embed(material, row, test)
