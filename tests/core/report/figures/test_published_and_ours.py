"""The picture of published scores and ours carries the numbers of the rows."""

import numpy as np

from tactbench.core.report.figures.published_and_ours import draw_published
from tactbench.core.report.published import reproduce
from tactbench.core.report.results import Results

from .conftest import opened


def test_each_number_stands_at_its_place(finished):
    material = opened(finished)
    rows = [
        {**row, "ci_low": 0.95 * row["score"], "ci_high": 1.06 * row["score"]}
        for row in material.rows
        if row["status"] == "done"
    ]
    (axes,) = draw_published(Results(material.store, material.registry, tuple(rows))).figure.axes
    lines = [line for line in reproduce(material.registry, rows) if line.row]
    for marker, values in (
        ("o", [line.row["score"] for line in lines]),
        ("D", [line.published.score for line in lines]),
    ):
        marks = [mark for mark in axes.get_lines() if mark.get_marker() == marker]
        assert [(mark.get_xdata()[0], mark.get_ydata()[0]) for mark in marks] == list(
            zip(values, range(9), strict=False)
        )
    spans = [bar.get_segments()[0][:, 0] for bar in axes.collections]
    # The bar is drawn from two differences.
    np.testing.assert_allclose(spans, [(line.row["ci_low"], line.row["ci_high"]) for line in lines], rtol=1e-12)
