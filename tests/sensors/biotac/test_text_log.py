"""The maker's text log, written here as the maker's library prints it, from the emulator's words."""

from __future__ import annotations

from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.plugin import DataError, Quality, UsageError
from tactbench.sensors.biotac.codec import INDEX, Fault, encoded, parity_holds
from tactbench.sensors.biotac.frames import DEFAULT_FRAME, FrameBatches
from tactbench.sensors.biotac.spec import SPEC
from tactbench.sensors.biotac.text_log import read_log, read_text_log

ROTATED = tuple(name for pair in zip(DEFAULT_FRAME[1::2], DEFAULT_FRAME[::2], strict=True) for name in pair)
"""PAC first, as in the QuickStart Guide's log."""


def words(frames: int, sensor: int = 0) -> list[bytes]:
    return [encoded((7 * n + 1000 * sensor + 1) % 4096) for n in range(44 * frames)]


def printed(sensors: list[list[bytes]], frame: tuple[str, ...] = DEFAULT_FRAME, step_s: float = 0.0) -> list[str]:
    """What ``bt_save_buffer_data`` prints: batches of five frames, both counted from 1."""
    lines = []
    for n, replies in enumerate(zip(*sensors, strict=True)):
        line = f"{n * step_s:.6f} {n // 220 + 1} {n // 44 + 1} {INDEX[frame[n % 44]]} "
        for first, second in replies:
            bad = not (parity_holds(first) and parity_holds(second))
            line += f"{(first >> 1) * 32 + (second >> 3)} {int(bad)} "
        lines.append(line + "\n")
    return lines


def on_the_wire(replies: list[bytes], frame: tuple[str, ...] = DEFAULT_FRAME):
    batches = FrameBatches(frame, speed_hz=4_400_000, words=len(replies))
    first, _ = batches.next()
    batches.take(first, [part for reply in replies for part in (b"", reply)], t_ns=0)
    batches.close()
    return batches.blocks(), batches.faults


@pytest.mark.parametrize("frame", [DEFAULT_FRAME, ROTATED], ids=["default", "rotated"])
@pytest.mark.parametrize("sensor", [0, 2])
def test_a_log_gives_what_the_wire_gave(frame, sensor):
    replies = [words(6, k) for k in range(3)]
    for n in (3, 50, 91):
        replies[sensor][n] = bytes([replies[sensor][n][0] ^ 1, replies[sensor][n][1]])
    log = read_text_log(printed(replies, frame), sensor)
    blocks, faults = on_the_wire(replies[sensor], frame)
    assert [block.stream for block in log.blocks] == ["electrodes", "vibration"]
    for ours, wire in zip(log.blocks, blocks, strict=True):
        assert np.array_equal(ours.data, wire.data)
        assert np.array_equal(ours.quality, wire.quality)
        assert ours.t_ns is None
        # The log counts frames from 1.
        per_frame = len(wire.sequence) // 6
        assert np.array_equal(ours.sequence, wire.sequence + per_frame)
    assert log.faults == {name: faults[name] for name in log.faults}
    assert not log.left_out


def test_times_are_kept_where_the_log_has_them():
    log = read_text_log(printed([words(3)], step_s=1 / 4400))
    slow, fast = log.blocks
    # The log has microseconds.
    assert slow.t_ns == pytest.approx([0, 10_000_000, 20_000_000], abs=500)
    assert np.diff(fast.t_ns) == pytest.approx(1e9 / 2200, abs=1000)


def test_a_header_is_handed_on_as_it_stands():
    header = ["DataStructure: 2.0\n", "Operator: nobody\n", "SampRate: 4400\n"]
    log = read_text_log([*header, "Begin File\n", *printed([words(2)])])
    assert log.header == tuple(header)
    assert [len(block.data) for block in log.blocks] == [2, 44]
    assert read_text_log(printed([words(2)])).header == ()


def test_the_columns_of_an_absent_sensor_are_missing():
    log = read_text_log(printed([words(2), [b"\x00\x00"] * 88]), sensor=1)
    assert all((block.quality == int(Quality.MISSING)).all() for block in log.blocks)
    assert log.faults["PAC"] == {Fault.NOT_CONNECTED: 44}


def test_lost_lines_are_missing_and_the_next_frame_is_whole():
    lines = printed([words(4)])
    clean = read_text_log(lines).blocks
    del lines[44 + 2], lines[44 + 8]  # E2 of the second frame, and the PAC after E5
    slow, fast = read_text_log(lines).blocks
    assert slow.quality[1].tolist() == [0, int(Quality.MISSING)] + [0] * 20
    assert not slow.quality[[0, 2, 3]].any()
    assert set(clean[1].sequence) - set(fast.sequence) == {2 * 22 + 4}
    kept = np.isin(clean[1].sequence, fast.sequence)
    assert np.array_equal(fast.data, clean[1].data[kept])


def test_lines_that_are_no_sample_are_counted():
    lines = printed([words(2)])
    lines[10:10] = ["0.0 1 1 17 12\n", "nan 1 1 17 12 0\n", "0.0 1 1 17 4096 0\n", "0.0 1 1 17 12 2\n", "\n"]
    lines.append("0.0 1 2 15 100 0\n")
    lines.append("0.0 1 2 17 100 0\n")
    lines.append("0.000000 1 3 1")
    log = read_text_log(lines)
    assert log.left_out == {"unreadable": 5, "channel not of this sensor": 1, "out of the frame's order": 1}
    assert [len(block.data) for block in log.blocks] == [2, 44]


def test_a_log_without_samples_is_refused():
    with pytest.raises(DataError, match="sensor 3; 88 hold something else"):
        read_text_log(printed([words(2)]), sensor=3)
    with pytest.raises(DataError, match="sensor 0; 0 hold"):
        read_text_log([])


HEADER = ["DataStructure: 2.0", "Date: 3/4/2012", "Time: 12:30:01", "SampRate: 4400", "Begin File"]


def test_a_log_is_a_source_of_blocks(tmp_path):
    path = tmp_path / "log.txt"
    lines = printed([words(3), words(3, 1)], step_s=1 / 4400)
    lines[50] = "rubbish\n"
    path.write_text("\n".join(HEADER) + "\n" + "".join(lines), encoding="utf-8")
    log = read_log(path, {"sensor": 1})
    assert log.streams == SPEC.streams
    assert (log.clock, log.started) == ("host", "3/4/2012 12:30:01")
    assert log.counts == {"lines: unreadable": 1}
    for ours, theirs in zip(log.blocks, read_text_log(lines, 1).blocks, strict=True):
        assert np.array_equal(ours.data, theirs.data)
        assert np.array_equal(ours.t_ns, theirs.t_ns)


def test_a_timed_log_without_a_rate_has_that_of_its_times(tmp_path):
    path = tmp_path / "log.txt"
    path.write_text("".join(printed([words(20)], step_s=1 / 3100)), encoding="utf-8")
    slow, fast = read_log(path, {}).streams
    # Times are printed to 1 us in 284 ms.
    assert (slow.rate_hz, fast.rate_hz) == pytest.approx((3100 / 44, 3100 / 2), rel=1e-5)
    assert slow.rate_source.tag == "measured"


@pytest.mark.parametrize(
    ("header", "options", "clock", "rate_hz"),
    [
        ([], {}, "none", None),
        (HEADER, {}, "nominal", 100.0),
        ([], {"rate_hz": 2200.0}, "nominal", 50.0),
        (HEADER, {"rate_hz": 2200.0}, "nominal", 50.0),
    ],
)
def test_a_log_without_times_has_row_by_rate_or_nothing(tmp_path, header, options, clock, rate_hz):
    path = tmp_path / "log.txt"
    path.write_text("".join(f"{line}\n" for line in header) + "".join(printed([words(3)])), encoding="utf-8")
    log = read_log(path, options)
    slow, fast = log.blocks
    assert log.clock == clock
    assert log.streams[0].rate_hz == rate_hz
    if rate_hz is None:
        assert slow.t_ns is None
    else:
        assert np.diff(slow.t_ns).tolist() == [round(1e9 / rate_hz)] * 2
        assert fast.t_ns[0] == slow.t_ns[0]
        assert np.diff(fast.t_ns) == pytest.approx(1e9 / rate_hz / 22, abs=1.0)


@pytest.mark.parametrize("options", [{"sensor": -1}, {"sensor": "left"}, {"speed": 1}, {"rate_hz": 0.0}])
def test_options_of_a_log_that_are_none_are_refused(tmp_path, options):
    with pytest.raises(UsageError, match=next(iter(options))):
        read_log(tmp_path / "log.txt", options)


def test_a_log_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(DataError, match="cannot be read"):
        read_log(tmp_path / "log.txt", {})


def test_frame_numbers_that_no_time_can_have_are_refused(tmp_path):
    path = tmp_path / "log.txt"
    path.write_text("0.0 1 1099511627775 17 100 0\n", encoding="utf-8")
    with pytest.raises(DataError, match="third column"):
        read_log(path, {"rate_hz": 1.0})


@settings(max_examples=50)
@given(
    lines=st.lists(
        st.one_of(
            st.text(max_size=30),
            st.lists(st.one_of(st.integers(), st.floats(), st.integers(0, 40)), max_size=8).map(
                lambda numbers: " ".join(map(str, numbers))
            ),
        ),
        max_size=30,
    )
)
def test_any_text_is_read_or_refused(lines):
    try:
        log = read_text_log(lines)
    except DataError:
        return
    assert log.blocks or log.left_out


@settings(max_examples=20)
@given(data=st.binary(max_size=200), frame=st.integers(0, 2**41))
def test_any_bytes_of_a_file_are_read_or_refused(tmp_path_factory, data, frame):
    path = tmp_path_factory.mktemp("log") / "log.txt"
    path.write_bytes(data + f"\n0.0 1 {frame} 17 100 0\n".encode())
    with suppress(DataError):
        assert read_log(path, {"rate_hz": 4400.0}).blocks


@settings(max_examples=20)
@given(junk=st.lists(st.text(max_size=20).filter(lambda text: "begin" not in text.lower()), max_size=10))
def test_after_junk_the_frames_are_whole(junk):
    good = printed([words(3)])
    log, clean = read_text_log([*junk, *good]), read_text_log(good)
    for ours, wire in zip(log.blocks, clean.blocks, strict=True):
        assert np.array_equal(ours.data[-len(wire.data) :], wire.data)
