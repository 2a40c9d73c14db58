"""Devices in virtual time: who waits lets time go on, deadlines are virtual, and the same run gives the same bytes."""

from __future__ import annotations

import pytest

from tactbench.core.errors import LinkClosed, LinkError, LinkTimeout, LinkUnplugged
from tactbench.devices.emulation.virtual_time import EmulatedDevice, EmulatedDevices
from tactbench.devices.emulator import LinkFault
from tactbench.plugin.devices import ByteLink, CanFrame, CanLink, SpiLink, SpiStep
from tests.devices.emulation.models import Answerer, Complement, Recorder

MS = 1_000_000
"""Nanoseconds."""


def on(kind, emulator, *faults):
    return EmulatedDevice(kind, emulator, tuple(LinkFault.parse(fault) for fault in faults))


@pytest.fixture(params=["bytes", "can", "datagram", "spi"])
def kind(request):
    return request.param


def answering(kind, *faults):
    """A device that gives back what it is told 200 ms later; on SPI one that answers at once."""
    return on(kind, Complement() if kind == "spi" else Answerer(), *faults)


def say(link):
    if isinstance(link, ByteLink):
        link.write(b"ab")
    elif isinstance(link, CanLink):
        link.send(CanFrame(0x123, b"ab"))
    elif isinstance(link, SpiLink):
        link.send([SpiStep(b"ab", pause_us=60_000), SpiStep(b"", pause_us=60_000), SpiStep(b"", pause_us=60_000)])
    else:
        link.send(b"ab")


def test_an_answer_comes_with_its_own_time_and_waits_are_virtual(kind):
    with EmulatedDevices({"a": answering(kind)}) as devices, devices.open_link("a") as link:
        say(link)
        with pytest.raises(LinkTimeout, match=r"0\.1 s"):
            link.receive(0.1)
        assert devices.clock() == 100 * MS
        came = link.receive(5.0)
        # On SPI: 180 ms of pauses and 16 bits at 4.4 MHz.
        due_ns = 180 * MS + round(16e9 / 4.4e6) if kind == "spi" else 200 * MS
        assert came.t_ns == devices.clock() == due_ns
        with pytest.raises(LinkTimeout):
            link.receive(0.0)
        assert devices.clock() == due_ns


def test_a_closed_link_is_closed_and_may_be_opened_again(kind):
    with EmulatedDevices({"a": answering(kind)}) as devices:
        link = devices.open_link("a")
        with pytest.raises(LinkError, match="open already"):
            devices.open_link("a")
        link.close()
        link.close()
        for call in (lambda: link.receive(0.0), lambda: say(link)):
            with pytest.raises(LinkClosed):
                call()
        with devices.open_link("a") as again:
            say(again)
            assert again.receive(1.0).data


def test_an_unplugged_link_says_so_at_its_time_and_from_then_on(kind):
    with EmulatedDevices({"a": answering(kind, "unplug:start_s=1")}) as devices, devices.open_link("a") as link:
        say(link)
        assert link.receive(0.5).data
        with pytest.raises(LinkUnplugged, match="is gone"):
            link.receive(60.0)
        assert devices.clock() == 1000 * MS
        for call in (lambda: link.receive(0.0), lambda: say(link)):
            with pytest.raises(LinkUnplugged):
                call()
        link.close()
        with pytest.raises(LinkClosed):
            link.receive(0.0)


def test_everything_happens_in_order_of_time_whoever_is_waited_for():
    """While one device is waited for, the others go on: at each moment nobody is behind."""
    seen = []

    def sensing(name):
        def senses(t_s):
            seen.append((t_s, name))
            return {}

        return senses

    models = {"a": on("bytes", Recorder(0.01, sensing("a"))), "b": on("datagram", Recorder(0.003, sensing("b")))}
    with EmulatedDevices(models) as devices, devices.open_link("a") as a, devices.open_link("b") as b:
        assert a.read(1.0).t_ns == 10 * MS
        assert [b.receive(0.0).t_ns for _ in range(3)] == [3 * MS, 6 * MS, 9 * MS]
        devices.advance(100 * MS)
    assert seen == sorted(seen)
    assert len(seen) == 10 + 33
