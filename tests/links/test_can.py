"""CAN on the buses that need no hardware, and logs of it."""

from __future__ import annotations

import os
import time

import can
import numpy as np
import pytest

from tactbench.links.can_link import _Stamps
from tactbench.plugin.devices import CanFrame, LinkError, LinkTimeout, open_link, read_can_log
from tests.links.ends import pty

FRAMES = [
    CanFrame(0x20E, b"\x4d"),
    CanFrame(0x4E0, bytes.fromhex("40 01 02 03 04 05 06 07")),
    CanFrame(0x7FF, b""),
    CanFrame(0x1FFFFFFF, b"\xff" * 8, extended=True),
]


needs_pty = pytest.mark.skipif(os.name != "posix", reason="pseudo-terminals are POSIX")


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
    with open_link("can://virtual/c") as link, pytest.raises(LinkError, match="not a valid CAN frame"):
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


class Bus:
    """Frames every 5 ms; a reader that waits for each but for a while is held up; and two clocks."""

    def __init__(self):
        self.now_ns, self.wall_ns = 0, 1_700_000_000_000_000_000
        self.stamps = _Stamps(lambda: self.now_ns, lambda: self.now_ns + self.wall_ns)

    def errors_ms(self, lag_s, held_up, *, waits=True, steps=()):
        """Return by how much later than it came each of 1000 frames is said to have come [ms]; steps [s] of the clock.

        A frame that is read while the reader is held up is read at the end of that.
        """
        found, steps = [], dict(steps)
        for number in range(1000):
            came_ns = 5_000_000 * number
            stamp_s = 1e-9 * (came_ns + self.wall_ns) - lag_s
            late_ns = max([0, *(end - came_ns for begin, end in held_up if begin <= came_ns < end)])
            after = [when for when in steps if when <= came_ns + late_ns]
            self.now_ns = came_ns + late_ns + 50_000  # a wake-up
            wall_ns = self.wall_ns
            self.wall_ns += sum(steps[when] for when in after)
            t_ns = self.stamps(stamp_s, waited=waits and not late_ns)
            found.append(1e-6 * (t_ns - came_ns))
            self.wall_ns = wall_ns  # frames of before have its stamps, whenever they are read
            for when in [one for one in after if one <= came_ns]:
                self.wall_ns += steps.pop(when)
        return np.array(found)


STALL = [(1_000_000_000, 1_400_000_000), (3_000_000_000, 3_100_000_000)]


@pytest.mark.parametrize("lag_s", [0.2, 3.0, 60.0, 3600.0, -0.25, -40.0, 1_699_999_990.0])
def test_stamps_of_another_clock_are_put_right(lag_s):
    bus = Bus()
    # The wake-up, and what float64 holds of seconds since 1970.
    assert np.abs(bus.errors_ms(lag_s, STALL)).max() < 0.06
    assert bus.stamps.lag_ns() == pytest.approx(1e9 * lag_s, abs=1e5)


@pytest.mark.parametrize("coarse_s", [0.05, 1.0])
def test_stamps_that_are_too_coarse_are_refused(coarse_s):
    bus = Bus()
    came_s = 0.005 * np.arange(1000)
    t_ns = []
    for at_s in came_s:
        bus.now_ns = round(1e9 * at_s) + 50_000
        stamp_s = coarse_s * np.floor((at_s + 1e-9 * bus.wall_ns) / coarse_s)
        t_ns.append(bus.stamps(stamp_s, waited=True))
    assert np.abs(np.array(t_ns[200:]) - 1e9 * came_s[200:]).max() < 60_000


def test_frames_that_nobody_waited_for_show_their_clock_too():
    errors_ms = Bus().errors_ms(2.0, [(0, 50_000_000)], waits=False)
    assert np.abs(errors_ms[200:]).max() < 0.06


@pytest.mark.parametrize("step_s", [-3600.0, -0.8, 0.8, 3600.0])
@pytest.mark.parametrize("lag_s", [0.0, 3.0])
def test_a_clock_that_is_set_meanwhile_loses_no_stamp(step_s, lag_s):
    steps = [(1_200_000_000, round(1e9 * step_s)), (2_500_000_000, round(1e9 * step_s / 2))]
    assert np.abs(Bus().errors_ms(lag_s, STALL, steps=steps)).max() < 0.06


def test_a_process_that_is_late_from_the_start_on_knows_when_frames_came():
    assert np.abs(Bus().errors_ms(0.0, [(0, 500_000_000)])).max() < 0.06


@needs_pty
@pytest.mark.parametrize(
    ("sent", "counts"),
    [
        (b"t4E024001\r\nt4E124002\r\nt4E224003\r\n", {}),
        (b"t4E024001\r\at4E124002\rt4E224003\r", {"errors of the adapter": 1}),
        (b"t4E024001t4E124002\rt4E224003\r", {}),
        (b"t4E0240011234t4E1240020000\rt4E2240030001\r", {}),
        (b"t4E024001\rt4E1240t4E124002\rt4E224003\r", {"unreadable frames": 1}),
        (b"z\rt4E024001\rZ\rt4E124002t4E5r4E52t4E224003\r", {"unreadable frames": 1, "remote and FD frames": 1}),
    ],
    ids=["crlf", "bel", "lost-cr", "lost-cr-with-times", "cut", "mixed"],
)
def test_lines_of_slcan_are_read_or_counted(sent, counts):
    with pty() as far, open_link(f"can://slcan/{far.name}?bitrate=1000000&sleep_after_open=0") as link:
        far.write(sent)
        found = [content(link.receive(2.0)) for _ in range(3)]
        with pytest.raises(LinkTimeout):
            link.receive(0.05)
        assert found == [(0x4E0 + n, bytes([0x40, n + 1]), False) for n in range(3)]
        assert dict(link.counts) == counts


def test_settings_of_the_user_are_not_read(monkeypatch):
    """python-can takes settings from the environment unless told otherwise."""
    monkeypatch.setenv("CAN_CONFIG", '{"receive_own_messages": true}')
    with open_link("can://virtual/d") as link:
        link.send(FRAMES[0])
        with pytest.raises(LinkTimeout):
            link.receive(0)


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
        ("log.asc", HEAD.format("relative") + LINE.format("02", "40"), "absolute times"),
        ("log.asc", HEAD.format("absolute") + LINE.format("00", "40") + LINE.format("01", "ZZ"), "after 1 frames"),
        ("log.txt", "", "log.txt"),
    ],
)
def test_what_is_no_log_is_refused(tmp_path, name, content, said):
    (tmp_path / name).write_text(content)
    with pytest.raises(LinkError, match=said):
        read_can_log(tmp_path / name)
