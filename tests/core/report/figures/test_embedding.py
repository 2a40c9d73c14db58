"""The embedding: which rows, which features, once."""

import math
import shutil
from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.core.errors import DataError, NotApplicable
from tactbench.core.evaluation.dataset import load_dataset
from tactbench.core.evaluation.protocols import KARL2016
from tactbench.core.evaluation.sets import keep, part, scale_of
from tactbench.core.evaluation.splits import make_splits
from tactbench.core.plugins.registry import load_object
from tactbench.core.report import embedding
from tactbench.core.report.embedding import AT_MOST, embed, every_nth

from .made import REGISTRY, group_of, opened, record, results


@given(st.integers(1, 200_000))
def test_every_nth_row_and_no_more_than_allowed(n):
    rows = every_nth(n)
    step = rows[1] - rows[0] if len(rows) > 1 else 1
    assert rows[0] == 0
    assert (np.diff(rows) == step).all()
    assert n - step <= rows[-1] < n
    assert len(rows) <= AT_MOST
    assert step == 1 or math.ceil(n / (step - 1)) > AT_MOST  # the next smaller step leaves too many


@pytest.fixture(scope="module", autouse=True)
def few_steps():
    """As few as t-SNE can take: nobody looks at where its points end up."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(embedding, "ITERATIONS", 250)
        yield


def the_first(folder):
    panel = group_of(folder, "curvature").panels[0]
    return opened(folder), panel.row, panel.answers["test"]


@pytest.fixture(scope="module")
def first(few_steps, finished, tmp_path_factory):
    """A result folder with one embedding, and that."""
    folder = shutil.copytree(
        finished, tmp_path_factory.mktemp("embedded") / "results", ignore=shutil.ignore_patterns("report")
    )
    return folder, embed(*the_first(folder))


@pytest.fixture
def embedded(first, tmp_path):
    """A folder of one's own, and the embedding that is stored in it."""
    folder, found = first
    return shutil.copytree(folder, tmp_path / "results"), found


def test_it_is_computed_once_and_needs_the_recordings_never_again(embedded):
    folder, first = embedded
    material, row, test = the_first(folder)
    (kept,) = (folder / "report" / "embeddings").iterdir()
    inode = kept.stat().st_ino
    gone = {**row, "recordings": ["recordings/none.h5"]}
    again = embed(material, gone, test)
    np.testing.assert_array_equal(first.xy, again.xy)
    assert kept.stat().st_ino == inode
    assert (first.every, first.perplexity, first.divergence) == (again.every, again.perplexity, again.divergence)
    assert first.xy.shape == (len(first.rows), 2)


def test_it_is_reproducible_and_a_damaged_file_is_made_anew(embedded):
    folder, first = embedded
    (kept,) = (folder / "report" / "embeddings").iterdir()
    whole = kept.read_bytes()
    kept.write_bytes(whole[: len(whole) // 2])
    np.testing.assert_array_equal(embed(*the_first(folder)).xy, first.xy)
    assert kept.read_bytes() == whole


def test_another_cell_is_another_embedding(embedded):
    folder, _ = embedded
    material, row, test = the_first(folder)
    embed(material, {**row, "key": "another"}, test)
    assert len(list((folder / "report" / "embeddings").iterdir())) == 2


def test_the_features_are_those_the_estimator_answered_from(finished):
    """A forest grown again on the training set gives, on these features, the very answers of the cell."""
    material, row, test = the_first(finished)
    X = embedding._features(material, row, test)
    task = REGISTRY.tasks["curvature"].spec
    data = load_dataset(task, material.recordings(row))
    (roles,) = make_splits(data, "roles", row["seed"])
    train = keep(data, KARL2016, roles.train, "set", Counter())
    learnt = part(train, scale_of(KARL2016, train, train), 0)
    forest = REGISTRY.estimators["forest"]
    settings = {**forest.params, **row["params"]}
    model = load_object(forest.where)(kind="classification", seed=row["seed"], threads=1, **settings)
    np.testing.assert_array_equal(model.fit(learnt.X, learnt.y).predict(X), test.y_pred)
    np.testing.assert_allclose(X.mean(axis=0), 0.0, atol=1e-9)  # the paper's protocol scales the set by itself
    np.testing.assert_allclose(X.std(axis=0), 1.0, atol=1e-9)


def test_other_recordings_than_were_answered_are_refused(tmp_path):
    folder = results(tmp_path, sensors=("alpha",), tasks=("curvature",))
    material, row, test = the_first(folder)
    shutil.rmtree(tmp_path / "recordings" / "alpha")
    record(tmp_path / "recordings", "alpha", 2.0, 0, 50)
    with pytest.raises(DataError, match="other test rows than were answered"):
        embed(material, row, test)


def test_folds_and_tiny_sets_have_no_embedding(finished):
    from dataclasses import replace

    material, row, test = the_first(finished)
    with pytest.raises(NotApplicable, match="a test set a fold"):
        embed(material, row, replace(test, fold=np.arange(len(test))))
    with pytest.raises(NotApplicable, match="no neighbourhoods"):
        embed(material, row, type(test)(*(getattr(test, name)[:3] for name in test.__dataclass_fields__)))
