"""Labels beside the points of a figure, where none covers another one's."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

DISTANCES_PT = (9.0, 14.0, 20.0, 28.0, 38.0, 50.0, 64.0)
DIRECTIONS = 16
CLEAR_PT = 1.5
"""Room that is left around a label."""


class Box(NamedTuple):
    """A rectangle in pixels."""

    left: float
    bottom: float
    right: float
    top: float

    def shared(self, other: Box) -> float:
        """Return the area that both cover."""
        wide = min(self.right, other.right) - max(self.left, other.left)
        high = min(self.top, other.top) - max(self.bottom, other.bottom)
        return max(0.0, wide) * max(0.0, high)

    def outside(self, frame: Box) -> float:
        """Return the area of this one that lies outside `frame`."""
        return (self.right - self.left) * (self.top - self.bottom) - self.shared(frame)


def label(axis: Any, points: Sequence[tuple[float, float]], texts: Sequence[str], avoid: Sequence[Box] = ()) -> None:
    """Write `texts` beside `points` (data coordinates), greedily: the nearest place that covers least.

    The figure's layout must be final: places are counted in pixels. Labels further away than a marker get a thin
    line to their point.

    Parameters
    ----------
    avoid
        What should not be covered besides labels and points, in pixels.
    """
    figure = axis.figure
    renderer = figure.canvas.get_renderer()
    pixel = figure.dpi / 72
    frame = Box(*axis.get_window_extent(renderer).extents)
    middles = [tuple(axis.transData.transform(point)) for point in points]
    marks = [Box(x - 4 * pixel, y - 4 * pixel, x + 4 * pixel, y + 4 * pixel) for x, y in middles]
    taken: list[Box] = []
    for (x, y), text, point in zip(middles, texts, points, strict=True):
        written = axis.annotate(text, point, xytext=(0, 0), textcoords="offset points", fontsize=8, va="center",
                                ha="center")  # fmt: skip
        size = written.get_window_extent(renderer)
        wide, high = size.width / 2 + CLEAR_PT * pixel, size.height / 2 + CLEAR_PT * pixel
        best: tuple[float, float, float, Box] | None = None
        for distance in DISTANCES_PT:
            for step in range(DIRECTIONS):
                angle = 2 * math.pi * step / DIRECTIONS
                # The label's edge, not its middle, is so far away.
                dx = math.cos(angle) * (distance * pixel + wide)
                dy = math.sin(angle) * (distance * pixel + high)
                box = Box(x + dx - wide, y + dy - high, x + dx + wide, y + dy + high)
                worse = (
                    20 * sum(box.shared(other) for other in taken)
                    + 20 * box.outside(frame)
                    + 5 * sum(box.shared(other) for other in marks)
                    + sum(box.shared(other) for other in avoid)
                    + 2 * distance * pixel
                )
                if best is None or worse < best[0]:
                    best = (worse, dx, dy, box)
        assert best is not None
        _, dx, dy, box = best
        taken.append(box)
        written.remove()
        axis.annotate(
            text, point, xytext=(dx / pixel, dy / pixel), textcoords="offset points", fontsize=8, va="center",
            ha="center", bbox={"boxstyle": "square,pad=0.1", "fc": "white", "ec": "none", "alpha": 0.75},
            arrowprops={"arrowstyle": "-", "lw": 0.5, "color": "#888888", "shrinkA": 1, "shrinkB": 3},
        )  # fmt: skip
