"""CAN: buses of python-can."""

from __future__ import annotations

import errno
import time
from abc import abstractmethod
from dataclasses import dataclass
from typing import Any, Literal

from tactbench.core.errors import LinkError
from tactbench.links.link import WRITE_TIMEOUT_S, Clock, Link, cannot_open, os_error_in

Interface = Literal["socketcan", "slcan", "udp_multicast", "virtual"]


@dataclass(frozen=True, slots=True)
class CanFrame:
    """A data frame."""

    id: int
    """11 bits, or 29 if `extended`."""
    data: bytes
    """At most 8 bytes."""
    extended: bool = False
    t_ns: int = 0
    """When it was in the host, nanoseconds of the link's clock; of a log: since the log's start. Not sent."""


class CanLink(Link):
    """Frames to and from a CAN bus: a :class:`CanBus` or a :class:`~tactbench.links.can_log.CanLog`.

    Attributes
    ----------
    error_frames, other_frames, damaged
        How many error frames, remote and FD frames, and unreadable ones were left out so far.
    """

    def __init__(self, address: str, clock: Clock = time.monotonic_ns) -> None:
        super().__init__(address, clock)
        self.error_frames = 0
        self.other_frames = 0
        self.damaged = 0

    @abstractmethod
    def receive(self, timeout_s: float) -> CanFrame:
        """Return the next data frame.

        Parameters
        ----------
        timeout_s
            Seconds to wait; 0 asks without waiting.

        Raises
        ------
        LinkTimeout
            If none came.
        LinkUnplugged
            If the adapter or the network is gone.
        LinkClosed
            If the link was closed; :class:`LinkEnded` if a log is over.
        """

    @abstractmethod
    def send(self, frame: CanFrame) -> None:
        """Send a data frame.

        Raises
        ------
        LinkError
            If it is not a CAN frame, or a log would have to take it.
        LinkTimeout
            If the adapter does not take it within :data:`~tactbench.links.link.WRITE_TIMEOUT_S`, or the queue is full
            since no node acknowledges.
        LinkUnplugged, LinkClosed
            As of :meth:`receive`.
        """

    def _sendable(self, frame: CanFrame) -> None:
        """Raise what `send` raises of a link that is closed or unplugged, and of what is no CAN frame."""
        self._usable()
        if not 0 <= frame.id < 1 << (29 if frame.extended else 11) or len(frame.data) > 8:
            raise LinkError(
                f"{self.address}: {frame} is not a CAN frame.",
                hint="An identifier has 11 bits (29 if extended), the data at most 8 bytes.",
            )

    def _data_frame(self, message: Any, t_ns: int) -> CanFrame | None:
        """Return python-can's `message` as a frame, or count it and return None."""
        if message.is_error_frame:
            self.error_frames += 1
        elif message.is_remote_frame or message.is_fd:
            self.other_frames += 1
        elif message.dlc != len(message.data):
            self.damaged += 1
        else:
            return CanFrame(message.arbitration_id, bytes(message.data), message.is_extended_id, t_ns)
        return None


class CanBus(CanLink):
    """A bus behind an interface of python-can.

    Parameters
    ----------
    interface, channel
        ``socketcan`` with the network's name (``can0``); ``slcan`` with the adapter's port; ``udp_multicast`` with a
        multicast address, between processes and machines; ``virtual`` with any name, within one process.
    bitrate
        Bits per second. An slcan adapter is set to it. Of socketcan it is only a statement: ``ip link set can0 type
        can bitrate 1000000`` sets it.
    baud
        Of the slcan adapter's port, bits per second.
    settle_s
        Seconds that an slcan adapter needs after its port was opened: many start anew then.
    port
        UDP port of udp_multicast.
    clock
        Stamps what is received.

    Raises
    ------
    LinkError
        If the interface cannot be opened.
    """

    def __init__(
        self,
        interface: Interface,
        channel: str,
        *,
        bitrate: int | None = None,
        baud: int = 115200,
        settle_s: float = 2.0,
        port: int = 43113,
        clock: Clock = time.monotonic_ns,
    ) -> None:
        import can

        super().__init__(f"can://{interface}/{channel}", clock)
        options: dict[str, Any] = {}
        if interface == "slcan":
            options = {"bitrate": bitrate, "tty_baudrate": baud, "sleep_after_open": settle_s}
        elif interface == "udp_multicast":
            options = {"port": port, "fd": False}
        try:
            self._bus: Any = can.Bus(channel, interface, ignore_config=True, **options)
        except (can.CanError, OSError, ValueError) as error:
            raise cannot_open(self.address, error, hint=_hint(interface, channel, error)) from error

    def receive(self, timeout_s: float) -> CanFrame:  # noqa: D102  (inherited)
        import can

        deadline = self._usable(timeout_s)
        left_s = timeout_s
        while True:
            try:
                message = self._bus.recv(left_s)
                t_ns = self._clock()
                frame = None if message is None else self._data_frame(message, t_ns)
            except (can.CanError, OSError, ValueError, IndexError) as error:
                if os_error_in(error) is not None:
                    raise self._unplugged(error) from error
                # Bytes that are no frame. python-can's slcan would try those that are not ASCII again and again; its
                # own flush() would drop the frames behind them as well.
                self.damaged += 1
                if hasattr(self._bus, "_buffer"):
                    self._bus._buffer.clear()
                message = frame = None
            if frame is not None:
                return frame
            left_s = deadline - self.timer()
            if left_s <= 0:
                if message is None:
                    raise self._nothing_came(timeout_s)
                left_s = 0.0  # it was a frame of another kind: what lies behind it has come as well

    def send(self, frame: CanFrame) -> None:  # noqa: D102  (inherited)
        import can
        from serial import SerialTimeoutException

        self._sendable(frame)
        message = can.Message(
            arbitration_id=frame.id, data=frame.data, is_extended_id=frame.extended, is_rx=False, check=True
        )
        try:
            self._bus.send(message, WRITE_TIMEOUT_S)
        except can.CanTimeoutError as error:
            raise self._not_sent(error) from error
        except (can.CanError, OSError) as error:
            reason = os_error_in(error)
            if isinstance(reason, SerialTimeoutException) or (reason and reason.errno == errno.ENOBUFS):
                raise self._not_sent(error) from error
            raise self._unplugged(error) from error

    def _release(self) -> None:
        import can

        try:
            self._bus.shutdown()
        except (can.CanError, OSError):
            # slcan's says goodbye before it closes its port, to an adapter that may be gone.
            self._bus.serialPortOrig.close()


def _hint(interface: str, channel: str, error: BaseException) -> str:
    if "msgpack" in str(error):
        return "Install it: pip install 'tactbench[multicast]'."
    if interface == "slcan" and not channel.startswith("/"):
        return "A port begins with a slash of its own: can://slcan//dev/ttyACM0."
    return ""
