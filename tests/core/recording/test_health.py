"""Each check finds the fault it is named after, and a healthy recording has none."""

import numpy as np
import pytest

from tactbench.core.recording.health import examine
from tactbench.core.recording.reader import open_recording
from tactbench.core.samples import Quality
from tactbench.core.spec.recording import ClockSegment, StreamClock, StreamCounts
from tests.core.evaluation.made import FORCE

N = 200
READINGS = np.random.default_rng(0).integers(100, 4000, (N, 3))
TIMES = np.arange(N) * 10_000_000


def flagged(flag, rows, channel, data=READINGS):
    quality = np.zeros((N, 3), dtype=np.uint8)
    quality[rows, channel] = flag
    return {"data": data, "quality": quality}


def changed(column, rows, value):
    data = READINGS.copy()
    data[rows, column] = value
    return data


def late(first, by_ns):
    return {"t_ns": TIMES + by_ns * (np.arange(N) >= first)}


PRESSED = np.maximum(10 * np.sin(np.arange(N) / 12), 0)
LATE = np.round(1000 + 100 * np.interp(np.arange(N) - 8, np.arange(N), PRESSED)[:, None] * [1, 2, 1.5]).astype(int)
LATE += READINGS % 5


JITTER = np.cumsum(np.random.default_rng(1).integers(5_000_000, 15_000_000, N))


def clocked(drift, breaks=0):
    line = ClockSegment(middle_ns=0, offset_ns=0, drift=drift, bound_ns=None, points=N)
    return {"clocks": {"taxels": StreamClock(source="device", segments=(line,), breaks=breaks)}}


LIMITED = FORCE.model_copy(update={"channels": (FORCE.channels[0].model_copy(update={"lower": 0.0, "upper": 20.0}),)})
LOST = StreamCounts(received=N + 20, written=N, dropped=7, duplicates=2, gaps=5)


@pytest.mark.parametrize(
    ("made", "expected"),
    [
        ({}, {}),
        ({"data": changed(1, slice(None), 77)}, {"stuck": "t1"}),
        ({"data": changed(2, slice(None), READINGS[:, 0])}, {"duplicated": "t2"}),
        (flagged(Quality.MISSING, slice(None), 0), {"dead": "t0"}),
        (flagged(Quality.MISSING, slice(12), 1), {"missing": f"12 of {N}"}),
        (flagged(Quality.GAP, [20, 90], slice(None)), {"rows-before-lost": f"2 of {N} rows"}),
        (flagged(Quality.SUSPECT, 3, 0), {"suspect": "1 samples"}),
        (flagged(Quality.SATURATED, 20, 1, changed(1, slice(7), 4095)), {"saturated": f"8 of {N}"}),
        ({"force": np.minimum(np.arange(N), 20), "reference": (LIMITED,)}, {"saturated": f"180 of {N}"}),
        (late(150, 700_000_000), {"gaps": "0.71 s"}),
        ({"t_ns": JITTER}, {}),
        ({"t_ns": late(100, -50_000_000)["t_ns"] - 10_000_000 * (np.arange(N) >= 50)},
         {"backward": "at 1 rows, first at row 100", "repeated-time": "1 of 200"}),
        (clocked(1e6, 2), {"clock-rate": "1e+06 s", "clock-lost": "2"}),
        ({**clocked(0.02), "t_ns": TIMES + 10**10}, {}),  # a delay of 0.1 s at an end may explain it
        ({"t_ns": 500 * TIMES}, {"rate": "0.2 Hz"}),
        ({"t_ns": 1_700_000_000_000_000_000 + 500 * TIMES}, {}),  # of this century: a row a press
        ({"data": LATE, "force": PRESSED}, {"lag": "80 ±"}),
        ({"data": LATE, "force": PRESSED, "clock": "none"}, {}),
        ({"excluded": "slipped"}, {"excluded": "slipped"}),
        ({"force": None}, {"absent": "force_torque"}),
        ({"streams": {"taxels": LOST}}, {"lost": "5 ", "repeated": "2", "unaccounted": "11"}),
    ],
)  # fmt: skip
def test_what_is_wrong_is_the_one_thing_that_is_told(write, made, expected):
    with open_recording(write(**{"data": READINGS, "force": np.arange(N), **made})) as recording:
        findings = {finding.check: finding for finding in examine(recording)}
    assert findings.keys() == expected.keys()
    assert all(says in findings[check].message for check, says in expected.items())
    errors = {check for check, finding in findings.items() if finding.severity == "error"}
    assert errors == expected.keys() & {"backward", "clock-rate", "dead"}
