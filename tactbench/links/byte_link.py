"""Links for byte streams: serial ports, pseudo-terminals, TCP sockets and other URLs of pyserial."""

from __future__ import annotations

import io
import selectors
import time
from abc import abstractmethod
from contextlib import suppress
from typing import Literal

from tactbench.links.link import SYSTEM_ERRORS, WRITE_TIMEOUT_S, Clock, Link, Received, cannot_open

Parity = Literal["none", "even", "odd"]
_NOT_OPENED: tuple[type[Exception], ...] = (*SYSTEM_ERRORS, ValueError)  # pyserial's own are OSErrors
_PARITY = {"none": "N", "even": "E", "odd": "O"}


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
        parity: Parity = "none",
        stop_bits: int = 1,
        clock: Clock = time.monotonic_ns,
    ) -> None:
        import serial

        super().__init__(port, clock)
        try:
            self._port = serial.serial_for_url(
                port,
                baudrate=baud,
                parity=_PARITY[parity],
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
