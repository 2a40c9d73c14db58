"""Byte streams on pseudo-terminals, sockets and pyserial's other URLs."""

from __future__ import annotations

import errno
import os
import threading

import can
import pytest

from tactbench.links.link import SerialLink
from tactbench.plugin.devices import CanFrame, LinkError, LinkTimeout, LinkUnplugged, open_link
from tests.links.ends import pty

termios = pytest.importorskip("termios")
pytestmark = pytest.mark.skipif(os.name != "posix", reason="pseudo-terminals are POSIX")

ALL_BYTES = bytes(range(256))


@pytest.fixture
def far():
    with pty() as end:
        yield end


@pytest.mark.parametrize("way", ["read", "write", "close", "open"])
def test_an_error_of_the_terminal_is_the_links_own(far, monkeypatch, way):
    """It is no OSError, and pyserial lets it pass: a port that goes, or that is none."""

    def gone(*_, **__):
        raise termios.error(errno.EIO, "Input/output error")

    if way == "open":
        monkeypatch.setattr("serial.serial_for_url", gone)
        with pytest.raises(LinkError, match="opened"):
            SerialLink(far.name)
        return
    with SerialLink(far.name) as link:
        monkeypatch.setattr(link._port, way, gone)
        if way == "close":
            link.close()
            return
        with pytest.raises(LinkUnplugged, match="gone"):
            link.read(0.1) if way == "read" and not far.write(b"x") else link.write(b"x")


@pytest.mark.parametrize("way", ["recv", "send", "close"])
def test_so_it_is_behind_a_can_adapter(far, monkeypatch, way):
    def gone(*_, **__):
        try:
            raise termios.error(errno.EIO, "Input/output error")
        except termios.error as error:
            raise can.CanOperationError("Could not read from serial device") from error

    link = open_link(f"can://slcan/{far.name}?bitrate=1000000&sleep_after_open=0")
    monkeypatch.setattr(link._bus, way, gone)
    if way != "close":
        with pytest.raises(LinkUnplugged):
            link.receive(0.1) if way == "recv" else link.send(CanFrame(1, b"x"))
    link.close()


def test_every_byte_passes_unchanged_both_ways(far):
    with SerialLink(far.name) as link:
        link.write(ALL_BYTES)
        assert far.read_until(b"\xff") == ALL_BYTES
        far.write(ALL_BYTES)
        data = b""
        while len(data) < 256:
            data += link.read(2.0).data
        assert data == ALL_BYTES


def test_stamp_is_taken_when_the_first_byte_is_there(far):
    """Not when the wait began: the clock stands at 1 until the far end writes, and at 2 from then on."""
    now = [1]
    with SerialLink(far.name, clock=lambda: now[0]) as link:

        def write() -> None:
            now[0] = 2
            far.write(b"a")

        timer = threading.Timer(0.05, write)
        timer.start()
        assert link.read(5.0).t_ns == 2
        timer.join()


def test_a_port_is_opened_by_one_only(far):
    with SerialLink(far.name), pytest.raises(LinkError, match="Another program"):
        SerialLink(far.name)


def test_a_far_end_that_does_not_read_is_a_timeout(far):
    with SerialLink(far.name) as link, pytest.raises(LinkTimeout):
        link.write(bytes(1 << 20))  # a pseudo-terminal holds some ten thousand
