"""The embedding: which rows, of which recordings."""

from dataclasses import replace

import numpy as np
import pytest

from tactbench.core.errors import DataError, NotApplicable
from tactbench.core.report.figures import embedding_map
from tactbench.core.report.figures.embedding_map import embed

from .conftest import group_of, opened


def test_it_is_of_every_nth_row_and_not_of_other_recordings_or_folds(folder, monkeypatch):
    monkeypatch.setattr(embedding_map, "ITERATIONS", 250)  # as few as t-SNE can take
    monkeypatch.setattr(embedding_map, "AT_MOST", 100)
    panel = group_of(folder, "curvature").panels[0]
    test = panel.answers["test"]
    rows, xy = embed(opened(folder), panel.row, test)
    np.testing.assert_array_equal(rows, np.arange(0, len(test), -(-len(test) // 100)))
    assert xy.shape == (len(rows), 2)
    with pytest.raises(NotApplicable, match="a test set a fold"):
        embed(opened(folder), panel.row, replace(test, fold=np.arange(len(test))))
    with pytest.raises(DataError, match="other test rows than were answered"):
        embed(opened(folder), panel.row, replace(test, row=test.row[::-1]))
