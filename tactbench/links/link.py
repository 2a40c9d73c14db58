"""Links for byte streams and datagrams, and the base class of all links.

The constructor of a link opens it, and it is closed once. Each kind of failure has an error class of its own.
"""

from __future__ import annotations

import errno
import io
import math
import selectors
import socket
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from typing import Any, Literal, Self

from tactbench.core.errors import LinkClosed, LinkError, LinkTimeout, LinkUnplugged

try:
    import termios

    SYSTEM_ERRORS: tuple[type[Exception], ...] = (OSError, termios.error)
except ImportError:  # Windows has none
    SYSTEM_ERRORS = (OSError,)
"""Error classes of the system; `termios.error` is no OSError, and comes through pyserial when a port disappears."""
_NOT_OPENED: tuple[type[Exception], ...] = (*SYSTEM_ERRORS, ValueError)  # pyserial's own are OSErrors

Clock = Callable[[], int]
"""Function that returns the nanoseconds of a clock that never goes back, like :func:`time.monotonic_ns`."""

WRITE_TIMEOUT_S = 1.0
"""Longest wait until the other end takes written data [s] (assumed; 9600 baud carry 960 bytes in 1 s)."""

LARGEST_DATAGRAM = 65507
"""Largest payload [bytes]: 65535 of an IPv4 packet less its header of 20 and UDP's of 8 (RFC 791, RFC 768)."""
BUFFER_BYTES = 4 << 20
"""Requested size of the system's buffer [bytes]; the real one may be smaller. The usual 212 992 hold 256 datagrams of
36 bytes, a quarter of a second at 1 kHz (measured on Linux); datagrams that do not fit are lost without an error."""

MOST_AT_ONCE = 4096
"""Largest number of pieces that :meth:`Link.receive_all` returns, 4 s at 1 kHz, even if a bus is never idle."""


@dataclass(frozen=True, slots=True)
class Received:
    """Bytes received, and the time of receipt of the first byte."""

    data: bytes
    t_ns: int
    """Time of receipt [ns of the link's clock]."""


class Link(ABC):
    """A connection to a device, open from its creation until :meth:`close` or the end of its ``with`` block.

    Only one thread may use a link. Timeouts are measured by :meth:`timer`; a read with timeout 0 returns at once.
    Every read and write raises LinkTimeout if nothing was received or taken in time (:data:`WRITE_TIMEOUT_S` for
    writes), LinkUnplugged if device or other end is gone, LinkClosed if the link was closed, and LinkError otherwise.

    Parameters
    ----------
    address
        Name of the link in messages.
    clock
        Function that returns the times of receipt [ns].
    """

    silence_hint = "Check that the device is on, started and set to the same speed, or wait longer."

    def __init__(self, address: str, clock: Clock = time.monotonic_ns) -> None:
        self.address = address
        self._clock = clock
        self._closed = False
        self._loss: BaseException | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the link, also an unplugged one; on a closed link, do nothing."""
        if not self._closed:
            self._closed = True
            self._release()

    def timer(self) -> float:
        """Return the time by which timeouts are measured [s]: real time, or virtual time of an emulation."""
        return time.monotonic()

    def receive_all(self, timeout_s: float) -> list[Any]:
        """Return all pieces received, waiting at most `timeout_s` for the first; an empty list if none is received.

        Raises the errors of a read except LinkTimeout; pieces received before unplugging are returned first.
        """
        found: list[Any] = []
        with suppress(LinkTimeout):
            while len(found) < MOST_AT_ONCE:
                try:
                    found.append(self.receive(0.0 if found else timeout_s))
                except LinkUnplugged:
                    if not found:
                        raise
                    break
        return found

    def discard(self) -> None:
        """Drop all pieces received so far, but not pieces still under way; raises the errors of a read."""
        self.receive_all(0.0)

    @abstractmethod
    def receive(self, timeout_s: float) -> Any:
        """Return the next piece received, waiting for it at most `timeout_s`."""

    def _sendable(self, piece: Any) -> None:
        """Raise LinkError for a link that is closed or unplugged, and for a piece that cannot be sent."""
        self._usable()

    @abstractmethod
    def _release(self) -> None:
        """Release the link's resources, also after the other end is gone; called once, and must not raise."""

    def _usable(self, timeout_s: float = 0.0) -> float:
        """Return the end of a wait of `timeout_s`, in seconds of :meth:`timer`; raises the errors of every link."""
        if self._closed:
            raise LinkClosed(f"The link {self.address} is closed.", hint="Open a new link.")
        if self._loss is not None:
            raise self._unplugged(self._loss)
        if not 0 <= timeout_s < math.inf:
            raise LinkError(
                f"{self.address}: the timeout is {timeout_s} s; a finite timeout of 0 s or more was expected.",
                hint="Use 0 to return at once.",
            )
        return self.timer() + timeout_s

    def _unplugged(self, cause: BaseException) -> LinkUnplugged:
        self._loss = cause
        return LinkUnplugged(
            f"The other end of {self.address} is gone: {cause}.",
            hint="Check cable, power and other end, close this link and open a new link.",
        )

    def _nothing_came(self, timeout_s: float) -> LinkTimeout:
        return LinkTimeout(
            f"Nothing was received from {self.address} within {timeout_s:g} s.",
            hint=self.silence_hint,
        )

    def _not_sent(self, cause: BaseException) -> LinkTimeout:
        return LinkTimeout(
            f"{self.address} did not take all data within {WRITE_TIMEOUT_S:g} s ({cause}); part may have been sent.",
            hint="Check that the other end reads or, on CAN, that another node acknowledges frames.",
        )


_HINTS = {
    errno.ENOENT: "Check the name and the cable; `python -m serial.tools.list_ports` lists serial ports.",
    errno.EACCES: "Your user may not open the device: join the group that owns it (often dialout) and log in again.",
    errno.EAGAIN: "Another program has the device open: end that program.",
    errno.EBUSY: "Another program has the device open: end that program.",
    errno.EADDRINUSE: "Another program uses this local port: end that program, or choose another port.",
    errno.EAFNOSUPPORT: "This machine's kernel lacks this kind of network; CAN needs Linux with CONFIG_CAN.",
    errno.ENODEV: "There is no such network interface; `ip link` lists all interfaces.",
    errno.ECONNREFUSED: "No program listens at this host and port: check both, and that the device is on.",
}


def os_error_in(error: BaseException) -> OSError | None:
    """Return the system's error that is, or caused, `error`: the innermost one with an error number, if any has one."""
    found: OSError | None = None
    cause: BaseException | None = error
    while cause is not None:
        if isinstance(cause, SYSTEM_ERRORS):
            own = cause if isinstance(cause, OSError) else OSError(*cause.args)
            found = own if found is None or own.errno is not None else found
        cause = cause.__cause__ or cause.__context__
    return found


def cannot_open(address: str, error: BaseException, *, hint: str = "") -> LinkError:
    """Return the error for a link that cannot be opened, with a hint for the system's reason."""
    reason = os_error_in(error)
    number = reason.errno if reason is not None and reason.errno is not None else 0
    return LinkError(f"{address} cannot be opened: {error}.", hint=hint or _HINTS.get(number, "Check its address."))


class ByteLink(Link):
    """Link for a byte stream in both directions: a :class:`SerialLink`, or the link of an emulated device."""

    silence_hint = f"{Link.silence_hint} Many boards start anew when their port is opened (DTR), and need some seconds."

    def receive(self, timeout_s: float) -> Received:
        """Return all bytes received, like :meth:`read`."""
        return self.read(timeout_s)

    @abstractmethod
    def read(self, timeout_s: float) -> Received:
        """Wait for the first byte and return all bytes received; raises the errors of every :class:`Link`."""

    @abstractmethod
    def write(self, data: bytes) -> None:
        """Send all bytes of `data`; raises the errors of every :class:`Link`."""


class SerialLink(ByteLink):
    """A byte stream opened by pyserial: a serial port, a pseudo-terminal or a TCP socket.

    Parameters
    ----------
    port
        A device (``/dev/ttyUSB0``, ``COM3``) or a URL of pyserial (``socket://host:port``, ``spy:///dev/ttyUSB0``,
        ``loop://``). A device is opened exclusively.
    baud
        Bits per second, start and stop bits included.
    parity, stop_bits
        Parity and number of stop bits of each byte, which has eight data bits.
    clock
        Function that returns the times of receipt [ns].

    Raises
    ------
    LinkError
        If the port cannot be opened.
    """

    def __init__(
        self,
        port: str,
        *,
        baud: int = 115200,
        parity: Literal["none", "even", "odd"] = "none",
        stop_bits: int = 1,
        clock: Clock = time.monotonic_ns,
    ) -> None:
        import serial

        super().__init__(port, clock)
        try:
            self._port = serial.serial_for_url(
                port,
                baudrate=baud,
                parity=parity[0].upper(),
                stopbits=stop_bits,
                timeout=0,
                write_timeout=WRITE_TIMEOUT_S,
                exclusive=True,
            )
        except _NOT_OPENED as error:
            raise cannot_open(port, error) from error
        # Waiting for the file descriptor gives the earliest stamp, and does not touch the port's settings: pyserial
        # sets all of them anew for each change of its timeout. Windows' ports and loop have no descriptor.
        self._ready: selectors.BaseSelector | None = None
        try:
            descriptor = self._port.fileno()
        except (io.UnsupportedOperation, AttributeError):
            return
        self._ready = selectors.DefaultSelector()
        self._ready.register(descriptor, selectors.EVENT_READ)

    def read(self, timeout_s: float) -> Received:  # noqa: D102  (inherited)
        deadline = self._usable(timeout_s)
        left_s = timeout_s
        try:
            while True:
                if self._ready is None:
                    self._port.timeout = left_s
                    data = self._port.read(1)
                    t_ns = self._clock()
                    if data:
                        data += self._port.read(self._port.in_waiting)
                else:
                    self._ready.select(left_s)
                    t_ns = self._clock()
                    data = self._port.read(65536)
                if data:
                    return Received(data, t_ns)
                left_s = deadline - self.timer()
                if left_s <= 0:
                    raise self._nothing_came(timeout_s)
        except SYSTEM_ERRORS as error:
            raise self._unplugged(error) from error

    def write(self, data: bytes) -> None:  # noqa: D102  (inherited)
        from serial import SerialTimeoutException

        self._usable()
        try:
            self._port.write(data)
        except SerialTimeoutException as error:
            raise self._not_sent(error) from error
        except SYSTEM_ERRORS as error:
            raise self._unplugged(error) from error

    def _release(self) -> None:
        if self._ready is not None:
            self._ready.close()
        inner = getattr(self._port, "_socket", None)
        with suppress(*SYSTEM_ERRORS):
            self._port.close()
        if inner is not None:  # pyserial forgets to close a socket that the other end has reset
            inner.close()


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
