"""Virtual time: a clock that advances only when a link waits, and the host's end of links to emulated devices."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace
from typing import Any

from tactbench.core.errors import LinkError
from tactbench.devices.emulation.line import Line, Piece
from tactbench.links.byte_link import ByteLink
from tactbench.links.can_link import CanFrame, CanLink
from tactbench.links.datagram_link import DatagramLink
from tactbench.links.link import Link, Received


class VirtualTime:
    """Clock of emulated devices, a :data:`~tactbench.links.link.Clock` from 0 on: single-threaded and deterministic.

    Attributes
    ----------
    now_s
        Present virtual time [s].
    lines
        Lines of the devices; simultaneous events happen in the order of this list.
    """

    def __init__(self) -> None:
        self.now_s = 0.0
        self.lines: list[Line] = []

    def __call__(self) -> int:
        """Return the virtual time [ns]."""
        return round(self.now_s * 1e9)

    def advance(self, until_ns: int) -> None:
        """Advance all devices up to and including `until_ns`; a past time changes nothing."""
        while self.step(until_ns * 1e-9):
            pass

    def step(self, until_s: float) -> bool:
        """Advance to the next event of a device and carry it out, or to `until_s` if that is earlier.

        Returns
        -------
        bool
            True if there was an event.
        """
        line = min(self.lines, key=Line.next_s, default=None)
        due_s = math.inf if line is None else line.next_s()
        if line is None or due_s > until_s:
            self.now_s = max(self.now_s, until_s)
            return False
        self.now_s = max(self.now_s, due_s)
        line.poll(self.now_s)
        return True


class _VirtualLink(Link):
    """The host's end of an emulated link: data reach the device at once, and waits advance virtual time."""

    def __init__(self, name: str, time: VirtualTime, line: Line) -> None:
        super().__init__(f"emulated {name}", time)
        if line.deliver is not None:
            raise LinkError(f"The link {self.address} is open already.", hint="Close the driver that opened it first.")
        self._time = time
        self._line = line
        self._arrived: deque[tuple[int, Piece]] = deque()
        line.deliver = self._arrive

    def timer(self) -> float:
        """Return the virtual time [s]."""
        return self._time.now_s

    def _arrive(self, t_s: float, piece: Piece) -> None:
        self._arrived.append((round(t_s * 1e9), piece))

    def receive(self, timeout_s: float) -> Any:
        until_s = self._usable(timeout_s)
        while not self._arrived:
            self._plugged()
            if not self._time.step(until_s):
                raise self._nothing_came(timeout_s)
        t_ns, piece = self._arrived.popleft()
        return replace(piece, t_ns=t_ns) if isinstance(piece, CanFrame) else Received(piece, t_ns)

    def send(self, piece: Any) -> None:
        """Send data to the device; raises LinkUnplugged if a fault has unplugged the link."""
        self._sendable(piece)
        self._plugged()
        self._line.feed(piece, self._time.now_s)

    def _plugged(self) -> None:
        if self._line.gone:
            raise self._unplugged(ConnectionError("unplugged by a fault of the emulated link"))

    def _release(self) -> None:
        self._line.deliver = None


class VirtualByteLink(_VirtualLink, ByteLink):
    """A byte stream in virtual time; a read returns the bytes of one piece, with its time of receipt."""

    def read(self, timeout_s: float) -> Received:  # noqa: D102  (inherited)
        received: Received = self.receive(timeout_s)
        return received

    def write(self, data: bytes) -> None:  # noqa: D102  (inherited)
        self.send(bytes(data))


class VirtualCanLink(_VirtualLink, CanLink):
    """A CAN bus in virtual time."""


class VirtualDatagramLink(_VirtualLink, DatagramLink):
    """A datagram link in virtual time."""
