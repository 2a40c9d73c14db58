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


@pytest.mark.parametrize(("columns", "says"), [((1,), "taxel t1 constant"), ((0, 2), "taxels t0 and t2 constant")])
def test_stuck(write, columns, says):
    data = readings()
    data[:, columns] = 77
    finding = found(write(data, force=np.arange(N)))["stuck"]
    assert finding.message == says
    assert finding.channels == tuple(f"t{place}" for place in columns)


def test_dead_and_missing(write):
    quality = np.zeros((N, 3), dtype=np.uint8)
    quality[:, 0] = Quality.MISSING
    quality[:12, 1] = Quality.MISSING
    findings = found(write(readings(), force=np.arange(N), quality=quality))
    assert findings["dead"].severity == "error"
    assert findings["dead"].channels == ("t0",)
    assert findings["missing"].message == f"taxel t1 without a sample in 12 of {N} rows"


def test_rows_before_a_gap_are_lost_and_the_row_itself_is_good(write):
    quality = np.zeros((N, 3), dtype=np.uint8)
    quality[[20, 90]] = Quality.GAP
    findings = found(write(readings(), force=np.arange(N), quality=quality))
    assert set(findings) == {"rows-before-lost"}
    assert findings["rows-before-lost"].message == f"taxels: rows were lost before 2 of {N} rows"


def test_saturated_at_either_end_or_said_so(write):
    data = readings()
    data[:7, 1] = 4095
    data[7:10, 1] = 0
    quality = np.zeros((N, 3), dtype=np.uint8)
    quality[20, 1] = Quality.SATURATED
    assert found(write(data, force=np.arange(N), quality=quality))["saturated"].message == (
        f"taxel t1 saturated in 11 of {N} samples"
    )


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
