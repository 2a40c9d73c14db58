"""CAN: buses of python-can, and its logs."""

from __future__ import annotations

import errno
import importlib
import inspect
import time
from abc import abstractmethod
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tactbench.core.errors import LinkError, UnknownNameError
from tactbench.links.link import WRITE_TIMEOUT_S, Clock, Link, cannot_open, os_error_in

OWN_TIME_S = 60.0
"""A stamp of python-can no older than this is of the system's clock; other stamps (of an adapter that counts from its
own start) are not taken. Assumed: nothing waits longer in a kernel's queue."""


@dataclass(frozen=True, slots=True)
class CanFrame:
    """A data frame."""

    id: int
    """11 bits, or 29 if `extended`."""
    data: bytes
    """At most 8 bytes."""
    extended: bool = False
    t_ns: int = 0
    """When the kernel or the adapter had it, nanoseconds of the link's clock; of a log: since its first. Not sent."""


class CanLink(Link):
    """Frames to and from a CAN bus: a :class:`CanBus`, or an emulated device's.

    Attributes
    ----------
    counts
        How many were left out so far: ``error frames``, ``remote and FD frames``, ``unreadable frames``.
    """

    def __init__(self, address: str, clock: Clock = time.monotonic_ns) -> None:
        super().__init__(address, clock)
        self.counts: Counter[str] = Counter()

    @abstractmethod
    def receive(self, timeout_s: float) -> CanFrame:
        """Return the next data frame; raises as every :class:`Link`."""

    @abstractmethod
    def send(self, frame: CanFrame) -> None:
        """Send a data frame; raises as every :class:`Link`, LinkTimeout also where no node acknowledges."""

    def _sendable(self, frame: CanFrame) -> None:
        super()._sendable(frame)
        if not 0 <= frame.id < 1 << (29 if frame.extended else 11) or len(frame.data) > 8:
            raise LinkError(
                f"{self.address}: {frame} is not a CAN frame.",
                hint="An identifier has 11 bits (29 if extended), the data at most 8 bytes.",
            )


def _data_frame(message: Any, t_ns: int, counts: Counter[str]) -> CanFrame | None:
    if message.is_error_frame:
        counts["error frames"] += 1
    elif message.is_remote_frame or message.is_fd:
        counts["remote and FD frames"] += 1
    elif message.dlc != len(message.data):
        counts["unreadable frames"] += 1
    else:
        return CanFrame(message.arbitration_id, bytes(message.data), message.is_extended_id, t_ns)
    return None


class CanBus(CanLink):
    """A bus behind an interface of python-can.

    A frame's time is that of its ``Message.timestamp`` (of socketcan the kernel's) put on the link's clock, or that of
    its receipt where the interface gives none by the system's clock.

    Parameters
    ----------
    interface, channel
        As python-can names them: ``socketcan`` with ``can0``, ``pcan`` with ``PCAN_USBBUS1``, ``slcan`` with a port …
    clock
        Stamps what is received.
    options
        Of the interface, by python-can's names: ``bitrate``, ``tty_baudrate``, ``port`` …

    Raises
    ------
    LinkError
        If the interface cannot be opened.
    """

    def __init__(self, interface: str, channel: str, *, clock: Clock = time.monotonic_ns, **options: Any) -> None:
        import can

        super().__init__(f"can://{interface}/{channel}", clock)
        if interface == "udp_multicast":
            options.setdefault("fd", False)
        if interface == "socketcan":
            options.pop("bitrate", None)  # a statement: `ip link set` sets it
        try:
            module, name = can.interfaces.BACKENDS[interface]
            known = inspect.signature(getattr(importlib.import_module(module), name).__init__).parameters
            for option in options.keys() - known.keys() - {"bitrate"}:
                raise UnknownNameError(f"option of a can://{interface} link", option, list(known)[2:])
            self._bus: Any = can.Bus(channel, interface, ignore_config=True, **options)
        except (can.CanError, OSError, ValueError, TypeError, ImportError) as error:
            raise cannot_open(self.address, error, hint=_hint(interface, channel, error)) from error

    def receive(self, timeout_s: float) -> CanFrame:  # noqa: D102  (inherited)
        import can

        deadline = self._usable(timeout_s)
        left_s, came = timeout_s, True
        while came or left_s > 0:
            try:
                message = self._bus.recv(max(0.0, left_s))
                came = message is not None
                frame = _data_frame(message, self._stamp(message.timestamp), self.counts) if came else None
                if frame is not None:
                    return frame
            except (can.CanError, OSError, ValueError, IndexError) as error:
                if os_error_in(error) is not None:
                    raise self._unplugged(error) from error
                # Bytes that are no frame. python-can's slcan would try those that are not ASCII again and again; its
                # own flush() would drop the frames behind them as well.
                self.counts["unreadable frames"] += 1
                getattr(self._bus, "_buffer", bytearray()).clear()
            left_s = deadline - self.timer()
        raise self._nothing_came(timeout_s)

    def _stamp(self, timestamp: float) -> int:
        """Return when a message came by the link's clock, of python-can's seconds since 1970."""
        now_ns, age_s = self._clock(), time.time() - timestamp
        return now_ns - round(1e9 * age_s) if 0 <= age_s < OWN_TIME_S else now_ns

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


def read_can_log(file: Path) -> tuple[list[CanFrame], Counter[str]]:
    """Return the data frames of a log in any format of python-can, and what was left out (:class:`CanLink`).

    Stamps are nanoseconds since the log's first message. BLF stamps come within 0.25 us, since python-can returns
    float64.

    Parameters
    ----------
    file
        Ends in ``.log`` (candump), ``.asc``, ``.blf``, ``.csv``, ``.trc`` …

    Raises
    ------
    LinkError
        If the file cannot be read, is damaged, of another kind, or is an ASC file with times relative to the event
        before: events that are no frames carry part of the time, and python-can leaves them out.
    """
    import can

    counts: Counter[str] = Counter()
    frames: list[CanFrame] = []
    number, began_s = 0, None
    try:
        if file.suffix.lower() == ".asc" and b"timestamps relative" in b" ".join(file.read_bytes()[:4096].split()):
            raise ValueError("its times are relative to the event before; export it with absolute ones")
        with can.LogReader(file) as log:
            for number, message in enumerate(log, 1):  # noqa: B007  (said where it is damaged)
                began_s = message.timestamp if began_s is None else began_s
                frame = _data_frame(message, round((message.timestamp - began_s) * 1e9), counts)
                frames += [] if frame is None else [frame]
    except Exception as error:  # python-can's readers raise whatever their parsing runs into
        raise LinkError(
            f"The log {file} cannot be read after {number} frames: {error}.", hint="Export the log anew."
        ) from error
    return frames, counts


def _hint(interface: str, channel: str, error: BaseException) -> str:
    if interface == "slcan" and not channel.startswith("/"):
        return "A port begins with a slash of its own: can://slcan//dev/ttyACM0."
    if os_error_in(error) is not None:
        return ""
    return f"See python-can's page of the interface {interface} for its channels, options and what it needs."
