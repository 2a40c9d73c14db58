"""CAN on the buses that need no hardware, and logs of it."""

from __future__ import annotations

import os
import time

import can
import pytest

from tactbench.plugin.devices import CanFrame, LinkError, LinkTimeout, open_link, read_can_log
from tests.links.ends import pty

FRAMES = [
    CanFrame(0x20E, b"\x4d"),
    CanFrame(0x4E0, bytes.fromhex("40 01 02 03 04 05 06 07")),
    CanFrame(0x7FF, b""),
    CanFrame(0x1FFFFFFF, b"\xff" * 8, extended=True),
]


def content(frame: CanFrame) -> tuple[int, bytes, bool]:
    return frame.id, frame.data, frame.extended


def test_virtual_carries_frames_both_ways_within_a_process():
    with open_link("can://virtual/a") as here, open_link("can://virtual/a") as there:
        for frame in FRAMES:
            here.send(frame)
            assert content(there.receive(1.0)) == content(frame)
            there.send(frame)
            assert content(here.receive(1.0)) == content(frame)


def test_other_frames_are_counted_and_left_out():
    with open_link("can://virtual/b") as link, can.Bus("b", "virtual", ignore_config=True) as far:
        far.send(can.Message(is_error_frame=True))
        far.send(can.Message(arbitration_id=1, is_extended_id=False, is_remote_frame=True, dlc=2))
        far.send(can.Message(arbitration_id=1, is_fd=True, data=bytes(12)))
        far.send(can.Message(arbitration_id=2, is_extended_id=False, data=b"x"))
        assert content(link.receive(0)) == (2, b"x", False)
        assert link.counts == {"error frames": 1, "remote and FD frames": 2}


@pytest.mark.parametrize("frame", [CanFrame(0x800, b""), CanFrame(1, bytes(9)), CanFrame(1 << 29, b"", extended=True)])
def test_what_is_no_frame_is_refused(frame):
    with open_link("can://virtual/c") as link, pytest.raises(LinkError, match="not a CAN frame"):
        link.send(frame)


def test_a_frame_has_the_time_at_which_the_kernel_had_it_on_the_links_clock():
    """A process that is late reads frames later than they came."""
    clock = lambda: time.monotonic_ns() - 7_000_000_000  # noqa: E731
    with (
        open_link("can://virtual/e", clock) as link,
        can.Bus("e", "virtual", preserve_timestamps=True, ignore_config=True) as far,
    ):
        far.send(can.Message(arbitration_id=1, is_extended_id=False, timestamp=time.time() - 0.5))
        came_ns = clock() - 500_000_000
        assert abs(link.receive(1.0).t_ns - came_ns) < 100_000_000  # the two calls, on a busy machine
        far.send(can.Message(arbitration_id=1, is_extended_id=False, timestamp=12.5))  # an adapter's own seconds
        assert abs(link.receive(1.0).t_ns - clock()) < 100_000_000


def test_settings_of_the_user_are_not_read(monkeypatch):
    """python-can takes settings from the environment unless told otherwise."""
    monkeypatch.setenv("CAN_CONFIG", '{"receive_own_messages": true}')
    with open_link("can://virtual/d") as link:
        link.send(FRAMES[0])
        with pytest.raises(LinkTimeout):
            link.receive(0)


needs_pty = pytest.mark.skipif(os.name != "posix", reason="pseudo-terminals are POSIX")


@needs_pty
@pytest.mark.parametrize(
    "noise",
    [b"\xff\xfe", b"t4E", b"t4E0840", b"t4E01zz"],
    ids=["not-ascii", "short", "few-bytes", "no-hex"],
)
def test_noise_on_slcan_costs_what_it_hit(noise):
    with pty() as far, open_link(f"can://slcan/{far.name}?bitrate=1000000&sleep_after_open=0") as link:
        far.write(noise + b"\rt4E024001\r")
        assert content(link.receive(2.0)) == (0x4E0, b"\x40\x01", False)
        assert link.counts["unreadable frames"] == 1


# Logs: ASC has microseconds; a BLF stamp is a float64 of seconds since 1970, 250 ns.
@pytest.mark.parametrize(("suffix", "tolerance_ns"), [("log", 1000), ("asc", 501), ("blf", 250)])
def test_times_of_a_log_count_from_its_first_message(tmp_path, suffix, tolerance_ns):
    offsets_s = [0.0, 0.0000015, 0.02, 3600.5]
    with can.Logger(tmp_path / f"bus.{suffix}") as log:
        for number, offset_s in enumerate(offsets_s):
            at_s = 1_700_000_000.25 + offset_s
            log.on_message_received(can.Message(timestamp=at_s, arbitration_id=number, data=b"x", channel=0))
    frames, counts = read_can_log(tmp_path / f"bus.{suffix}")
    assert [frame.id for frame in frames] == [0, 1, 2, 3]
    assert [frame.t_ns for frame in frames] == pytest.approx([1e9 * offset for offset in offsets_s], abs=tolerance_ns)
    assert counts == {}


HEAD = "date Tue Nov 14 10:13:20.250 pm 2023\nbase hex  timestamps {}\ninternal events logged\n"
LINE = "   0.{} 1  4E0             Rx   d 1 {}\n"


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("log.asc", HEAD.format("relative") + LINE.format("02", "40"), "absolute ones"),
        ("log.asc", HEAD.format("absolute") + LINE.format("00", "40") + LINE.format("01", "ZZ"), "after 1 frames"),
        ("log.txt", "", "log.txt"),
    ],
)
def test_what_is_no_log_is_refused(tmp_path, name, content, said):
    (tmp_path / name).write_text(content)
    with pytest.raises(LinkError, match=said):
        read_can_log(tmp_path / name)
