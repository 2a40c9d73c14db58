"""A clock that is late is found, with its uncertainty; a sensor that creeps, relaxes or has hysteresis is not late."""

import numpy as np
import pytest

from tactbench.core.recording.lag import find_lag, windows

STEP_S = 0.001


def presses(times, seed):
    """Forces of presses that last .5 to 2.5 s, with rests in between."""
    rng = np.random.default_rng(seed)
    force, start = np.zeros(len(times)), times[0]
    while start < times[-1]:
        length = rng.uniform(0.5, 2.5)
        within = (times >= start) & (times < start + length)
        force[within] = rng.uniform(2, 10) * np.sin(np.pi * (times[within] - start) / length)
        start += length + rng.uniform(0.2, 1)
    return force


def low_pass(values, constant):
    out, share = np.empty_like(values), 1 - np.exp(-STEP_S / constant)
    held = values[0]
    for place, value in enumerate(values):
        held += share * (value - held)
        out[place] = held
    return out


def play(values, width):
    out, held = np.empty_like(values), values[0]
    for place, value in enumerate(values):
        held = min(max(held, value - width), value + width)
        out[place] = held
    return out


def clocked(
    answer=np.sqrt, *, lag=0.0, drift=0.0, rate_hz=100, force_hz=100, seed=1, seconds=20, force=presses, noise=0.02
):
    """Return times and samples of four taxels and of the force; what taxels sense at t is stamped t + lag + drift t."""
    rng = np.random.default_rng(seed)
    fine = np.arange(-3, seconds + 3, STEP_S)
    pressed = force(fine, seed)
    sensed = answer(pressed)
    times, force_times = (
        np.arange(0, seconds, 1 / hz) + rng.uniform(-0.2, 0.2, seconds * hz) / hz for hz in (rate_hz, force_hz)
    )
    taxels = np.interp(times - lag - drift * times, fine, sensed)[:, None] * [1, -0.4, 0.8, 0.6]
    taxels = 1000 + 200 * (taxels + noise * rng.normal(size=taxels.shape))
    forces = np.interp(force_times, fine, pressed) + noise * rng.normal(size=len(force_times))
    return (1e9 * times).astype(np.int64), taxels, (1e9 * force_times).astype(np.int64), forces[:, None]


@pytest.mark.parametrize("lag", [0.05, 0.25, 1.0, -0.05, -0.25, -1.0])
@pytest.mark.parametrize(("rate_hz", "force_hz"), [(100, 100), (50, 30), (1000, 100), (30, 1000)])
def test_a_lag_is_found_with_its_uncertainty(lag, rate_hz, force_hz):
    found = find_lag(*clocked(lag=lag, rate_hz=rate_hz, force_hz=force_hz))
    seconds, error = found.middle
    assert abs(seconds - lag) < 3 * error < 0.05
    assert not found.drifts


@pytest.mark.parametrize("drift", [0.005, -0.02])
def test_a_clock_that_runs_fast_or_slow_is_found(drift):
    found = find_lag(*clocked(drift=drift, lag=0.02))
    assert found.drifts
    assert abs(found.beginning[0] - 0.02) < 0.02
    assert abs(found.end[0] - 0.02 - 20 * drift) < 0.02


SOUND = {
    "linear": lambda f: f,
    "saturated": lambda f: np.minimum(f, 4),
    **{f"creep {tau}": lambda f, tau=tau: f + low_pass(f, tau) for tau in (0.05, 0.3, 1.5, 5)},
    **{f"relaxation {tau}": lambda f, tau=tau: f - 0.6 * low_pass(f, tau) for tau in (0.05, 0.3, 1.5, 5)},
    "hysteresis": lambda f: f + play(f, 0.4) + play(f, 1.5),
    "hysteresis and creep": lambda f: f + play(f, 1) + low_pass(f, 0.5),
}


@pytest.mark.parametrize("answer", SOUND.values(), ids=SOUND)
def test_a_sensor_with_a_memory_is_not_late(answer):
    assert find_lag(*clocked(answer)) is None


@pytest.mark.parametrize("force", [lambda t, _: t + 3, lambda t, _: 5 - 5 * np.cos(t / 7), lambda t, _: 0 * t])
def test_what_cannot_tell_is_no_lag(force):
    assert find_lag(*clocked(lambda f: f + low_pass(f, 1.5), force=force, noise=0.1)) is None


def test_creep_does_not_hide_a_lag():
    found = find_lag(*clocked(lambda f: f + low_pass(f, 1.5), lag=0.25))
    assert found.middle[0] == pytest.approx(0.25, abs=0.03)


def test_a_recording_is_searched_whole_or_at_both_ends_if_it_is_long():
    tenths = np.arange(2002) * 10**8 + 5 * 10**9
    assert windows(tenths, tenths[1:]) == {"": (5_100_000_000, 205_100_000_000)}
    first, last = 5_000_000_000, 205_100_000_000
    ends = {" at the beginning": (first, first + 10**11), " at the end": (last - 10**11, last)}
    assert windows(tenths, tenths) == ends
    fast = np.arange(6002) * 10**7
    assert windows(fast[:-1], fast) == {"": (0, 60 * 10**9)}
    assert windows(fast, fast) == {
        " at the beginning": (0, 30 * 10**9),
        " at the end": (30_010_000_000, 60_010_000_000),
    }


@pytest.mark.parametrize(
    ("given", "beginning", "middle", "end"),
    [
        ({"lag": 0.25}, (0.249358, 0.002702), (0.249049, 0.001973), (0.248740, 0.003049)),
        ({"lag": 0.3, "drift": 0.02}, (0.306527, 0.002646), (0.509279, 0.001780), (0.712030, 0.002149)),
        ({"lag": 0.02, "drift": -0.02, "rate_hz": 50, "force_hz": 30},
         (0.019203, 0.005030), (-0.175648, 0.004896), (-0.370500, 0.005057)),
    ],
)  # fmt: skip
def test_lags_and_uncertainties_are_those_that_were_looked_at(given, beginning, middle, end):
    found = find_lag(*clocked(**given))
    for one, expected in ((found.beginning, beginning), (found.middle, middle), (found.end, end)):
        assert one == pytest.approx(expected, rel=1e-3)
