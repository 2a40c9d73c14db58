"""The picture of published scores and ours carries the numbers of the rows."""

import numpy as np

from tactbench.core.report.figures.published_and_ours import draw_published
from tactbench.core.report.figures.style import BLACK, sensor_colours
from tactbench.core.report.published import reproduce
from tactbench.core.report.results import Results

from .conftest import opened


def points(axes, marker):
    return [line for line in axes.get_lines() if line.get_marker() == marker]


def test_each_number_stands_at_its_place_in_its_sensor_s_colour(finished):
    material = opened(finished)
    rows = []
    for row in (row for row in material.rows if row["status"] == "done"):
        scores = [row["score"] * factor for factor in (0.95, 0.97, 0.98, 1.0, 1.0, 1.02, 1.04, 1.06)]
        rows.append({**row, "replicate_scores": scores, "ci_low": scores[0], "ci_high": scores[7]})
    (axes,) = draw_published(Results(material.store, material.registry, tuple(rows))).figure.axes
    lines = [line for line in reproduce(material.registry, rows) if line.row]
    drawn = zip(lines, points(axes, "o"), points(axes, "D"), points(axes, "|")[::3], strict=True)
    for place, (line, our, their, each) in enumerate(drawn):
        row = line.row
        assert (our.get_xdata()[0], our.get_ydata()[0]) == (row["score"], place)
        assert our.get_color() == sensor_colours(rows)[row["sensor"]]
        assert (their.get_xdata()[0], their.get_color()) == (line.published.score, BLACK)
        np.testing.assert_array_equal(each.get_xdata(), row["replicate_scores"])
    spans = [bar.get_segments()[0][:, 0] for bar in axes.collections]
    # The bar is drawn from two differences.
    np.testing.assert_allclose(spans, [(line.row["ci_low"], line.row["ci_high"]) for line in lines], rtol=1e-12)
