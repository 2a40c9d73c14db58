"""A model of a device that sends one stream: from power-on, from when it is told to, or when it is asked."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Iterable, Sequence
from typing import ClassVar

from tactbench.core.spec.sensor import StreamSpec
from tactbench.devices.emulator import EmulatorSettings, Sent
from tactbench.devices.fault import Fault
from tactbench.links.can_link import CanFrame


class RowEmulator(ABC):
    """The far end of a :class:`~tactbench.devices.row_driver.RowDriver`'s link; it knows no faults of its own.

    Raises
    ------
    UsageError
        For a fault.
    """

    stream: ClassVar[StreamSpec]
    """What it senses."""
    rate_hz: ClassVar[float] = 0.0
    """Rows a second while it samples; 0: only when it is asked."""
    from_power_on: ClassVar[bool] = False
    """Whether it samples without being told to."""
    answer_s: ClassVar[float] = 1e-3
    """Seconds that an answer takes; above 0, or the time of a host that asks again at once would stand still."""

    def __init__(self, settings: EmulatorSettings) -> None:
        for fault in settings.faults:
            Fault.parse(fault)
        self.settings = settings
        self._since_s = 0.0 if self.from_power_on else math.inf
        self._rows = 0
        self._answers: deque[Sent] = deque()

    @abstractmethod
    def sent(self, values: Sequence[float]) -> Iterable[bytes | CanFrame]:
        """Return a row as it leaves the device: bytes, datagrams or CAN frames."""

    def told(self, piece: bytes | CanFrame, now_s: float) -> Iterable[bytes | CanFrame]:
        """Return the answer to what the host sent; :meth:`sample` may be called here."""
        return ()

    def sample(self, now_s: float, on: bool = True) -> None:
        """Begin to sample now, or end."""
        self._since_s, self._rows = (now_s if on else math.inf), 0

    def sensed(self, now_s: float) -> list[float]:
        """Return what the channels read: their rest level where nobody says more."""
        felt = self.settings.senses(now_s)
        return [felt.get(one.name, 0.0 if one.rest is None else one.rest.to(one.unit)) for one in self.stream.channels]

    @property
    def bytes_per_s(self) -> float:
        """What it sends while it samples, by its rate and the length of a row: a baud rate must carry that."""
        return self.rate_hz * sum(len(piece) for piece in self.sent(self.sensed(0.0)) if isinstance(piece, bytes))

    def feed(self, piece: bytes | CanFrame, now_s: float) -> Sequence[Sent]:
        """Take what came from the host."""
        before = self.poll(now_s)
        self._answers.extend((now_s + self.answer_s, answer) for answer in self.told(piece, now_s))
        return before

    def poll(self, now_s: float) -> Sequence[Sent]:
        """Return the rows that are due."""
        found: list[Sent] = []
        while (due_s := self.next_s()) <= now_s:
            if self._answers and self._answers[0][0] <= due_s:
                found.append(self._answers.popleft())
            else:
                found += [(due_s, piece) for piece in self.sent(self.sensed(due_s))]
                self._rows += 1
        return found

    def next_s(self) -> float:
        """Return when the next row or answer is due."""
        row_s = self._since_s + (self._rows + 1) / self.rate_hz if self.rate_hz else math.inf
        return min(row_s, self._answers[0][0]) if self._answers else row_s
