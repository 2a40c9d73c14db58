"""Each check finds the fault it is named after, and a healthy recording has none."""

import numpy as np
import pytest

from tactbench.core.recording.health import examine
from tactbench.core.recording.reader import open_recording
from tactbench.core.samples import Quality

N = 200


def readings():
    return np.random.default_rng(0).integers(100, 4000, (N, 3))


def found(path):
    with open_recording(path) as recording:
        return {finding.check: finding for finding in examine(recording)}


def test_a_healthy_recording(write):
    assert found(write(readings(), force=np.linspace(0, 5, N))) == {}


def flagged(flag, *rows_and_channels):
    quality = np.zeros((N, 3), dtype=np.uint8)
    for rows, channel in rows_and_channels:
        quality[rows, channel] = flag
    return quality


def changed(column, rows, value):
    data = readings()
    data[rows, column] = value
    return data


@pytest.mark.parametrize(
    ("data", "quality", "check", "says"),
    [
        (changed(1, slice(None), 77), None, "stuck", "taxel t1 constant"),
        (changed([0, 2], slice(None), 77), None, "stuck", "taxels t0 and t2 constant"),
        (changed(2, slice(None), readings()[:, 0]), None, "duplicated", "taxels t0 and t2 identical"),
        (readings(), flagged(Quality.MISSING, (slice(None), 0)), "dead", "taxel t0 without a single sample"),
        (readings(), flagged(Quality.MISSING, (slice(12), 1)), "missing", f"t1 without a sample in 12 of {N} rows"),
        (readings(), flagged(Quality.GAP, ([20, 90], slice(None))), "rows-before-lost", f"lost before 2 of {N} rows"),
        (readings(), flagged(Quality.SUSPECT, (3, 0)), "suspect", "1 samples failed parity"),
        (changed(1, slice(7), 4095), flagged(Quality.SATURATED, (20, 1)), "saturated", f"t1 saturated in 8 of {N}"),
        (changed(1, slice(7), 0), None, "saturated", f"t1 saturated in 7 of {N}"),
    ],
)
def test_what_is_wrong_with_readings_is_the_one_thing_that_is_told(write, data, quality, check, says):
    findings = found(write(data, force=np.arange(N), quality=quality))
    assert set(findings) == {check}
    assert says in findings[check].message


def test_gaps(write):
    times = np.arange(N) * 10_000_000
    times[150:] += 700_000_000
    finding = found(write(readings(), force=np.arange(N), t_ns=times))["gaps"]
    assert finding.count == 1
    assert "0.71 s" in finding.message
    assert "taxels and force_torque" in finding.message  # one clock, told once


def test_irregular_backward_and_repeated(write):
    times = np.cumsum(np.random.default_rng(1).integers(5_000_000, 15_000_000, N))
    assert "mean rate" in found(write(readings(), t_ns=times, name="a", reference=()))["irregular"].message
    regular = np.arange(N) * 10_000_000
    backward = regular.copy()
    backward[100:] -= 50_000_000
    finding = found(write(readings(), t_ns=backward, name="b", reference=()))["backward"]
    assert (finding.severity, finding.count) == ("error", 1)
    assert "row 100" in finding.message
    repeated = regular.copy()
    repeated[51] = repeated[50]
    assert found(write(readings(), t_ns=repeated, name="c", reference=()))["repeated-time"].count == 1


def test_constant_label_no_clock_excluded_and_absent(write):
    findings = found(
        write(
            readings(), notes={"object": ["ball"] * N, "press": np.arange(N)}, clock="none", excluded="it slipped off"
        )
    )
    assert findings["constant-label"].message == "label object is 'ball' in every row"
    assert "no clock stated" in findings["no-clock"].message
    assert "it slipped off" in findings["excluded"].message
    assert findings["absent"].message == "declared but not recorded: force_torque"
