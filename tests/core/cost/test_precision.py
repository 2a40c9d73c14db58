"""Fronts, verdicts and figures of points."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st

from tactbench.core.cost.precision import precise, quickest_enough
from tactbench.plugin.simulation import CostPoint


def _point(seconds, error, *, default=False, floor=0.3, label="way", observable="taxel"):
    return CostPoint(
        subject="pad", observable=observable, label=label, seconds=seconds, error=error, worst=2 * error, unit="count",
        floor=floor, default=default, settings={"family": "newton"},
    )  # fmt: skip


_POSITIVE = st.floats(1e-6, 1e3)


@given(st.lists(st.tuples(_POSITIVE, _POSITIVE), min_size=1, max_size=20))
def test_the_front_is_beaten_by_nobody_and_beats_everybody_else(pairs):
    points = [_point(*pair) for pair in pairs]
    best = precise(points)
    for point in points:
        beaten = any(o.seconds <= point.seconds and o.error <= point.error for o in best)
        assert beaten
    for one in best:
        assert not any(o.seconds < one.seconds and o.error <= one.error for o in points)
    assert [p.error for p in best] == sorted((p.error for p in best), reverse=True)


def test_the_quickest_point_that_will_do():
    quick, default, slow = _point(0.1, 0.5), _point(0.2, 0.05, default=True), _point(1.0, 0.01)
    assert quickest_enough([quick, default, slow]) is default
    assert quickest_enough([quick, _point(0.2, 0.2)]) is None
    assert quickest_enough([_point(1, 1, floor=math.inf)]) is None, "no noise is stated"
