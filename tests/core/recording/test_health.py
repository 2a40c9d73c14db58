"""Each check finds the fault it is named after, and a healthy recording has none."""

import numpy as np
import pytest

from tactbench.core.recording.health import examine, is_copy, listed
from tactbench.core.recording.reader import UnwrittenRecording, open_recording
from tactbench.core.samples import Quality, StreamData
from tactbench.core.spec.recording import ClockSegment, StreamClock, StreamCounts
from tests.core.evaluation.made import FORCE
from tests.core.recording.conftest import about

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


def checks(hz, stated, gap_ns=0):
    """Return the findings about the clock of a stream of 201 rows, with a gap before the last row."""
    meta = about(reference=())
    spec = meta.sensor.streams[0].model_copy(update={"rate_hz": stated})
    meta = meta.model_copy(update={"sensor": meta.sensor.model_copy(update={"streams": (spec,)})})
    times = np.round(np.arange(N + 1) * 1e9 / hz).astype(np.int64)
    times[-1] += gap_ns
    rows = StreamData(spec, times, np.vstack((READINGS, READINGS[:1])), None)
    return {one.check: one.message for one in examine(UnwrittenRecording(meta, [rows]))}


@pytest.mark.parametrize(
    ("hz", "stated", "found", "suspected"),
    [
        (95.1, 100, False, ""), (94.9, 100, True, ""), (104.9, 100, False, ""), (105.1, 100, True, ""),
        (2.1, 100, True, ""), (1.9, 100, True, "ms read as s"),
        (4900, 100, True, ""), (5100, 100, True, "s read as ms"),
        (1.1, None, False, ""), (0.9, None, True, "ms read as s"), (1e6, None, False, ""),
    ],
)  # fmt: skip
def test_a_rate_is_reported_beyond_five_percent_and_a_unit_suspected_beyond_a_factor(hz, stated, found, suspected):
    told = checks(hz, stated)
    assert told.keys() == {"rate"} & {"rate" * found}
    assert suspected in told.get("rate", "")
    assert ("read as" in told.get("rate", "")) == bool(suspected)


@pytest.mark.parametrize(("gap_ns", "found"), [(40_000_000, False), (40_000_001, True)])
def test_a_gap_is_longer_than_five_steps(gap_ns, found):
    assert ("gaps" in checks(100, None, gap_ns)) == found


def test_up_to_six_names_are_listed():
    assert listed("a") == "a"
    assert listed("abcdef") == "a, b, c, d, e and f"
    assert listed("abcdefg") == "a, b, c … (7 channels)"


@pytest.mark.parametrize(
    ("values", "late", "copied"),
    [(200, 5, True), (200, -5, True), (200, 6, False), (200, -6, False), (199, 5, False), (199, 0, False)],
)
def test_a_copy_is_monotone_and_at_most_five_rows_late(values, late, copied):
    one = np.random.default_rng(0).permutation(np.arange(3000) % values) ** 3.0
    other = np.roll(-np.cbrt(one), late)
    assert is_copy(one, other) == copied
    assert is_copy(one, 3 * one + 1)
    assert not is_copy(one, np.zeros(3000))
    assert not is_copy(one, other, np.arange(3000))  # no two rows of one recording
    other[1500:1510] = np.random.default_rng(1).permutation(other[1500:1510])
    assert not is_copy(one, other)


@pytest.mark.parametrize("rows", [0, 1])
def test_a_stream_without_rows_is_empty(write, rows):
    with open_recording(write(READINGS[:rows], force=np.zeros(rows), t_ns=TIMES[:rows])) as recording:
        found = [one.stream for one in examine(recording) if one.check == "empty"]
    assert found == ([] if rows else ["taxels", "force_torque"])
