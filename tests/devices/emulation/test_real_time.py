"""Devices in real time on links of this machine: by due times without a clock, and a short while by the wall clock."""

from __future__ import annotations

import math
import os
from pathlib import Path

import pytest
import serial

from tactbench.core.errors import LinkError, LinkTimeout, LinkUnplugged
from tactbench.devices.emulation.emulated_devices import EmulatedDevices
from tactbench.devices.emulation.line import Line, LinkFault
from tactbench.devices.emulation.real_time import PseudoTerminal, RealTimeServer, SlcanAdapter
from tactbench.plugin.devices import open_link
from tests.devices.emulation.models import Answerer, Complement, Recorder
from tests.devices.emulation.test_virtual_time import on, say

needs_pty = pytest.mark.skipif(os.name != "posix", reason="pseudo-terminals are POSIX")


@needs_pty
def test_what_is_due_is_sent_and_nothing_before():
    """Served at chosen moments: what is overdue is sent at once."""
    end = PseudoTerminal("serial://{}?baud=9600")
    server = RealTimeServer({"a": (Line(Recorder(period_s=0.01)), end)}, lambda: 0)
    try:
        with open_link(end.address) as link:
            assert server.serve(0.0099) == pytest.approx(0.01)
            with pytest.raises(LinkTimeout):
                link.read(0.0)
            assert server.serve(0.01) == pytest.approx(0.02)
            assert link.read(1.0).data == bytes([0, 0, 0])
            assert server.serve(0.0303) == pytest.approx(0.04)
            data = link.read(1.0).data
            assert data + (b"" if len(data) == 6 else link.read(1.0).data) == bytes([1, 0, 0, 2, 0, 0])
    finally:
        server.close()


@needs_pty
@pytest.mark.parametrize("kind", ["bytes", "can", "datagram", "spi"])
def test_requests_are_answered_by_the_wall_clock(kind):
    emulator = Complement() if kind == "spi" else Answerer(after_s=0.05)
    with EmulatedDevices({"a": on(kind, emulator)}, time="real") as devices, devices.open_link("a") as link:
        before_ns = devices.clock()
        say(link)
        came = link.receive(5.0)
        assert came.data == ((b"\x9e\x9d", b"", b"") if kind == "spi" else b"ab")
        # Never early; how late is the machine's.
        assert came.t_ns - before_ns >= 50e6 - 1


@needs_pty
def test_an_unplugged_terminal_is_gone():
    end = PseudoTerminal("serial://{}?baud=9600")
    server = RealTimeServer({"a": (Line(Recorder(1.0), [LinkFault.parse("unplug:start_s=1.5")]), end)}, lambda: 0)
    try:
        with open_link(end.address) as link:
            assert server.serve(1.0) == 1.5
            assert link.read(1.0).data == b"\0\0\0"
            assert server.serve(1.5) == math.inf
            with pytest.raises(LinkUnplugged):
                link.read(1.0)
        with pytest.raises(LinkError):
            open_link(end.address)
    finally:
        server.close()


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
    with EmulatedDevices({"a": on("bytes", Recorder(0.01))}, time="real") as devices:
        port = devices.addresses["a"].removeprefix("serial://").partition("?")[0]
        devices.advance(100_000_000)
        for _ in range(2):
            with serial.Serial(port, 115200, timeout=5.0) as host:
                assert len(host.read(6)) == 6


@needs_pty
def test_what_an_emulator_raises_unplugs_the_devices_and_is_raised():
    class Broken(Answerer):
        def feed(self, piece, now_s):
            raise ZeroDivisionError("a model that is wrong")

    devices = EmulatedDevices({"a": on("bytes", Broken())}, time="real")
    with devices.open_link("a") as link:
        link.write(b"x")
        with pytest.raises(LinkUnplugged):
            link.read(5.0)
    with pytest.raises(ZeroDivisionError):
        devices.advance(0)
    devices.close()
    devices.close()


def test_ending_gives_everything_back():
    descriptors = Path("/proc/self/fd")
    if not descriptors.is_dir():
        pytest.skip("this system does not list a process's open files")

    def use():
        models = {kind: on(kind, Complement() if kind == "spi" else Answerer()) for kind in ("bytes", "can", "spi")}
        with EmulatedDevices({"udp": on("datagram", Answerer()), **models}, time="real") as devices:
            for name in devices.addresses:
                devices.open_link(name).close()

    use()  # what libraries open once
    before = len(list(descriptors.iterdir()))
    use()
    assert len(list(descriptors.iterdir())) == before
