"""Links to CAN buses through python-can, and reading of its log files."""

from __future__ import annotations

import errno
import importlib
import inspect
import re
import statistics
import time
from abc import abstractmethod
from collections import Counter, deque
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tactbench.core.errors import LinkError, UnknownNameError
from tactbench.links.link import SYSTEM_ERRORS, WRITE_TIMEOUT_S, Clock, Link, cannot_open, os_error_in

WAITED_S = 60.0
"""Longest time of a frame in a kernel's queue [s] (assumed); an older time stamp is not used."""
SYSTEMS_OWN_NS = 5_000_000
"""Largest lag at which time stamps count as the system clock's own, and largest scatter of stamps that are used [ns]
(assumed: waking a process takes less)."""
LEAST_OF = 200
"""Number of frames of which at least one is read without delay, if the reader waited for no frame (assumed)."""
WINDOW_NS = 5_000_000_000
"""Length of a window [ns]; the least age is that of the current and the previous window (assumed: 1 ms at 100 ppm)."""
_HEX = r"[\dA-Fa-f]"
_SLCAN = re.compile("|".join([
    *(rf"(?:t{_HEX}{{3}}|[Tx]{_HEX}{{8}}){n}{_HEX}{{{2 * n}}}(?:{_HEX}{{4}}(?=[tTrRx]|$))?" for n in range(9)),
    rf"(?:r{_HEX}{{3}}|R{_HEX}{{8}})[0-8]",
]))  # fmt: skip
"""Pattern of an slcan data frame of n bytes, with or without the adapter's milliseconds, or of a remote frame."""


def _raised(*others: type[Exception]) -> tuple[type[Exception], ...]:
    """Return the error classes of python-can and of the system, and `others`."""
    import can

    return (can.CanError, *SYSTEM_ERRORS, *others)


@dataclass(frozen=True, slots=True)
class CanFrame:
    """A CAN data frame."""

    id: int
    """Identifier of 11 bits, or 29 if `extended`."""
    data: bytes
    """Payload of at most 8 bytes."""
    extended: bool = False
    t_ns: int = 0
    """Time of receipt by kernel or adapter [ns of the link's clock; in a log, since its first message]. Not sent."""


class CanLink(Link):
    """Link for frames to and from a CAN bus: a :class:`CanBus`, or the link of an emulated device.

    Attributes
    ----------
    counts
        Numbers of frames left out, by kind: ``error frames``, ``remote and FD frames``, ``unreadable frames``.
    """

    def __init__(self, address: str, clock: Clock = time.monotonic_ns) -> None:
        super().__init__(address, clock)
        self.counts: Counter[str] = Counter()

    @abstractmethod
    def receive(self, timeout_s: float) -> CanFrame:
        """Return the next data frame; raises the errors of every :class:`Link`."""

    @abstractmethod
    def send(self, frame: CanFrame) -> None:
        """Send a data frame; raises the errors of every :class:`Link`, LinkTimeout also if no node acknowledges."""

    def _sendable(self, frame: CanFrame) -> None:
        super()._sendable(frame)
        if not 0 <= frame.id < 1 << (29 if frame.extended else 11) or len(frame.data) > 8:
            raise LinkError(
                f"{self.address}: {frame} is not a valid CAN frame.",
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


class _Stamps:
    """Conversion of python-can's time stamps, seconds since 1970 or since an adapter's start, to a link's clock.

    A stamp's age is the system's time at reading less the stamp. A frame for which the reader waited is read at once,
    and so is at least one of some hundred: the least age of late is the lag of the stamps' clock. If the system's clock
    is set, queued frames have stamps of the old clock: their age is computed by the clock that makes it least.
    """

    def __init__(self, clock: Clock, wall: Clock = time.time_ns) -> None:
        self._clock, self._wall = clock, wall
        self._walls: deque[int] = deque(maxlen=4)
        self._least: deque[tuple[int, int]] = deque(maxlen=2)
        self._seen, self._known = 0, False
        self._late: deque[int] = deque(maxlen=31)
        """Ages of the frames for which the reader waited, less the least age [ns]."""

    @property
    def refused(self) -> bool:
        """True if stamps scatter too much to be used: half of the frames that were read at once have old stamps."""
        return len(self._late) == self._late.maxlen and statistics.median(self._late) > SYSTEMS_OWN_NS

    def lag_ns(self) -> int:
        """Return the lag of the stamps' clock behind the system's [ns]; 0 if both are one clock, or not known yet."""
        least_ns = min((least_ns for _, least_ns in self._least), default=0)
        return least_ns if self._known and abs(least_ns) > SYSTEMS_OWN_NS else 0

    def __call__(self, stamp_s: float, *, waited: bool) -> int:
        """Return a frame's time of receipt [ns of the link's clock]; `waited`: True if the reader waited for it."""
        now_ns, lag_ns = self._clock(), self.lag_ns()
        wall_ns = self._wall() - now_ns
        if self._walls and abs(wall_ns - self._walls[-1]) < SYSTEMS_OWN_NS:
            self._walls[-1] = wall_ns
        else:
            self._walls.append(wall_ns)
        ages_ns = [now_ns + one - round(1e9 * stamp_s) for one in self._walls]
        possible = [age_ns for age_ns in ages_ns if age_ns >= lag_ns - SYSTEMS_OWN_NS]
        age_ns = min(possible) if possible else ages_ns[-1]
        self._seen += 1
        self._known |= waited or self._seen >= LEAST_OF
        if not self._least or now_ns - self._least[-1][0] > WINDOW_NS:
            self._least.append((now_ns, age_ns))
        elif age_ns < self._least[-1][1]:
            self._least[-1] = (self._least[-1][0], age_ns)
        waited_ns = age_ns - self.lag_ns()
        if waited:
            self._late.append(waited_ns)
        return now_ns - waited_ns if 0 <= waited_ns < 1e9 * WAITED_S and not self.refused else now_ns


class CanBus(CanLink):
    """A bus behind an interface of python-can.

    A frame's time is its ``Message.timestamp`` (for socketcan, the kernel's), converted to the link's clock. If stamps
    lag behind the system's clock, the lag is removed, and the frames are counted.

    Parameters
    ----------
    interface, channel
        Names in python-can: ``socketcan`` with ``can0``, ``pcan`` with ``PCAN_USBBUS1``, ``slcan`` with a port …
    clock
        Function that returns the times of receipt [ns].
    options
        Options of the interface, by python-can's names: ``bitrate``, ``tty_baudrate``, ``port`` …

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
        if interface not in can.interfaces.BACKENDS:
            raise UnknownNameError("kind of can:// link", interface, sorted(can.interfaces.BACKENDS))
        try:
            module, name = can.interfaces.BACKENDS[interface]
            known = inspect.signature(getattr(importlib.import_module(module), name).__init__).parameters
            for option in options.keys() - known.keys() - {"bitrate"}:
                raise UnknownNameError(f"option of a can://{interface} link", option, list(known)[2:])
            self._bus: Any = can.Bus(channel, interface, ignore_config=True, **options)
        except _raised(ValueError, TypeError, ImportError) as error:
            raise cannot_open(self.address, error, hint=_hint(interface, channel, error)) from error
        self._stamp = _Stamps(clock)
        if interface == "slcan":
            bus: Any = self._bus
            self._read_line, bus._read = bus._read, self._slcan_frame

    def receive(self, timeout_s: float) -> CanFrame:  # noqa: D102  (inherited)
        deadline = self._usable(timeout_s)
        left_s, came = timeout_s, True
        while came or left_s > 0:
            try:
                message = self._bus.recv(0.0)
                if waited := message is None and left_s > 0:
                    message = self._bus.recv(left_s)
                came = message is not None
                if came:
                    t_ns = self._stamp(message.timestamp, waited=waited)
                    if self._stamp.lag_ns() or self._stamp.refused:
                        self.counts["frames stamped by another clock"] += 1
                    frame = _data_frame(message, t_ns, self.counts)
                    if frame is not None:
                        return frame
            except _raised(ValueError, IndexError) as error:
                if os_error_in(error) is not None:
                    raise self._unplugged(error) from error
                # Bytes that are no frame. python-can's slcan would try those that are not ASCII again and again; its
                # own flush() would drop the frames behind them as well.
                self.counts["unreadable frames"] += 1
                getattr(self._bus, "_buffer", bytearray()).clear()
            left_s = deadline - self.timer()
        raise self._nothing_came(timeout_s)

    def _slcan_frame(self, timeout_s: float | None) -> str | None:
        """Return the next frame of python-can's slcan, which takes all bytes between two CR or BEL for one frame.

        Line feeds are removed; frames whose CR was lost are separated; stretches with other bytes are counted, and so
        is BEL, by which an adapter reports an error.
        """
        line: str | None = self._read_line(timeout_s)
        if not line:
            return line
        if line.endswith("\a"):
            self.counts["errors of the adapter"] += 1
        text = line.strip("\r\n\a")
        if not text or text[0] in "dDbBzZVNF":  # FD frames, and answers to commands
            return f"{text}\r"
        frames = [found[0] for found in _SLCAN.finditer(text)]
        if _SLCAN.sub("", text):
            self.counts["unreadable frames"] += 1
        for frame in frames[1:]:
            self._bus._queue.put_nowait(f"{frame}\r")
        return f"{frames[0]}\r" if frames else "\r"

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
        except _raised() as error:
            reason = os_error_in(error)
            if isinstance(reason, SerialTimeoutException) or (reason and reason.errno == errno.ENOBUFS):
                raise self._not_sent(error) from error
            raise self._unplugged(error) from error

    def _release(self) -> None:
        try:
            self._bus.shutdown()
        except _raised():
            # slcan's writes to the adapter, which may be gone, before it closes its port.
            self._bus.serialPortOrig.close()


def read_can_log(file: Path) -> tuple[list[CanFrame], Counter[str]]:
    """Return the data frames of a log in a format of python-can, and `counts` of frames left out (:class:`CanLink`).

    Time stamps are nanoseconds since the log's first message. Stamps of BLF files are exact to 0.25 us only, since
    python-can returns float64.

    Parameters
    ----------
    file
        Log file whose name ends in ``.log`` (candump), ``.asc``, ``.blf``, ``.csv``, ``.trc`` …

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
            raise ValueError("its times are relative to the event before; export it with absolute times")
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
        return "Write the port with its own slash: can://slcan//dev/ttyACM0."
    if os_error_in(error) is not None:
        return ""
    return f"See python-can's page of the interface {interface} for its channels, options and requirements."
