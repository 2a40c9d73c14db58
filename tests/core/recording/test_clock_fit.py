"""A device's clock on the host's: within the stated bound, in order, and the same from rows as from blocks."""

import importlib.util
import itertools
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.core.recording.clock_fit import ClockFit, HostTimes, one_way
from tactbench.core.spec.recording import StreamClock

MS = 1_000_000
S = 1_000_000_000
DELAYS = ("uniform", "exponential", "burst", "gamma")


@pytest.fixture(scope="module")
def simulated():
    """The clocks and delays of the benchmark."""
    path = Path(__file__).parents[3] / "benchmarks" / "clock_fit.py"
    spec = importlib.util.spec_from_file_location("clock_fit_benchmark", path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def on_host(fit, device):
    return HostTimes(StreamClock(source="device", segments=fit.segments()))(device)


@pytest.mark.parametrize("name", DELAYS)
def test_the_error_is_within_the_bound(simulated, name):
    """Bounds from measured tables over 30 s stretches; benchmarks/clock_fit.py runs a thousand of each."""
    worst = 0.0
    for seed in range(4):
        error, bound, squares = simulated.one_run(
            np.random.default_rng([seed, 60]), simulated.DELAYS[name], 60, 100, 0.0, 600.0, 30 * S
        )
        assert error <= bound
        assert name != "burst" or squares > 1000
        worst = max(worst, error)
    assert worst <= 70


def highest_below(device, host):
    """Return the largest value at mid-time of a line below all points, by trying every pair of points."""
    middle = (int(device[0]) + int(device[-1])) // 2
    x, y = device - middle, host - device
    best = None
    for i, j in itertools.combinations(range(len(x)), 2):
        if x[i] <= 0 < x[j]:
            slope = (int(y[j]) - int(y[i])) / (int(x[j]) - int(x[i]))
            if (y - (y[i] + slope * (x - x[i])) > -1e-6).all():
                value = float(y[i] - slope * x[i])
                best = value if best is None else max(best, value)
    return best


@settings(max_examples=30, deadline=None)
@given(
    st.lists(st.tuples(st.integers(1, 10**6), st.integers(0, 10**6)), min_size=2, max_size=14), st.integers(0, 2**60)
)
def test_the_line_is_the_hulls_edge_over_the_middle(rows, start):
    steps, delays = (np.array(column, dtype=np.int64) for column in zip(*rows, strict=True))
    device = np.cumsum(steps)
    host = device + delays + start
    segment = one_way(0, (device, host))
    assert (segment.middle_ns, segment.points) == ((int(device[0]) + int(device[-1])) // 2, len(rows))
    assert segment.offset_ns - start == pytest.approx(highest_below(device, host - start), abs=1.0)  # rounded to 1 ns
    line = segment.offset_ns - start + segment.drift * (device - segment.middle_ns)
    assert (host - start - device - line > -1.0).all()
    assert segment.bound_ns is None


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32), st.lists(st.integers(0, 12000), max_size=6))
def test_blocks_and_whole_columns_are_the_same(seed, cuts):
    rng = np.random.default_rng(seed)
    device = np.cumsum(rng.integers(1, 20 * MS, 12000)) * np.where(np.arange(12000) < 9000, 1, 0)
    device[9000:] = np.cumsum(rng.integers(1, 20 * MS, 3000))  # its counter was lost
    host = np.cumsum(rng.integers(1, 20 * MS, 12000))
    whole, parts = ClockFit(), ClockFit()
    whole.add(device, host)
    for first, last in itertools.pairwise([0, *sorted(cuts), 12000]):
        parts.add(device[first:last], host[first:last])
    segments = parts.segments()
    assert parts.breaks == whole.breaks == 1
    assert {segment.run for segment in segments} == {0, 1}
    # Rows of one receipt may be cut apart, and then both count as a point; the line is the same.
    assert [(one.run, one.middle_ns, one.offset_ns, one.drift) for one in segments] == [
        (one.run, one.middle_ns, one.offset_ns, one.drift) for one in whole.segments()
    ]
    clock = StreamClock(source="device", segments=segments)
    times = HostTimes(clock)
    piecewise = [times(device[first:last]) for first, last in itertools.pairwise([0, *sorted(cuts), 12000])]
    assert np.array_equal(np.concatenate(piecewise), HostTimes(clock)(device))


def test_a_device_that_starts_again_and_one_that_pauses():
    device = np.concatenate([np.arange(0, 5 * S, 10 * MS), np.arange(0, 5 * S, 10 * MS), np.arange(40 * S, 45 * S, MS)])
    true = np.concatenate([device[:500], device[500:1000] + 8 * S, device[1000:] + 9 * S]) + 2**60
    fit = ClockFit()
    fit.add(device, true + np.random.default_rng(1).integers(0, MS, len(device)))
    assert fit.breaks == 1
    assert [segment.run for segment in fit.segments()] == [0, 1, 2]
    # 1 ms of uniform delay over 500 points: the least are a few microseconds above the line.
    assert np.abs(on_host(fit, device) - true).max() < 50_000
