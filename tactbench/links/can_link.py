"""CAN: buses of python-can, and logs (Vector's ASC and BLF) that are read like one."""

from __future__ import annotations

import errno
import importlib
import inspect
import struct
import time
import zlib
from abc import abstractmethod
from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import islice
from pathlib import Path
from typing import Any

from tactbench.core.errors import LinkEnded, LinkError, UnknownNameError
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
    """When the kernel or the adapter had it, nanoseconds of the link's clock; of a log: since its start. Not sent."""


class CanLink(Link):
    """Frames to and from a CAN bus: a :class:`CanBus` or a :class:`CanLog`.

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

    def _take(self, timeout_s: float) -> CanFrame:
        return self.receive(timeout_s)

    @abstractmethod
    def receive(self, timeout_s: float) -> CanFrame:
        """Return the next data frame; raises as every :class:`Link`, LinkEnded if a log is over."""

    @abstractmethod
    def send(self, frame: CanFrame) -> None:
        """Send a data frame; raises as every :class:`Link`, LinkTimeout also where no node acknowledges."""

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
        left_s = timeout_s
        while True:
            try:
                message = self._bus.recv(left_s)
                frame = None if message is None else self._data_frame(message, self._stamp(message.timestamp))
            except (can.CanError, OSError, ValueError, IndexError) as error:
                if os_error_in(error) is not None:
                    raise self._unplugged(error) from error
                # Bytes that are no frame. python-can's slcan would try those that are not ASCII again and again; its
                # own flush() would drop the frames behind them as well.
                self.damaged += 1
                getattr(self._bus, "_buffer", bytearray()).clear()
                message = frame = None
            if frame is not None:
                return frame
            left_s = deadline - self.timer()
            if left_s <= 0:
                if message is None:
                    raise self._nothing_came(timeout_s)
                left_s = 0.0  # it was a frame of another kind: what lies behind it has come as well

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


class CanLog(CanLink):
    """A log: its frames one after the other, without waiting, stamped with the log's own times.

    Stamps count from the log's start, which both formats keep: an ASC file's date has no time zone, a BLF file that was
    written with times before 1990 has no date. BLF stamps come within 0.25 us, since python-can returns float64.

    Parameters
    ----------
    file
        Ends in ``.asc`` or ``.blf``.

    Attributes
    ----------
    started
        The log's start as the file states it: ASC in the writer's local time, BLF in ISO 8601 as UTC; empty if it
        does not.
    backward
        How many frames so far have an earlier stamp than the one before them; they are returned as they are.

    Raises
    ------
    LinkError
        If the file cannot be read, is of another kind, or is an ASC file with times relative to the event before:
        events that are no frames carry part of the time, and python-can leaves them out.
    """

    def __init__(self, file: Path) -> None:
        import can
        from can.io.blf import BLFParseError

        super().__init__(f"can://log/{file}")
        self.backward = 0
        self._last_ns = 0
        self._count = 0
        self._start_s = 0.0
        if file.suffix.lower() not in (".asc", ".blf"):
            raise LinkError(f"{file} is not a log that can be read.", hint="Give a file that ends in .asc or .blf.")
        with ExitStack() as opened:
            try:
                if file.suffix.lower() == ".asc":
                    text = opened.enter_context(file.open(encoding="utf-8", errors="replace"))
                    self.started = _asc_start(self.address, text)
                    text.seek(0)
                    self._reader: Any = can.ASCReader(text, relative_timestamp=True)
                else:
                    self._reader = can.BLFReader(opened.enter_context(file.open("rb")))
                    self._start_s = self._reader.start_timestamp
                    self.started = datetime.fromtimestamp(self._start_s, UTC).isoformat() if self._start_s else ""
            except (OSError, ValueError, BLFParseError, struct.error) as error:
                raise cannot_open(self.address, error) from error
            self._file = opened.pop_all()
        self._messages: Iterator[Any] = iter(self._reader)

    def receive(self, timeout_s: float) -> CanFrame:
        """Return the next data frame at once; raises LinkEnded if the log is over, LinkError if it is damaged."""
        from can.io.blf import BLFParseError

        self._usable(timeout_s)
        while True:
            try:
                message = next(self._messages)
            except StopIteration:
                raise LinkEnded(f"The log {self.address} is over after {self._count} frames.") from None
            except (ValueError, LookupError, OSError, BLFParseError, struct.error, zlib.error) as error:
                raise LinkError(
                    f"The log {self.address} is damaged after {self._count} frames: {error}.",
                    hint="Use the frames before, or export the log anew.",
                ) from error
            self._count += 1
            t_ns = round((message.timestamp - self._start_s) * 1e9)
            self.backward += t_ns < self._last_ns
            self._last_ns = t_ns
            frame = self._data_frame(message, t_ns)
            if frame is not None:
                return frame

    def send(self, frame: CanFrame) -> None:
        """Raise LinkError: a log takes nothing."""
        self._usable()
        raise LinkError(f"{self.address} is a log: nothing can be sent to it.", hint="Read it, or open a bus.")

    def _release(self) -> None:
        self._file.close()


def _asc_start(address: str, lines: Iterable[str]) -> str:
    """Return the start that the head of an ASC file states."""
    started = ""
    for line in islice(lines, 50):
        words = line.split()
        if [word.lower() for word in words[:1]] == ["date"]:
            started = " ".join(words[1:])
        elif [word.lower() for word in words[:2]] == ["begin", "triggerblock"]:
            return " ".join(words[2:])
        elif [word.lower() for word in words[2:4]] == ["timestamps", "relative"]:
            raise LinkError(
                f"The times in {address} are relative to the event before, absolute ones were expected.",
                hint="Export the log with absolute time stamps.",
            )
    return started


def _hint(interface: str, channel: str, error: BaseException) -> str:
    if "msgpack" in str(error):
        return "Install it: pip install 'tactbench[multicast]'."
    if interface == "slcan" and not channel.startswith("/"):
        return "A port begins with a slash of its own: can://slcan//dev/ttyACM0."
    if os_error_in(error) is not None:
        return ""
    return f"See python-can's page of the interface {interface} for its channels and options."
