"""SPI links: batches of transfers to devices behind an adapter."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

from tactbench.links.link import Link


@dataclass(frozen=True, slots=True)
class SpiStep:
    """One SPI transfer: select a device, exchange bytes, release the device, pause."""

    data: bytes
    """Bytes to send; equally many bytes are received. Empty: the step is only a pause."""
    select: int = 1
    """Mask of the active select lines, line i being bit i; the board defines the wiring of the lines."""
    pause_us: int = 0
    """Shortest pause with no active line after the transfer [us]; up to 65535."""


@dataclass(frozen=True, slots=True)
class SpiReply:
    """Reply to one batch: the bytes received, and their time."""

    number: int
    """Number of the batch, as returned by :meth:`SpiLink.send`."""
    data: tuple[bytes, ...]
    """Received bytes, one entry for each step of the batch, as long as the data sent in this step."""
    t_ns: int
    """Time of receipt [ns of the link's clock]."""
    device_us: int | None = None
    """Beginning of the batch by the adapter's own counter of microseconds, modulo 2**32; None: no counter."""


class SpiLink(Link):
    """Link to an SPI bus, for batches of transfers and their replies in the same order.

    The adapter executes a batch without the host, so that pauses of some ten microseconds are kept; the next batch may
    be sent before the last reply is received. For another kind of adapter, write a subclass with :meth:`send`,
    :meth:`receive`, :meth:`_release` and, where replies can get lost, :meth:`abandon`.

    Attributes
    ----------
    speed_hz
        Clock of the SPI bus [Hz].
    holds
        Largest number of batches sent and not yet answered; 1 if :meth:`send` itself executes a batch.
    """

    speed_hz: int
    holds: int = 2

    _number = -1

    @abstractmethod
    def send(self, steps: Sequence[SpiStep]) -> int:
        """Send a batch and return its number: 0, 1, 2, …, after 65535 again 0; at most `holds` may be unanswered.

        Raises the errors of every :class:`Link`, LinkError if the batch is longer than the adapter takes. Other
        refusals of the adapter are raised by :meth:`receive`.
        """

    @abstractmethod
    def receive(self, timeout_s: float) -> SpiReply:
        """Return the next reply; the number of a lost reply is skipped. Raises the errors of every :class:`Link`."""

    def abandon(self) -> None:
        """Stop waiting for all outstanding replies; late replies are dropped. Raises nothing."""

    def _next_number(self) -> int:
        self._usable()
        self._number = (self._number + 1) & 0xFFFF
        return self._number
