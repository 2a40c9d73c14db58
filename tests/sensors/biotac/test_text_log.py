"""The maker's text log, written here as the maker's library prints it."""

import numpy as np
import pytest

from tactbench.plugin import DataError, Quality, UsageError
from tactbench.sensors.biotac import SPEC
from tactbench.sensors.biotac.codec import INDEX, encoded, parity_holds
from tactbench.sensors.biotac.frames import DEFAULT_FRAME, FrameBatches
from tactbench.sensors.biotac.text_log import read_log

ROTATED = tuple(name for pair in zip(DEFAULT_FRAME[1::2], DEFAULT_FRAME[::2], strict=True) for name in pair)
"""PAC first, as in the QuickStart Guide's log."""
HEADER = "DataStructure: 2.0\nDate: 3/4/2012\nTime: 12:30:01\nSampRate: 4400\nBegin File\n"
MISSING = int(Quality.MISSING)


def words(frames, sensor=0):
    return [encoded((7 * n + 1000 * sensor + 1) % 4096) for n in range(44 * frames)]


def printed(*sensors, frame=DEFAULT_FRAME, step_s=0.0):
    """What ``bt_save_buffer_data`` prints: batches of five frames, both counted from 1."""
    lines = []
    for n, replies in enumerate(zip(*sensors, strict=True)):
        line = f"{n * step_s:.6f} {n // 220 + 1} {n // 44 + 1} {INDEX[frame[n % 44]]} "
        for first, second in replies:
            bad = not (parity_holds(first) and parity_holds(second))
            line += f"{(first >> 1) * 32 + (second >> 3)} {int(bad)} "
        lines.append(line + "\n")
    return lines


@pytest.fixture
def log_of(tmp_path):
    def read(lines, **options):
        (tmp_path / "log.txt").write_text("".join(lines), encoding="utf-8")
        return read_log(tmp_path / "log.txt", options)

    return read


@pytest.mark.parametrize("frame", [DEFAULT_FRAME, ROTATED], ids=["default", "rotated"])
@pytest.mark.parametrize("sensor", [0, 2])
def test_a_log_gives_what_the_wire_gave(log_of, frame, sensor):
    replies = [words(6, k) for k in range(3)]
    for n in (3, 50, 91):
        replies[sensor][n] = bytes([replies[sensor][n][0] ^ 1, replies[sensor][n][1]])
    log = log_of(printed(*replies, frame=frame), sensor=sensor)
    batches = FrameBatches(frame, speed_hz=4_400_000, words=264)
    batches.take(batches.next()[0], [part for reply in replies[sensor] for part in (b"", reply)], t_ns=0)
    for ours, wire in zip(log.blocks, batches.blocks(incomplete=True), strict=True):
        assert ours.stream == wire.stream
        assert np.array_equal(ours.data, wire.data)
        assert np.array_equal(ours.quality, wire.quality)
        assert ours.t_ns is None
        # The log counts frames from 1.
        assert np.array_equal(ours.sequence, wire.sequence + len(wire.sequence) // 6)
    assert log.counts == batches.counts


def test_header_times_and_rates(log_of):
    log = log_of([HEADER, *printed(words(3), step_s=1 / 4400)])
    slow, fast = log.blocks
    # The log has microseconds.
    assert slow.t_ns == pytest.approx([0, 10_000_000, 20_000_000], abs=500)
    assert np.diff(fast.t_ns) == pytest.approx(1e9 / 2200, abs=1000)
    assert log.streams == SPEC.streams
    assert (log.clock, log.started) == ("host", "3/4/2012 12:30:01")
    slow, fast = log_of(printed(words(20), step_s=1 / 3100)).streams
    # Times are printed to 1 us in 284 ms.
    assert (slow.rate_hz, fast.rate_hz) == pytest.approx((3100 / 44, 3100 / 2), rel=1e-5)
    assert slow.rate_source.tag == "measured"


@pytest.mark.parametrize(
    ("header", "options", "clock", "rate_hz"),
    [
        ("", {}, "none", None),
        (HEADER, {}, "nominal", 100.0),
        ("", {"rate_hz": 2200.0}, "nominal", 50.0),
        (HEADER, {"rate_hz": 2200.0}, "nominal", 50.0),
    ],
)
def test_a_log_without_times_has_row_by_rate_or_nothing(log_of, header, options, clock, rate_hz):
    log = log_of([header, *printed(words(3))], **options)
    slow, fast = log.blocks
    assert (log.clock, log.streams[0].rate_hz) == (clock, rate_hz)
    if rate_hz is None:
        assert slow.t_ns is None
    else:
        assert np.diff(slow.t_ns).tolist() == [round(1e9 / rate_hz)] * 2
        assert fast.t_ns[0] == slow.t_ns[0]
        assert np.diff(fast.t_ns) == pytest.approx(1e9 / rate_hz / 22, abs=1.0)


def test_the_columns_of_an_absent_sensor_are_missing(log_of):
    log = log_of(printed(words(2), [b"\x00\x00"] * 88), sensor=1)
    assert all((block.quality == MISSING).all() for block in log.blocks)
    assert log.counts["not connected PAC"] == 44


def test_lines_that_are_no_sample_are_counted(log_of):
    lines = printed(words(2))
    lines[10:10] = ["0.0 1 1 17 12\n", "nan 1 1 17 12 0\n", "0.0 1 1 17 4096 0\n", "0.0 1 1 17 12 2\n", "\n"]
    lines += ["0.0 1 2 15 100 0\n", "0.0 1 2 17 100 0\n", "0.000000 1 3 1"]
    log = log_of(lines)
    assert log.counts == {
        "lines: unreadable": 5, "lines: channel not of this sensor": 1, "lines: out of the frame's order": 1,
    }  # fmt: skip
    assert [len(block.data) for block in log.blocks] == [2, 44]


def test_what_cannot_be_read_is_refused(log_of, tmp_path):
    with pytest.raises(DataError, match="sensor 3"):
        log_of(printed(words(2)), sensor=3)
    with pytest.raises(DataError, match="sensor 0"):
        log_of([])
    with pytest.raises(DataError, match=r"none\.txt"):
        read_log(tmp_path / "none.txt", {})
    with pytest.raises(UsageError, match="rate_hz"):
        log_of([], rate_hz=0.0)
