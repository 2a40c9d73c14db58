"""Fronts, verdicts and figures of points."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.core.cost.precision import cheapest_below, diagrams, precise, verdict
from tactbench.core.cost.precision_figure import draw
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


def test_a_default_is_defended_or_its_miss_is_said():
    quick, default, slow = _point(0.1, 0.5), _point(0.2, 0.05, default=True), _point(1.0, 0.01)
    assert "the cheapest point below a third of the noise" in verdict([quick, default, slow])
    assert cheapest_below([quick, default, slow]) == default
    cheaper = _point(0.1, 0.09, label="cheaper")
    assert "cheaper keeps it too" in verdict([cheaper, default])
    poor = _point(0.2, 0.2, default=True)
    assert "no point keeps" in verdict([quick, poor])
    assert "above" in verdict([poor, _point(0.9, 0.01, label="finer")])
    assert "no noise is stated" in verdict([_point(1, 1, default=True, floor=math.inf)])
    assert "No default" in verdict([quick])


def test_a_figure_has_a_panel_for_every_observable(tmp_path):
    points = [_point(0.1, 0.5), _point(0.2, 0.05, default=True), _point(0.3, 0.0, observable="dc_pressure")]
    paths = [tmp_path / "a.png", tmp_path / "a.pdf"]
    draw(points, "error against time", paths)
    assert all(path.stat().st_size > 5000 for path in paths)
    assert list(diagrams(points)) == [("pad", "taxel"), ("pad", "dc_pressure")]
    assert paths[0].read_bytes()[:4] == b"\x89PNG"
    assert paths[1].read_bytes()[:4] == b"%PDF"


def test_points_without_noise_are_drawn_too(tmp_path):
    draw([_point(0.1, 0.5, floor=math.inf, default=True)], "t", [tmp_path / "a.png"])
    assert (tmp_path / "a.png").exists()


@pytest.mark.parametrize("share", [0.1, 1.0])
def test_the_share_of_the_noise_decides(share):
    found = cheapest_below([_point(0.1, 0.2), _point(0.2, 0.02)], share)
    assert found is not None
    assert found.error < share * 0.3
