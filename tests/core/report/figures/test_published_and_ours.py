"""The picture of published scores and ours carries the numbers of the rows, with and without intervals."""

import numpy as np
import pytest

from tactbench.core.report.figures import published_and_ours
from tactbench.core.report.figures.style import BLACK, sensor_colours, styled
from tactbench.core.report.published import reproduce
from tactbench.core.report.results import Results

from .made import REGISTRY, opened


def over_eight(row):
    """Return a row as of eight replicates."""
    scores = [row["score"] * factor for factor in (0.95, 0.97, 0.98, 1.0, 1.0, 1.02, 1.04, 1.06)]
    found = {"n_replicates": 8, "replicate_unit": "replicate", "replicate_scores": scores}
    return {**row, **found, "ci_low": scores[0], "ci_high": scores[7]}


def figure_of(rows):
    lines = [line for line in reproduce(REGISTRY, rows) if line.row is not None]
    with styled():
        return published_and_ours._figure([lines], 1, sensor_colours(rows)), lines


def points(axes, marker):
    return [line for line in axes.get_lines() if line.get_marker() == marker]


def test_each_number_stands_at_its_place_in_its_sensor_s_colour(finished):
    rows = [over_eight(row) for row in opened(finished).rows if row["status"] == "done"]
    figure, lines = figure_of(rows)
    (axes,) = figure.axes
    colours = sensor_colours(rows)
    assert len(lines) == 2
    for place, (line, ours, theirs, each) in enumerate(
        zip(lines, points(axes, "o"), points(axes, "D"), points(axes, "|")[::3], strict=False)
    ):
        assert (ours.get_xdata()[0], ours.get_ydata()[0]) == (line.row["score"], place)
        assert (theirs.get_xdata()[0], theirs.get_color()) == (line.published, BLACK)
        assert ours.get_color() == colours[line.row["sensor"]]
        np.testing.assert_array_equal(each.get_xdata(), line.row["replicate_scores"])
    spans = [bar.get_segments()[0][:, 0] for bar in axes.collections]
    np.testing.assert_allclose(
        spans, [(line.row["ci_low"], line.row["ci_high"]) for line in lines], rtol=1e-12
    )  # the bar is drawn from two differences


@pytest.mark.parametrize("eight", [True, False])
def test_the_caption_says_over_what_the_interval_is_and_which_colour_is_whose(finished, tmp_path, eight):
    material = opened(finished)
    few = {"n_replicates": 1, "replicate_scores": [1.0], "ci_low": None, "ci_high": None}
    rows = tuple(over_eight(row) if eight else {**row, **few} for row in material.rows if row["status"] == "done")
    wide, column = published_and_ours.draw_published(Results(material.store, REGISTRY, rows), tmp_path)
    assert wide.caption == column.caption
    assert "alpha blue, beta orange-red" in wide.caption
    assert ("the median over 8 replicates, with their 95 % intervals" in wide.caption) == eight
    assert ("too few for an interval" in wide.caption) != eight
    assert wide.png.read_bytes().startswith(b"\x89PNG")


def test_nothing_is_drawn_where_no_row_stands_beside_a_published_number(finished, tmp_path):
    material = opened(finished)
    rows = tuple(row for row in material.rows if row["task"] == "curvature")
    assert published_and_ours.draw_published(Results(material.store, REGISTRY, rows), tmp_path) == []
