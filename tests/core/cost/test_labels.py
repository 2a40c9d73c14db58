"""Labels that can be read: none on another one, all inside."""

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

from tactbench.core.cost.labels import Box, label


def drawn(points, texts):
    figure = Figure(figsize=(6, 5), dpi=100)
    FigureCanvasAgg(figure)
    axis = figure.subplots()
    axis.plot(*np.array(points).T, "o", ms=6)
    axis.margins(0.15)
    figure.draw_without_rendering()
    label(axis, points, texts)
    figure.draw_without_rendering()
    renderer = figure.canvas.get_renderer()
    frame = Box(*axis.get_window_extent(renderer).extents)
    return frame, [Box(*Text.get_window_extent(text, renderer).extents) for text in axis.texts]


def overlaps(boxes):
    return [(a, b) for a in range(len(boxes)) for b in range(a) if boxes[a].shared(boxes[b]) > 0]


@pytest.mark.parametrize("spread", [1.0, 0.1, 0.02])
def test_eighteen_labels_of_a_cluster_do_not_cover_each_other(spread):
    rng = np.random.default_rng(5)
    cluster = rng.normal(0.0, spread, (16, 2))
    points = [(-3.0, -3.0), (3.0, 3.0), *map(tuple, cluster)]
    frame, boxes = drawn(points, [f"forest-fast-{place}" for place in range(18)])
    assert overlaps(boxes) == []
    # A pixel: text is placed in points and drawn in whole pixels.
    assert all(box.outside(frame) <= box.right - box.left for box in boxes)


def test_a_point_alone_has_its_label_beside_it():
    _, (box,) = drawn([(0.0, 0.0)], ["ols"])
    assert box.right - box.left > 5


def test_shared_and_outside_areas_are_counted():
    a, b = Box(0, 0, 4, 2), Box(3, 1, 9, 9)
    assert a.shared(b) == 1
    assert a.outside(b) == 7
    assert a.shared(Box(5, 5, 6, 6)) == 0
