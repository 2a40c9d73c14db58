"""Which points nobody beats in both time and error."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

P = TypeVar("P")


def front(points: Sequence[P], *, seconds: Callable[[P], float], error: Callable[[P], float]) -> list[P]:
    """Return the points that no other one beats, the quickest first: quicker ones are all further off.

    Parameters
    ----------
    points
        Any things that take time and are off by something.
    seconds
        What one takes; any unit, smaller is better.
    error
        How far off one is; smaller is better. A score to be maximised is given with its sign changed.
    """
    kept: list[P] = []
    for point in sorted(points, key=lambda point: (seconds(point), error(point))):
        if not kept or error(point) < error(kept[-1]):
            kept.append(point)
    return kept
