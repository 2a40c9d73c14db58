"""SPI: batches of transfers to devices behind an adapter, or on a Linux machine's own bus."""

from __future__ import annotations

import time
from abc import abstractmethod
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from tactbench.links.link import Clock, Link, cannot_open


@dataclass(frozen=True, slots=True)
class SpiStep:
    """One transfer: select, exchange bytes, release, pause."""

    data: bytes
    """Bytes to send; as many are received. Empty: only the pause."""
    select: int = 1
    """Mask of the active select lines, line i being bit i; their wiring is that of the board."""
    pause_us: int = 0
    """Microseconds that no line is active afterwards, at least; up to 65535."""


@dataclass(frozen=True, slots=True)
class SpiReply:
    """The bytes received during one batch."""

    number: int
    """The number that :meth:`SpiLink.send` returned for it."""
    data: tuple[bytes, ...]
    """As many as the batch has steps, each as long as its step's data."""
    t_ns: int
    """Time of receipt, nanoseconds of the link's clock."""
    device_us: int | None = None
    """Beginning of the batch by the adapter's own counter of microseconds, modulo 2**32; None: it has none."""


class SpiLink(Link):
    """Batches to an SPI bus, and their replies in the same order.

    The adapter executes a batch without the host, so that pauses of some ten microseconds hold; the next may be sent
    before the reply to the last one is received. An adapter of another kind is a subclass with :meth:`send`,
    :meth:`receive`, :meth:`_release` and, where replies can get lost, :meth:`abandon`.

    Attributes
    ----------
    speed_hz
        The SPI clock it runs, hertz.
    holds
        Batches that may be sent before the first of them is answered; 1 where :meth:`send` itself executes them.
    """

    speed_hz: int
    holds: int = 2

    _number = -1

    @abstractmethod
    def send(self, steps: Sequence[SpiStep]) -> int:
        """Hand over a batch and return its number: 0, 1, 2, …, after 65535 again 0; at most `holds` at once.

        Raises as every :class:`Link`, LinkError if it is longer than the adapter takes. Other refusals of the adapter
        are raised by :meth:`receive`.
        """

    @abstractmethod
    def receive(self, timeout_s: float) -> SpiReply:
        """Return the next reply, raising as every :class:`Link`; the number of a lost one is missing."""

    def abandon(self) -> None:
        """Give up all outstanding replies; late ones are dropped. Raises nothing."""

    def _next_number(self) -> int:
        self._usable()
        self._number = (self._number + 1) & 0xFFFF
        return self._number


class SpidevLink(SpiLink):
    """A device ``/dev/spidevBUS.SELECT``.

    This process executes a batch when it is sent: pauses are at least as long as requested, and longer when the system
    has other work. Never run on a real device.

    Parameters
    ----------
    device
        Bus and select line, ``0.0``. Linux activates one line at a time: `select` of a step is 1.
    speed_hz
        Clock of the bus, hertz.
    mode
        SPI mode, 0 to 3.
    clock
        Gives the times of receipt.

    Raises
    ------
    LinkError
        If spidev is not installed, or the device cannot be opened.
    """

    def __init__(self, device: str, *, speed_hz: int, mode: int = 0, clock: Clock = time.monotonic_ns) -> None:
        super().__init__(f"spi://spidev/{device}", clock)
        self.speed_hz = speed_hz
        self.holds = 1
        self._replies: deque[SpiReply] = deque()
        try:
            import spidev

            self._device = spidev.SpiDev()
            self._device.open(*map(int, device.split(".")))
            self._device.max_speed_hz = speed_hz
            self._device.mode = mode
        except OSError as error:
            raise cannot_open(self.address, error) from error
        except (ImportError, ValueError, TypeError) as error:
            hint = "Write spi://spidev/BUS.LINE; it needs pip install 'tactbench[spi]' (Linux only)."
            raise cannot_open(self.address, error, hint=hint) from error

    def send(self, steps: Sequence[SpiStep]) -> int:  # noqa: D102  (inherited)
        number = self._next_number()
        data = []
        try:
            for step in steps:
                data.append(bytes(self._device.xfer2(list(step.data))) if step.data else b"")
                released = time.perf_counter_ns()
                # Pauses of tens of microseconds are shorter than any sleep.
                while time.perf_counter_ns() - released < 1000 * step.pause_us:
                    pass
        except OSError as error:
            raise self._unplugged(error) from error
        self._replies.append(SpiReply(number, tuple(data), self._clock()))
        return number

    def receive(self, timeout_s: float) -> SpiReply:  # noqa: D102  (inherited)
        self._usable(timeout_s)
        if not self._replies:
            raise self._nothing_came(timeout_s)
        return self._replies.popleft()

    def abandon(self) -> None:  # noqa: D102
        self._replies.clear()

    def _release(self) -> None:
        self._device.close()
