"""CAN logs of a fingertip: the samples are those that the driver read."""

import can
import numpy as np
import pytest

from tactbench.plugin import DataError, Quality, UsageError
from tactbench.plugin.devices import CanFrame, LinkError
from tactbench.sensors.icub.codec import skin_frames
from tactbench.sensors.icub.log import read_log
from tests.sensors.icub.emulated import in_virtual_time, joined

EPOCH_S = 1_700_000_000.25
FAULTS = (
    "dropped-frame:half=head,every=17", "dropped-frame:half=tail,every=23", "doubled-frame:every=31",
    "not-connected:start_s=0.8,end_s=0.85", "error-word:every=3,start_s=1.2,end_s=1.3,word=0x8000",
)  # fmt: skip


def write(file, frames, begin_s=EPOCH_S):
    with can.Logger(file) as log:
        for frame in frames:
            log.on_message_received(
                can.Message(timestamp=begin_s + 1e-9 * frame.t_ns, arbitration_id=frame.id, data=frame.data,
                            is_extended_id=frame.extended, channel=0)
            )  # fmt: skip
    return file


def pairs(*at_ms, board=14, triangle=0, old=False):
    found = []
    for number, at in enumerate(at_ms):
        head, tail = skin_frames(board, triangle, [100 + number] * 12, old=old, t_ns=round(1e6 * at))
        found += [head, CanFrame(tail.id, tail.data, t_ns=tail.t_ns + 135_000)]
    return found


# ASC has microseconds; BLF is a float64 of seconds since 1970, 0.24 us. Either way against the first frame's own.
@pytest.mark.parametrize("suffix", ["asc", "blf"])
def test_a_log_holds_what_the_driver_read(tmp_path, suffix):
    driver, link = in_virtual_time(faults=FAULTS)
    with driver:
        driver.start()
        blocks = []
        while link.now_s < 2.5:
            blocks += driver.read(0.1)
        live, counts = joined(blocks), dict(driver.counts)
    log = read_log(write(tmp_path / f"log.{suffix}", link.seen), {})
    (block,) = log.blocks
    assert block.data.tolist() == live.data.tolist()
    assert block.quality.tolist() == live.quality.tolist()
    assert {int(mark) for mark in np.unique(live.quality)} >= {0, int(Quality.MISSING), int(Quality.SUSPECT)}
    assert np.abs(block.t_ns - live.t_ns).max() <= 1000
    assert log.counts == counts | {"baselines taken": 1}
    assert log.clock == "host"
    (stream,) = log.streams
    assert stream.rate_hz == pytest.approx(50.0, rel=1e-3)
    assert stream.rate_source.tag == "measured"


def test_one_of_several_fingertips_is_chosen(tmp_path):
    others = [*pairs(0, 40, 80), *pairs(2, 42, 82, board=13)]
    frames = sorted([*others, *pairs(1, 41, 81, triangle=3)], key=lambda frame: frame.t_ns)
    file = write(tmp_path / "log.asc", frames)
    with pytest.raises(UsageError, match="3 fingertips"):
        read_log(file, {})
    with pytest.raises(DataError, match="board 13"):
        read_log(file, {"board": 3})
    log = read_log(file, {"triangle": 3})
    assert log.blocks[0].t_ns.tolist() == [1_000_000, 41_000_000, 81_000_000]
    assert log.counts == {"frames of others": 12}
    assert log.streams[0].rate_hz == pytest.approx(25.0)


def test_early_firmware_is_read_when_asked_for(tmp_path):
    file = write(tmp_path / "log.blf", pairs(0, 20, 40, old=True))
    with pytest.raises(DataError, match="old_ids"):
        read_log(file, {})
    assert len(read_log(file, {"old_ids": True}).blocks[0].data) == 3


def test_times_that_go_back_keep_samples_out(tmp_path):
    file = tmp_path / "log.asc"
    lines = [
        f"   {1e-9 * frame.t_ns + 100:.6f} 1  {frame.id:X}             Rx   d 8 {frame.data.hex(' ')}\n"
        for frame in pairs(0, 20, 40, 10, 60, 80)
    ]
    head = "date Tue Nov 14 10:13:20.250 pm 2023\nbase hex  timestamps absolute\ninternal events logged\n"
    file.write_text(head + "".join(lines))
    log = read_log(file, {})
    (block,) = log.blocks
    assert block.data[:, 0].tolist() == [100, 101, 102, 104, 105]
    assert (np.diff(block.t_ns) > 0).all()
    assert log.counts["samples kept out, not after the one before"] == 1


def test_what_cannot_be_read_is_refused(tmp_path):
    (tmp_path / "log.txt").write_text("no log")
    with pytest.raises(LinkError, match=r"log\.txt"):
        read_log(tmp_path / "log.txt", {})
    file = write(tmp_path / "log.asc", [CanFrame(0x4E0, b"\x40\x01"), CanFrame(0x4E0, b"\x40\x01", t_ns=20_000_000)])
    with pytest.raises(DataError, match="board 14"):
        read_log(file, {})
    with pytest.raises(DataError, match="period"):
        read_log(write(tmp_path / "short.asc", pairs(0)), {})
