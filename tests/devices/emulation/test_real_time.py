"""Devices in real time on links of this machine."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
import serial

from tactbench.core.errors import LinkError, LinkUnplugged
from tactbench.devices.emulation.real_time import RealTimeDevices, SlcanAdapter
from tactbench.plugin.devices import open_link
from tests.devices.emulation.models import Answerer, Complement, Recorder
from tests.devices.emulation.test_virtual_time import on, say

needs_pty = pytest.mark.skipif(os.name != "posix", reason="pseudo-terminals are POSIX")


def opened(devices, name="a"):
    return open_link(devices.addresses[name], devices.clock)


@needs_pty
@pytest.mark.parametrize("kind", ["bytes", "can", "datagram", "spi"])
def test_requests_are_answered_by_the_wall_clock(kind):
    emulator = Complement() if kind == "spi" else Answerer(after_s=0.05)
    with RealTimeDevices({"a": on(kind, emulator)}) as devices, opened(devices) as link:
        before_ns = devices.clock()
        say(link)
        came = link.receive(5.0)
        assert came.data == ((b"\x9e\x9d", b"", b"") if kind == "spi" else b"ab")
        # Never early; how late is the machine's.
        assert came.t_ns - before_ns >= 50e6 - 1


@needs_pty
def test_an_unplugged_terminal_is_gone():
    with RealTimeDevices({"a": on("bytes", Answerer())}) as devices:
        with opened(devices) as link:
            devices._open["a"][0]._unplugged_s = 0.0  # once it is open, however long that took
            with pytest.raises(LinkUnplugged):
                link.read(5.0)
        with pytest.raises(LinkError):
            opened(devices)


@pytest.mark.parametrize(
    ("told", "answer"),
    [
        (b"t1230\r", b""),  # not open
        (b"S8\rO\rt1232AABB\rT1FFFFFFF11f\r", b"t1232AABB\rT1FFFFFFF11F\r"),
        (b"O\rt1239\rr1232\rhello\r\xff\rt1230\r", b"t1230\r"),  # no frame, a remote one, noise
        (b"O\r" + b"x" * 100_000 + b"\rt1230\r", b"t1230\r"),
    ],
)
def test_the_adapter_carries_data_frames_while_it_is_open(told, answer):
    adapter = SlcanAdapter(Answerer(0.0))
    assert b"".join(piece for _, piece in adapter.feed(told, 1.0)) == answer
    assert len(adapter._line) < 100


@needs_pty
def test_a_terminal_does_not_echo_and_stays_for_the_next_host():
    with RealTimeDevices({"a": on("bytes", Recorder(0.01))}) as devices:
        port = devices.addresses["a"].removeprefix("serial://").partition("?")[0]
        for _ in range(2):
            with serial.Serial(port, 115200, timeout=5.0) as host:
                assert len(host.read(6)) == 6


@needs_pty
def test_what_an_emulator_raises_unplugs_the_devices_and_is_raised():
    class Broken(Answerer):
        def feed(self, piece, now_s):
            raise ZeroDivisionError("a model that is wrong")

    devices = RealTimeDevices({"a": on("bytes", Broken())})
    with opened(devices) as link:
        link.write(b"x")
        with pytest.raises(LinkUnplugged):
            link.read(5.0)
    with pytest.raises(ZeroDivisionError):
        devices.check()
    devices.close()
    devices.close()


def test_ending_gives_everything_back():
    descriptors = Path("/proc/self/fd")
    if not descriptors.is_dir():
        pytest.skip("this system does not list a process's open files")

    def use():
        models = {kind: on(kind, Complement() if kind == "spi" else Answerer()) for kind in ("bytes", "can", "spi")}
        with RealTimeDevices({"udp": on("datagram", Answerer()), **models}) as devices:
            for name in devices.addresses:
                opened(devices, name).close()

    use()  # what libraries open once
    before = len(list(descriptors.iterdir()))
    use()
    assert len(list(descriptors.iterdir())) == before
