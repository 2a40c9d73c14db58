"""The answer delay: its parts against the filter that is used, the sum, and what the row says of it."""

import itertools
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from tactbench.core.evaluation.dataset import load_dataset
from tactbench.core.evaluation.delay import (
    NO_LINK,
    NO_RATE,
    answer_delay_ms,
    calls_s,
    peak_rss_mb,
    stated_delay_ms,
)
from tactbench.core.evaluation.folds import TaskData
from tactbench.core.evaluation.protocols import PROTOCOLS, protocol_called
from tactbench.core.plugins.registry import load_registry
from tactbench.plugin import assumed
from tests.core.evaluation.made import force_task, ramp, roles, sensor
from tests.core.evaluation.test_dataset import two_streams

TASK = force_task(protocols=tuple(PROTOCOLS))
STEP_NS = 12_000_000  # 12 ms, as the paper's 5000 samples in 60 s
K = 40


def pressed(folder, *, step_ns=STEP_NS, own_hz=None):
    """Three recordings, one a role, of a sensor without a rate or a link of its own; `step_ns` 0: without a clock."""
    clock = np.arange(1000, dtype=np.int64) * step_ns if step_ns else None
    return roles(folder, partial(ramp, n=1000), t_ns=clock, own_rates_hz=own_hz or {})


OLS = load_registry().estimators["ols"].model_copy(update={"window_grid": (K,)})


def reading_delay_ms(data, name="deployable", k=K):
    return stated_delay_ms(TaskData(TASK, protocol_called(name), "roles", data, data, ()), OLS, k)


@pytest.mark.parametrize("name", [name for name in PROTOCOLS if name != "first-frame"])
def test_the_window_of_every_protocol_is_the_group_delay_of_its_mean(tmp_path, name):
    data = load_dataset(TASK, pressed(tmp_path / "a"))
    for k in (0, 1, 5, K):
        parts, _ = reading_delay_ms(data, name, k)
        # A mean of n = k + 1 samples is late by (n - 1) / 2 of them. Clocks are whole nanoseconds: 1e-9 of a second.
        assert parts["window"] == pytest.approx(k / 2 * 12.0, abs=1e-6)


def test_a_quicker_sensor_waits_less_for_its_next_sample_and_the_scene_says_what_it_did(tmp_path):
    for own_hz in (1 / 0.012, 100.0):
        data = load_dataset(TASK, pressed(tmp_path / f"{own_hz:.0f}", own_hz={"taxels": own_hz}))
        linked = sensor().model_copy(update={"link_delay": assumed(0.5, "ms", "a test")})
        tables = [replace(one, meta=one.meta.model_copy(update={"sensor": linked})) for one in data.tables]
        parts, remark = reading_delay_ms(replace(data, tables=tuple(tables)))
        # The window is at the rate of the recordings.
        assert parts == pytest.approx({"sampling": 1e3 / own_hz, "window": 240.0, "link": 0.5})
        assert remark == ""


@pytest.mark.parametrize(("stated_hz", "sampling_ms"), [(100.0, 12.0), (83.3, 12.0), (50.0, 20.0)])
def test_a_stated_rate_that_the_clock_denies_shortens_no_delay(tmp_path, stated_hz, sampling_ms):
    data = load_dataset(TASK, pressed(tmp_path / "a"))
    (stream,) = sensor().streams
    stated = sensor().model_copy(update={"streams": (stream.model_copy(update={"rate_hz": stated_hz}),)})
    tables = [replace(one, meta=one.meta.model_copy(update={"sensor": stated})) for one in data.tables]
    parts, _ = reading_delay_ms(replace(data, tables=tuple(tables)))
    assert parts["sampling"] == pytest.approx(sampling_ms, rel=1e-3)  # digits of the stated rate


def test_what_is_not_known_is_absent_and_said(tmp_path):
    data = load_dataset(TASK, pressed(tmp_path / "a"))
    parts, remark = reading_delay_ms(data)
    assert (parts, remark) == (pytest.approx({"sampling": 12.0, "window": 240.0}), NO_LINK)
    t = np.arange(0.0, 1000.0, 10.0)
    both = load_dataset(force_task(features=("taxel", "ac_pressure")), [two_streams(tmp_path / "b.h5", *3 * [(t, t)])])
    assert reading_delay_ms(both)[1] == NO_RATE, "the second stream states no rate"
    for step_ns in (0, 1_500_000_000):  # a row a press: the pause between presses is no sampling interval
        timeless = load_dataset(TASK, pressed(tmp_path / f"{step_ns}", step_ns=step_ns))
        assert reading_delay_ms(timeless) == ({}, NO_RATE)
    known = {"sampling": 1.0, "window": 2.0, "link": 4.0, "features": 8.0, "prediction": 16.0}
    for lost, total in (("link", 27.0), *((name, None) for name in known if name != "link")):
        assert answer_delay_ms({name: ms for name, ms in known.items() if name != lost}, "features") == total
    assert [answer_delay_ms(parts, "nothing") for parts in ({}, {"prediction": 16.0})] == [None, 16.0]


@pytest.mark.parametrize(("step_s", "calls"), [(0.0, 200), (2.0**-7, 39), (1.0, 20)])
def test_calls_are_timed_until_their_number_or_their_time_is_enough(step_s, calls):
    """After 20 calls, 0.3 s are enough; one call before is not counted."""
    seen, looks = [], itertools.count()
    spent_s = calls_s(range(1000), seen.append, lambda: step_s * next(looks))
    assert spent_s.tolist() == [step_s] * calls
    assert len(seen) == calls + 1
    assert (seen[0], min(seen), max(seen) > 500) == (0, 0, True)


def test_the_memory_of_this_process_is_in_megabytes():
    pytest.importorskip("resource", reason="only POSIX reports it")
    assert 20 < peak_rss_mb() < 20_000
