"""The device's end of one emulated link: a model of the device, and the faults of the link."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, TypeAlias

from tactbench.devices.emulator import LINK_FAULTS, DeviceEmulator, Fault, Sent
from tactbench.links.can_link import CanFrame

Piece: TypeAlias = bytes | CanFrame
"""One transmitted piece of data: bytes of a stream, a CAN frame, or a datagram."""

_AGAIN_S = 1e-6
"""Time within which two events of a device count as one [s] (assumed). An emulator whose next event is due at the
time of its last poll, by rounding or by mistake, is polled again this much later, so that time always advances."""


@dataclass(frozen=True)
class LinkFault(Fault):
    """Fault of a link, possible for every emulated device."""

    known: ClassVar[Mapping[str, str]] = LINK_FAULTS
    delay_s: float = 0.05
    """Delay of data by the fault [s]: five periods at 100 Hz."""


def split_faults(faults: Iterable[str]) -> tuple[tuple[LinkFault, ...], tuple[str, ...]]:
    """Return the faults of the link, parsed, and the faults of the device itself as text.

    Raises
    ------
    UsageError
        If a fault of the link has an unknown key or a wrong value.
    """
    given = tuple(faults)
    of_link = tuple(fault for fault in given if fault.partition(":")[0] in LinkFault.known)
    return tuple(map(LinkFault.parse, of_link)), tuple(fault for fault in given if fault not in of_link)


class Line:
    """Emulated device with the device's end of its link.

    Parameters
    ----------
    emulator
        The device.
    faults
        Faults of the link.

    Attributes
    ----------
    deliver
        Function of the host's end, called with time [s] and piece in order of time; None: the host's end is not open,
        and pieces are dropped.
    gone
        True if a fault has unplugged the link.
    """

    def __init__(self, emulator: DeviceEmulator, faults: Sequence[LinkFault] = ()) -> None:
        self.deliver: Callable[[float, Piece], None] | None = None
        self.gone = False
        self._emulator = emulator
        self._faults = tuple(faults)
        self._unplugged_s = min((fault.start_s for fault in faults if fault.name == "unplug"), default=math.inf)
        self._polled_s = -math.inf
        self._out: deque[tuple[float, Piece]] = deque()

    def feed(self, piece: Piece, now_s: float) -> None:
        """Pass a piece from the host to the device at `now_s`, and deliver all pieces that are due."""
        self.poll(now_s)
        if not self.gone:
            self._send(self._emulator.feed(piece, now_s))
            self.poll(now_s)

    def poll(self, now_s: float) -> None:
        """Advance the device to `now_s`, and deliver all pieces that are due."""
        if self.gone:
            return
        self._polled_s = until_s = min(now_s, self._unplugged_s)
        if self._emulator.next_s() <= until_s:
            self._send(self._emulator.poll(until_s))
        while self._out and self._out[0][0] <= now_s and self._out[0][0] < self._unplugged_s:
            t_s, piece = self._out.popleft()
            if self.deliver is not None:
                self.deliver(t_s, piece)
        self.gone = now_s >= self._unplugged_s

    def next_s(self) -> float:
        """Return the time of the next event [s]; infinite if there is no event until the host sends a piece."""
        if self.gone:
            return math.inf
        due_s = min(self._emulator.next_s(), self._out[0][0] if self._out else math.inf, self._unplugged_s)
        return due_s if due_s > self._polled_s else self._polled_s + _AGAIN_S

    def _send(self, sent: Sequence[Sent]) -> None:
        for left_s, piece in sent:
            due_s = left_s + sum(one.delay_s for one in self._faults if one.name == "late" and one.active(left_s))
            self._out.append((max(due_s, self._out[-1][0]) if self._out else due_s, piece))
