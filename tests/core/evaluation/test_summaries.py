"""Summaries keep the laws of what they are named after, and know nothing of what comes after their window."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tactbench.core.errors import NotApplicable
from tactbench.core.evaluation.summaries import summary_of
from tactbench.plugin import StreamReadings, Summary

RATE_HZ = 100.0
BAND = (5.0, 20.0)
MEASURES = ("mean", "deviation", "minimum", "maximum", "range", "change", "mean-step", "band-energy")
LEVELS = ("mean", "minimum", "maximum")
# Readings of up to 1e3, sums of 60 of them: rounding of 1e-16 of each, times what a filter of four poles makes of it.
ROUNDING = 1e-8


def summary(measure, **more):
    return Summary(measure=measure, band_hz=BAND if measure == "band-energy" else None, **more)


def stream(X):
    X = np.asarray(X, dtype=np.float64).reshape(len(X), -1)
    names = tuple(f"t{place}" for place in range(X.shape[1]))
    return StreamReadings("taxels", names, ("taxel",) * len(names), X, np.arange(len(X)) / RATE_HZ, RATE_HZ)


def value(X, measure, **more):
    return summary_of(stream(X), summary(measure, **more), "r")


readings = arrays(np.float64, st.tuples(st.integers(8, 60), st.integers(1, 3)), elements=st.floats(-1e3, 1e3))


@settings(max_examples=100)
@given(measure=st.sampled_from(MEASURES), X=readings, factor=st.floats(-10, 10), offset=st.floats(-1e3, 1e3))
def test_a_gain_scales_as_the_unit_says_and_an_offset_changes_levels_alone(measure, X, factor, offset):
    gain = {"band-energy": factor**2}.get(measure, factor if measure in ("change", *LEVELS) else abs(factor))
    before = {"minimum": "maximum", "maximum": "minimum"}.get(measure, measure) if factor < 0 else measure
    expected = gain * value(X, before) + (offset if measure in LEVELS else 0.0)
    assert value(factor * X + offset, measure) == pytest.approx(expected, abs=ROUNDING * 1e6, rel=ROUNDING)


@settings(max_examples=60)
@given(measure=st.sampled_from(MEASURES), X=readings, later=readings, data=st.data())
def test_what_comes_after_the_window_changes_nothing(measure, X, later, data):
    last = data.draw(st.integers(4, len(X)))
    window = {"start": 0.02, "end": (last - 0.5) / len(X)}
    changed = X.copy()
    changed[last:] = np.resize(later, X[last:].shape)
    assert np.array_equal(value(changed, measure, **window), value(X, measure, **window))


def test_what_the_words_mean():
    X = [1.0, 3.0, 2.0, 6.0]
    assert value(X, "mean") == 3.0
    assert value(X, "deviation") == pytest.approx(np.sqrt(3.5))
    assert (value(X, "minimum"), value(X, "maximum"), value(X, "range")) == (1.0, 6.0, 5.0)
    assert value(X, "change") == 5.0
    assert value(X, "mean-step") == pytest.approx((2 + 1 + 4) / 3)
    assert value([0.1] * 1000, "deviation") == 0.0  # not its rounding
    shares = [((0.0, 0.5), 2.0), ((0.25, 0.5), 3.0), ((0.3, 0.31), 3.0), ((0.5, 0.6), 2.0), ((0.99, 1.0), 6.0)]
    assert [value(X, "mean", start=start, end=end)[0] for (start, end), _ in shares] == [mean for _, mean in shares]


def test_a_band_passes_its_own_and_stops_the_others():
    """A sine of amplitude 2 has a mean square of 2; the filter of four poles passes its centre whole."""
    t = np.arange(0, 20, 1 / RATE_HZ)
    settled = {"start": 0.5, "end": 1.0}
    inside, below, above = (value(2 * np.sin(2 * np.pi * f * t) + 7, "band-energy", **settled) for f in (10.0, 0.5, 45))
    # The response at the geometric centre is 1; ten whole seconds hold whole periods.
    assert inside == pytest.approx(2.0, rel=1e-3)
    assert max(below[0], above[0]) < 0.01 * inside[0]


def test_a_band_that_the_rate_does_not_show_is_no_feature():
    with pytest.raises(NotApplicable, match=r"30 Hz.*15 Hz"):
        summary_of(replace(stream(np.zeros(100)), rate_hz=30.0), summary("band-energy"), "r")
