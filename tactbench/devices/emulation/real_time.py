"""Emulated devices on links of the system, in real time: pseudo-terminals, UDP on loopback, buses of python-can."""

from __future__ import annotations

import math
import os
import selectors
import socket
import threading
import uuid
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Mapping
from contextlib import ExitStack, suppress
from typing import Literal

from tactbench.core.errors import LinkError, LinkTimeout, UsageError
from tactbench.devices.emulation.line import Line, Piece
from tactbench.links.can_link import CanFrame, CanLink
from tactbench.links.datagram_link import LARGEST_DATAGRAM
from tactbench.links.link import Clock

CanTransport = Literal["slcan", "virtual", "udp_multicast"]
"""How an emulated CAN device is reached: an emulated adapter on a pseudo-terminal, python-can's bus within the process,
or its bus between processes."""

_LOOK_S = 1e-3
"""How often a bus without a file descriptor is looked at; a bus at 1 Mbit/s carries eight frames meanwhile."""


class End(ABC):
    """A link of the system, as the emulated device holds it."""

    address: str
    """What the host opens."""

    def fileno(self) -> int | None:
        """Return what becomes readable when something comes; None: it has to be asked."""
        return None

    @abstractmethod
    def received(self) -> list[Piece]:
        """Return what has come, without waiting."""

    @abstractmethod
    def send(self, t_s: float, piece: Piece) -> None:
        """Send to the host; what the system does not take at once is lost, as on a line that nobody reads."""

    @abstractmethod
    def close(self) -> None:
        """Give the link back to the system; the host sees it gone, where its kind of link can show that."""


class PseudoTerminal(End):
    """A serial line: its address is that of the terminal, which stays while hosts open and close it.

    Parameters
    ----------
    pattern
        The address, with ``{}`` for the terminal.
    """

    def __init__(self, pattern: str) -> None:
        if os.name != "posix":
            raise UsageError(
                "This system has no pseudo-terminals: emulated devices on serial lines cannot run in real time here.",
                hint="Use virtual time, or a system such as Linux.",
            )
        import tty

        self._master, self._slave = os.openpty()
        # Before a host opens it and sets it up, a terminal would echo what the device sends.
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.address = pattern.format(os.ttyname(self._slave))

    def fileno(self) -> int:  # noqa: D102  (inherited)
        return self._master

    def received(self) -> list[Piece]:  # noqa: D102  (inherited)
        with suppress(BlockingIOError):
            return [os.read(self._master, 65536)]
        return []

    def send(self, t_s: float, piece: Piece) -> None:  # noqa: D102  (inherited)
        assert isinstance(piece, bytes)
        with suppress(BlockingIOError):
            os.write(self._master, piece)

    def close(self) -> None:  # noqa: D102  (inherited)
        os.close(self._master)
        os.close(self._slave)


class UdpEnd(End):
    """A UDP port on loopback; datagrams go to whom the last one came from."""

    def __init__(self) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.setblocking(False)
        self._host: tuple[str, int] | None = None
        self.address = f"udp://127.0.0.1:{self._socket.getsockname()[1]}"

    def fileno(self) -> int:  # noqa: D102  (inherited)
        return self._socket.fileno()

    def received(self) -> list[Piece]:  # noqa: D102  (inherited)
        with suppress(OSError):  # nothing there, or the host's port is gone
            data, self._host = self._socket.recvfrom(LARGEST_DATAGRAM)
            return [data]
        return []

    def send(self, t_s: float, piece: Piece) -> None:  # noqa: D102  (inherited)
        assert isinstance(piece, bytes)
        if self._host is not None:
            with suppress(OSError):
                self._socket.sendto(piece, self._host)

    def close(self) -> None:  # noqa: D102  (inherited)
        self._socket.close()


class BusEnd(End):
    """A bus of python-can: a pulled device leaves it silent.

    Parameters
    ----------
    transport
        ``virtual`` or ``udp_multicast``.
    """

    def __init__(self, transport: CanTransport) -> None:
        from tactbench.links.address import open_link

        if transport == "virtual":
            self.address = f"can://virtual/emulated-{uuid.uuid4().hex[:8]}"
        else:
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
                free.bind(("", 0))
                self.address = f"can://udp_multicast/239.74.163.2?port={free.getsockname()[1]}"
        link = open_link(self.address)
        assert isinstance(link, CanLink)
        self._link = link
        # udp_multicast gives a sender its own frames back.
        self._echoes: Counter[tuple[int, bytes, bool]] | None = None if transport == "virtual" else Counter()

    def received(self) -> list[Piece]:  # noqa: D102  (inherited)
        frames: list[Piece] = []
        with suppress(LinkTimeout):
            while True:
                frame = self._link.receive(0)
                same = frame.id, frame.data, frame.extended
                if self._echoes is not None and self._echoes[same] > 0:
                    self._echoes[same] -= 1
                else:
                    frames.append(frame)
        return frames

    def send(self, t_s: float, piece: Piece) -> None:  # noqa: D102  (inherited)
        assert isinstance(piece, CanFrame)
        if self._echoes is not None:
            self._echoes[piece.id, piece.data, piece.extended] += 1
        with suppress(LinkError):
            self._link.send(piece)

    def close(self) -> None:  # noqa: D102  (inherited)
        self._link.close()


class RealTimeServer:
    """Carries what passes between emulated devices and links of the system, by a clock.

    Every piece has the time at which it is due, so that waits that end late delay it and nothing behind it.

    Parameters
    ----------
    served
        By device: its line, and the link of the system that it is on, which is closed with the server.
    clock
        Nanoseconds, from which the emulators' seconds are taken.
    """

    def __init__(self, served: Mapping[str, tuple[Line, End]], clock: Clock) -> None:
        self._clock = clock
        self._ends = ExitStack()
        self._open: dict[str, tuple[Line, End]] = {}
        # Waits to the microsecond; epoll's are rounded up to whole milliseconds.
        self._selector = self._ends.enter_context(selectors.SelectSelector())
        self._wake, self._woken = socket.socketpair()
        self._ends.enter_context(self._wake)
        self._ends.enter_context(self._woken)
        self._selector.register(self._woken, selectors.EVENT_READ)
        for name, (line, end) in served.items():
            line.deliver = end.send
            self._open[name] = line, end
            if (descriptor := end.fileno()) is not None:
                self._selector.register(descriptor, selectors.EVENT_READ)
        self._thread = threading.Thread(target=self._run, name="emulated devices", daemon=True)
        self._stop = False
        self.error: BaseException | None = None
        """What an emulator raised, which ended the service."""

    def start(self) -> None:
        """Serve in a thread of its own, until :meth:`close`."""
        self._thread.start()

    def close(self) -> None:
        """End the service and close the links."""
        self._stop = True
        if self._thread.is_alive():
            self._wake.send(b"x")
            self._thread.join()
        for name in list(self._open):
            self._unplug(name)
        self._ends.close()

    def serve(self, now_s: float) -> float:
        """Carry what has come and what is due at `now_s`; return when something is due next, infinite if nothing is."""
        for line, end in self._open.values():
            for piece in end.received():
                line.feed(piece, now_s)
            line.poll(now_s)
        for name in [name for name, (line, _) in self._open.items() if line.gone]:
            self._unplug(name)
        return min((line.next_s() for line, _ in self._open.values()), default=math.inf)

    def _unplug(self, name: str) -> None:
        line, end = self._open.pop(name)
        line.deliver = None
        if (descriptor := end.fileno()) is not None:
            self._selector.unregister(descriptor)
        end.close()

    def _run(self) -> None:
        try:
            while not self._stop:
                due_s = self.serve(self._clock() * 1e-9)
                wait_s = max(0.0, due_s - self._clock() * 1e-9)
                if any(end.fileno() is None for _, end in self._open.values()):
                    wait_s = min(wait_s, _LOOK_S)
                self._selector.select(None if wait_s == math.inf else wait_s)
        except BaseException as error:  # shown to whoever waits for the device
            self.error = error
            for name in list(self._open):
                self._unplug(name)
