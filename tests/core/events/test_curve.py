"""The curve over all thresholds against each threshold on its own, and the operating point."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.core.errors import DataError
from tactbench.core.events.alarms import alarms, score_events, threshold_curve
from tests.core.events.made import policies, scored_recordings


@given(st.lists(scored_recordings(), max_size=3), policies)
def test_the_curve_is_each_threshold_on_its_own(recordings, rules):
    curve = threshold_curve(recordings, rules)
    # Every score that occurs, between them, below and above all; the rows of the curve themselves.
    for threshold in (*np.arange(-1.0, 8.0, 0.25), np.inf, *curve.threshold):
        raised = [alarms(one.t_ns, one.score >= threshold, rules) for one in recordings]
        alone, row = score_events([one.truth for one in recordings], raised, rules), curve.at(threshold)
        assert (row.n_alarms, row.n_false_alarms, row.base_ns) == (alone.n_alarms, alone.n_false_alarms, alone.base_ns)
        assert np.array_equal(row.latency_s, alone.latency_s, equal_nan=True)


@given(st.lists(scored_recordings(), min_size=1, max_size=2), policies, st.sampled_from([500.0, 5e3, 1e6]))
def test_the_area_is_the_recall_of_operating_points_integrated_over_their_bounds(recordings, rules, most):
    curve = threshold_curve(recordings, rules)
    rate = curve.scores.false_alarms_per_minute
    if np.isnan(rate).any() or curve.scores.latency_s.shape[1] == 0:
        with pytest.raises(DataError, match="No threshold"):
            curve.found_share(most)
        return
    edges = np.unique([0.0, *rate[rate < most], most])  # between two of them the best threshold stays
    recalls = [curve.at(curve.operating_point(bound)).recall for bound in edges[:-1]]
    shares = curve.found_share(most)
    assert ((shares >= 0) & (shares <= 1 + 1e-12)).all()
    assert shares.mean() == pytest.approx(np.diff(edges) @ recalls / most)


@given(st.lists(scored_recordings(), min_size=1, max_size=2), policies, st.sampled_from([0.0, 500.0, 1e6]))
def test_the_operating_point_is_the_best_that_is_allowed(recordings, rules, bound):
    """The largest recall, of equal ones the larger F1, then the higher threshold; infinity where nothing is allowed."""
    curve = threshold_curve(recordings, rules)
    rate = curve.scores.false_alarms_per_minute
    if np.isnan(rate).any() or curve.scores.latency_s.shape[1] == 0:
        with pytest.raises(DataError, match="No threshold"):
            curve.operating_point(bound)
        return
    chosen = curve.at(curve.operating_point(bound))
    assert chosen.false_alarms_per_minute <= bound
    best = max(
        zip(curve.scores.recall, np.nan_to_num(curve.scores.f1), curve.threshold, rate <= bound, strict=True),
        key=lambda row: (row[3], *row[:3]),
    )
    assert curve.operating_point(bound) == best[2]
    assert chosen.recall == best[0]
