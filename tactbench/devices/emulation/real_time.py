"""Emulated devices in real time, on links of the operating system: pseudo-terminals, and UDP on loopback."""

from __future__ import annotations

import math
import os
import re
import selectors
import socket
import threading
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Self

from tactbench.core.errors import UsageError
from tactbench.devices.emulation.virtual_time import SPI_HZ, EmulatedDevice, Line, Piece
from tactbench.devices.emulator import DeviceEmulator, Sent
from tactbench.links.can_link import CanFrame
from tactbench.links.link import LARGEST_DATAGRAM

STOP_S = 0.05
"""Longest wait of a server without events [s], after which it checks for a request to end."""
_ADDRESSES = {
    "bytes": "serial://{}?baud=3000000",  # above the rate of any device; pseudo-terminals have none
    "spi": f"spi://bridge/{{}}?speed_hz={SPI_HZ}",
    "can": "can://slcan/{}?bitrate=1000000&sleep_after_open=0",  # nothing here restarts when its port is opened
}
"""Addresses of emulated devices' links, with ``{}`` in place of the terminal's path."""


class PseudoTerminal:
    """Emulated serial line on a pseudo-terminal, whose address stays the same while hosts open and close it.

    Parameters
    ----------
    pattern
        Address of the link, with ``{}`` in place of the terminal's path.
    """

    def __init__(self, pattern: str) -> None:
        if os.name != "posix":
            raise UsageError(
                "This system has no pseudo-terminals: emulated devices on serial lines cannot run in real time here.",
                hint="Use virtual time, or a system such as Linux.",
            )
        import tty

        self._master, self._slave = os.openpty()
        # Before a host opens it and sets it up, a terminal would echo the device's own bytes.
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.address = pattern.format(os.ttyname(self._slave))

    def fileno(self) -> int:
        """Return the file descriptor, which is readable when data have come."""
        return self._master

    def received(self) -> list[Piece]:
        """Return the pieces received."""
        with suppress(BlockingIOError):
            return [os.read(self._master, 65536)]
        return []

    def send(self, t_s: float, piece: Piece) -> None:
        """Send to the host; data that the system does not take at once are lost, as on a line without a reader."""
        assert isinstance(piece, bytes)
        with suppress(BlockingIOError):
            os.write(self._master, piece)

    def close(self) -> None:
        """Release the link."""
        os.close(self._master)
        os.close(self._slave)


class UdpEnd:
    """UDP port on loopback; datagrams are sent to the sender of the datagram received last."""

    def __init__(self) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.setblocking(False)
        self._host: tuple[str, int] | None = None
        self.address = f"udp://127.0.0.1:{self._socket.getsockname()[1]}"

    def fileno(self) -> int:
        """Return the file descriptor, which is readable when data have come."""
        return self._socket.fileno()

    def received(self) -> list[Piece]:
        """Return the pieces received."""
        with suppress(OSError):  # nothing there, or the host's port is gone
            data, self._host = self._socket.recvfrom(LARGEST_DATAGRAM)
            return [data]
        return []

    def send(self, t_s: float, piece: Piece) -> None:
        """Send to the host; data that the system does not take at once are lost, as on a line without a reader."""
        assert isinstance(piece, bytes)
        if self._host is not None:
            with suppress(OSError):
                self._socket.sendto(piece, self._host)

    def close(self) -> None:
        """Release the link."""
        self._socket.close()


class SlcanAdapter:
    """Emulated serial adapter (python-can's interface ``slcan``) of a CAN device: a line of text for each data frame.

    The adapter's commands ``O`` and ``L`` open it, ``C`` closes it; other commands are ignored, and no command is
    answered [sourced: LAWICEL AB, CANUSB manual; python-can waits for no answer].

    Parameters
    ----------
    device
        The device on the bus.
    """

    _FRAME = re.compile(rb"(?:t([0-9A-Fa-f]{3})|T([0-9A-Fa-f]{8}))[0-8]((?:[0-9A-Fa-f]{2}){0,8})")
    _LONGEST = 32

    def __init__(self, device: DeviceEmulator) -> None:
        self._device = device
        self._line = b""
        self._open = False

    def feed(self, piece: bytes | CanFrame, now_s: float) -> Sequence[Sent]:
        """Process bytes from the host; return the same as :meth:`poll`."""
        assert isinstance(piece, bytes)
        sent = list(self._device.poll(now_s))
        *lines, rest = (self._line + piece).split(b"\r")
        self._line = rest[-self._LONGEST :]
        for line in lines:
            found = self._FRAME.fullmatch(line)
            if line in (b"O", b"L", b"C"):
                self._open = line != b"C"
            elif self._open and found is not None:
                short, extended, data = found.groups()
                frame = CanFrame(int(short or extended, 16), bytes.fromhex(data.decode()), short is None)
                sent += self._device.feed(frame, now_s)
        return self._texts(sent)

    def poll(self, now_s: float) -> Sequence[Sent]:
        """Return the frames sent on the bus until `now_s` as text; no frames while the adapter is closed."""
        return self._texts(self._device.poll(now_s))

    def next_s(self) -> float:
        """Return the time of the device's next event [s]."""
        return self._device.next_s()

    def _texts(self, sent: Sequence[Sent]) -> list[Sent]:
        frames = [(t_s, frame) for t_s, frame in sent if isinstance(frame, CanFrame) and self._open]
        heads = [f"T{frame.id:08X}" if frame.extended else f"t{frame.id:03X}" for _, frame in frames]
        return [
            (t_s, f"{head}{len(frame.data)}{frame.data.hex().upper()}\r".encode())
            for head, (t_s, frame) in zip(heads, frames, strict=True)
        ]


class RealTimeDevices:
    """Emulated devices served in a thread of their own, on links that other processes may open, until :meth:`close`.

    Every piece of data has its own due time, so that a wait that ends late delays this piece, but no later piece.

    Parameters
    ----------
    devices
        Devices by name.

    Attributes
    ----------
    addresses
        Link address by device name, for a rig file.

    Raises
    ------
    UsageError
        If this operating system lacks the needed kind of link.
    """

    def __init__(self, devices: Mapping[str, EmulatedDevice]) -> None:
        self._began_ns = time.monotonic_ns()
        self._open: dict[str, tuple[Line, PseudoTerminal | UdpEnd]] = {}
        self._stop = False
        self._error: BaseException | None = None
        # Waits to the microsecond; epoll's are rounded up to whole milliseconds.
        self._selector = selectors.SelectSelector()
        for name, device in devices.items():
            emulator = device.far_end()
            line = Line(SlcanAdapter(emulator) if device.link == "can" else emulator, device.faults)
            end = UdpEnd() if device.link == "datagram" else PseudoTerminal(_ADDRESSES[device.link])
            line.deliver = end.send
            self._selector.register(end.fileno(), selectors.EVENT_READ)
            self._open[name] = line, end
        self.addresses = {name: end.address for name, (_, end) in self._open.items()}
        self._thread = threading.Thread(target=self._run, name="emulated devices", daemon=True)
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def clock(self) -> int:
        """Return the nanoseconds since the devices began; emulators, faults and senses use this time in seconds."""
        return time.monotonic_ns() - self._began_ns

    def check(self) -> None:
        """Raise the error of an emulator that has ended the service."""
        if self._error is not None:
            raise self._error

    def close(self) -> None:
        """End the devices and release the operating system's links; a second call does nothing."""
        self._stop = True
        self._thread.join()
        self._selector.close()

    def _run(self) -> None:
        try:
            while not self._stop:
                wait_s = self._serve() - self.clock() * 1e-9
                self._selector.select(min(max(0.0, wait_s), STOP_S))
        except BaseException as error:  # raised by `check`
            self._error = error
        for name in list(self._open):
            self._unplug(name)

    def _serve(self) -> float:
        """Transfer the data received and due; return the time of the next event [s], or infinity."""
        for name, (line, end) in list(self._open.items()):
            pieces = end.received()
            now_s = self.clock() * 1e-9  # not before the pieces were received
            for piece in pieces:
                line.feed(piece, now_s)
            line.poll(now_s)
            if line.gone:
                self._unplug(name)
        return min((line.next_s() for line, _ in self._open.values()), default=math.inf)

    def _unplug(self, name: str) -> None:
        line, end = self._open.pop(name)
        line.deliver = None
        self._selector.unregister(end.fileno())
        end.close()
