"""Links for datagrams, over UDP or to an emulated device."""

from __future__ import annotations

import socket
import time
from abc import abstractmethod
from contextlib import ExitStack

from tactbench.links.link import WRITE_TIMEOUT_S, Clock, Link, Received, cannot_open

LARGEST_DATAGRAM = 65507
"""Largest payload [bytes]: 65535 of an IPv4 packet less its header of 20 and UDP's of 8 (RFC 791, RFC 768)."""
BUFFER_BYTES = 4 << 20
"""Requested size of the system's buffer [bytes]; the real one may be smaller. The usual 212 992 hold 256 datagrams of
36 bytes, a quarter of a second at 1 kHz (measured on Linux); datagrams that do not fit are lost without an error."""


class DatagramLink(Link):
    """Link for datagrams to and from one peer: a :class:`UdpLink`, or the link of an emulated device."""

    @abstractmethod
    def receive(self, timeout_s: float) -> Received:
        """Return the next datagram, whole; raises the errors of every :class:`Link`.

        Raises LinkUnplugged if the peer's host reports that its port is closed.
        """

    @abstractmethod
    def send(self, data: bytes) -> None:
        """Send one datagram; raises the errors of every :class:`Link`."""


class UdpLink(DatagramLink):
    """Datagrams to and from one peer over UDP; datagrams from other hosts are not received.

    Parameters
    ----------
    host, port
        Host name or address of the peer, and its UDP port.
    clock
        Function that returns the times of receipt [ns].

    Raises
    ------
    LinkError
        If no address is found for the host.
    """

    def __init__(self, host: str, port: int, *, clock: Clock = time.monotonic_ns) -> None:
        super().__init__(f"udp://{f'[{host}]' if ':' in host else host}:{port}", clock)
        try:
            family, kind, protocol, _, peer = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
            with ExitStack() as opening:
                self._socket = opening.enter_context(socket.socket(family, kind, protocol))
                self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER_BYTES)
                self._socket.connect(peer)
                opening.pop_all()
        except OSError as error:
            raise cannot_open(self.address, error) from error

    def receive(self, timeout_s: float) -> Received:  # noqa: D102  (inherited)
        self._usable(timeout_s)
        try:
            self._socket.settimeout(timeout_s)
            data = self._socket.recv(LARGEST_DATAGRAM)
            return Received(data, self._clock())
        except (TimeoutError, BlockingIOError):
            raise self._nothing_came(timeout_s) from None
        except OSError as error:
            raise self._unplugged(error) from error

    def send(self, data: bytes) -> None:  # noqa: D102  (inherited)
        self._sendable(data)
        try:
            self._socket.settimeout(WRITE_TIMEOUT_S)
            self._socket.send(data)
        except TimeoutError as error:
            raise self._not_sent(error) from error
        except OSError as error:
            raise self._unplugged(error) from error

    def _release(self) -> None:
        self._socket.close()
