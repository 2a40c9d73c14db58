"""SPI: batches of transfers to devices behind an adapter."""

from __future__ import annotations

import time
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

from tactbench.core.errors import LinkError
from tactbench.links.link import Clock, Link


@dataclass(frozen=True, slots=True)
class SpiStep:
    """One transfer: select, exchange bytes, release, pause."""

    data: bytes
    """What goes out; as many bytes come in. Empty: only the pause."""
    select: int = 1
    """Mask of the select lines that are active meanwhile, line i being bit i; what the wires do with it is the
    board's."""
    pause_us: int = 0
    """Microseconds that no line is active afterwards, at least; up to 65535."""


@dataclass(frozen=True, slots=True)
class SpiReply:
    """What came in during one batch."""

    number: int
    """What :meth:`SpiLink.send` returned for it."""
    data: tuple[bytes, ...]
    """As many as the batch has steps, each as long as its step's data."""
    t_ns: int
    """When the first of it was in the host, nanoseconds of the link's clock."""
    device_us: int | None = None
    """When the batch began by the adapter's own counter of microseconds, modulo 2**32; None: it has none."""


class SpiLink(Link):
    """Batches to an SPI bus, and their replies in the same order.

    A batch is carried out without the host, so that pauses of some ten microseconds hold whatever the host does; and
    the next may be sent before the reply to the last one is here. An adapter of another kind is a subclass with
    :meth:`_submit`, :meth:`_collect`, :meth:`_release` and, where replies can get lost, :meth:`abandon`.

    Attributes
    ----------
    speed_hz
        The SPI clock it runs, hertz.
    holds
        Batches that may be sent before the first of them is answered; 1 where :meth:`send` itself carries them out.
    """

    speed_hz: int
    holds: int = 2

    def __init__(self, address: str, clock: Clock = time.monotonic_ns) -> None:
        super().__init__(address, clock)
        self._number = -1

    @abstractmethod
    def _submit(self, number: int, steps: Sequence[SpiStep]) -> None:
        """Hand over a batch."""

    @abstractmethod
    def _collect(self, timeout_s: float, deadline: float) -> SpiReply:
        """Return the next reply; `deadline` is when `timeout_s` ends, in seconds of :meth:`timer`."""

    def send(self, steps: Sequence[SpiStep]) -> int:
        """Hand over a batch and return its number: 0, 1, 2, …, after 65535 again 0.

        Raises
        ------
        LinkError
            If it is empty, a step is not possible, or the adapter cannot hold one more: receive first.
        LinkTimeout, LinkUnplugged, LinkClosed
            As of every link.
        """
        self._usable()
        if not steps:
            raise LinkError(f"{self.address}: a batch without a step was given.", hint="Give at least one.")
        for step in steps:
            if not 0 <= step.pause_us < 1 << 16:
                raise LinkError(f"{self.address}: {step} was given.", hint="A pause is 0 to 65535 us.")
        self._number = (self._number + 1) & 0xFFFF
        self._submit(self._number, steps)
        return self._number

    def receive(self, timeout_s: float) -> SpiReply:
        """Return the next reply. Where one was lost on its way, its number is left out.

        Parameters
        ----------
        timeout_s
            Seconds to wait; 0 asks without waiting.

        Raises
        ------
        LinkTimeout
            If none came.
        LinkError
            If the adapter refuses the batch.
        LinkUnplugged, LinkClosed
            As of every link.
        """
        return self._collect(timeout_s, self._usable(timeout_s))

    def abandon(self) -> None:
        """Wait no longer for replies to what was sent; those that come late are dropped. Raises nothing."""

    def transfer(self, data: bytes, *, select: int = 1, pause_us: int = 0, timeout_s: float = 1.0) -> bytes:
        """Exchange `data` at once and return what came in; replies to earlier batches are dropped.

        Raises
        ------
        LinkTimeout, LinkError, LinkUnplugged, LinkClosed
            As of :meth:`receive`.
        """
        number = self.send([SpiStep(data, select, pause_us)])
        deadline = self.timer() + timeout_s
        while True:
            reply = self.receive(max(0.0, deadline - self.timer()))
            if reply.number == number:
                return reply.data[0]
