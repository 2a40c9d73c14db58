"""A device's clock on the host's: within the stated bound, in order, and the same from rows as from blocks."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from tactbench.core.recording.clock_fit import fit, host_times, one_way, wrong_rate
from tactbench.core.spec.recording import ClockSegment
from tests.conftest import ROOT

MS = 1_000_000
S = 1_000_000_000


@pytest.mark.parametrize("name", ["exponential", "burst"])
def test_the_error_is_within_the_bound(monkeypatch, name):
    """Bounds from measured tables over 30 s stretches; studies/clock_fit.py runs a thousand of each."""
    monkeypatch.syspath_prepend(ROOT / "studies")
    import clock_fit as simulated

    for seed in range(4):
        error, bound, squares = simulated.one_run(
            np.random.default_rng([seed, 60]), simulated.DELAYS[name], 60, 100, 0.0, 600.0, 30 * S
        )
        assert error <= min(bound, 70)
        assert name != "burst" or squares > 1000


@settings(max_examples=30)
@given(
    st.lists(st.tuples(st.integers(1, 10**6), st.integers(0, 10**6)), min_size=2, max_size=14), st.integers(0, 2**60)
)
def test_the_line_is_the_highest_at_mid_time_of_those_below_all_points(rows, start):
    steps, delays = (np.array(column, dtype=np.int64) for column in zip(*rows, strict=True))
    device = np.cumsum(steps)
    segment = one_way(0, (device, device + delays + start))
    middle = (int(device[0]) + int(device[-1])) // 2
    assert (segment.middle_ns, segment.points, segment.bound_ns) == (middle, len(rows), None)
    x, offset = device - middle, segment.offset_ns - start
    highest = linprog([-1, 0], np.column_stack([np.ones(len(x)), x * 1e-6]), delays, bounds=(None, None)).x[0]
    assert offset == pytest.approx(highest, abs=1.0)  # rounded to 1 ns
    assert (delays - offset - segment.drift * x > -1.0).all()


def test_a_device_that_starts_again_and_one_that_pauses():
    run = np.arange(0, 5 * S, 10 * MS)
    device = np.concatenate([run, run, run + 40 * S])
    true = np.concatenate([run, run + 8 * S, run + 49 * S]) + 2**60
    lines = fit(device, true + np.random.default_rng(1).integers(0, MS, len(device)))
    assert [(line.run, line.points) for line in lines] == [(0, 500), (1, 500), (2, 500)]
    # 1 ms of uniform delay over 500 points: the least are a few microseconds above the line.
    assert np.abs(host_times(lines, device) - true).max() < 50_000


@pytest.mark.parametrize(("step_ns", "runs"), [(15 * S, [0]), (15 * S + 1, [0, 1]), (0, [0]), (-1, [0, 1])])
def test_a_new_run_begins_where_the_device_goes_back_or_leaps_more_than_half_a_stretch(step_ns, runs):
    device = np.array([0, MS, MS + step_ns, 2 * MS + step_ns])
    lines = fit(device, np.array([0, 2 * MS, 3 * MS, 4 * MS]))
    assert [line.run for line in lines] == runs


def test_a_line_is_of_a_stretch_and_the_last_line_of_the_rest():
    """Rows that were received together count once, by the last of them."""
    device = np.arange(0, 75 * S, S)
    lines = fit(np.repeat(device, 2) + np.tile([0, MS], len(device)), np.repeat(device, 2) + 9)
    assert [line.points for line in lines] == [30, 30, 30, 30]
    assert [line.middle_ns // S for line in lines] == [14, 29, 44, 59]
    assert [line.points for line in fit(device[:37], device[:37] + 9)] == [37]


def test_between_the_middles_of_two_lines_one_goes_over_into_the_other():
    lines = [
        ClockSegment(run=0, middle_ns=at, offset_ns=at // 10, drift=0.0, bound_ns=None, points=9)
        for at in (100, 200, 400)
    ]
    device = np.array([0, 100, 150, 200, 250, 400, 500])
    assert (host_times(lines, device) - device).tolist() == [10, 10, 15, 20, 25, 40, 40]


@pytest.mark.parametrize(
    ("per_second", "wrong"),
    [(S, False), (S * 10001 // 10000, False), (1_000_000, True), (1, True), (S * 107 // 100, True)],
)
def test_a_clock_in_another_unit_or_of_another_rate_is_named(per_second, wrong):
    host = np.arange(0, 10 * S, 10 * MS)
    device = host * per_second // S if per_second < S else host // 1000 * (per_second // 1_000_000)
    (line,) = fit(device, host)
    assert bool(wrong_rate("taxels", line.drift, int(host[-1]))) == wrong
    assert not wrong_rate("taxels", line.drift, MS)
