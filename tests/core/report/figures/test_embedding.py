"""The embedding: which rows, of which recordings."""

from dataclasses import replace

import numpy as np
import pytest

from tactbench.core.errors import DataError, NotApplicable
from tactbench.core.report.figures import embedding_map
from tactbench.core.report.figures.embedding_map import embed

from .made import group_of, opened, record, results


@pytest.fixture(autouse=True)
def few_steps(monkeypatch):
    """As few as t-SNE can take: nobody looks at where its points end up."""
    monkeypatch.setattr(embedding_map, "ITERATIONS", 250)
    monkeypatch.setattr(embedding_map, "AT_MOST", 100)


def test_it_is_of_every_nth_row_and_not_of_other_recordings_or_folds(tmp_path):
    folder = results(tmp_path, sensors=("alpha",), tasks=("curvature",))
    panel = group_of(folder, "curvature").panels[0]
    test = panel.answers["test"]
    rows, xy = embed(opened(folder), panel.row, test)
    np.testing.assert_array_equal(rows, np.arange(0, len(test), 3))
    assert xy.shape == (len(rows), 2)
    with pytest.raises(NotApplicable, match="a test set a fold"):
        embed(opened(folder), panel.row, replace(test, fold=np.arange(len(test))))
    for path in (tmp_path / "recordings" / "alpha").glob("*.h5"):
        path.unlink()
    record(tmp_path / "recordings", "alpha", 2.0, 0, 40)
    with pytest.raises(DataError, match="other test rows than were answered"):
        embed(opened(folder), panel.row, test)
