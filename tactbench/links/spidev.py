"""SPI of a Linux machine itself, by spidev."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Sequence

from tactbench.core.errors import LinkError
from tactbench.links.link import Clock, cannot_open
from tactbench.links.spi_link import SpiLink, SpiReply, SpiStep


class SpidevLink(SpiLink):
    """A device ``/dev/spidevBUS.SELECT``.

    A batch is carried out by this process when it is sent: pauses are at least as long as asked for, and longer when
    the system has other work. Never run on a real device.

    Parameters
    ----------
    device
        Bus and select line, ``0.0``. Linux activates one line at a time: `select` of a step is 1.
    speed_hz
        Clock of the bus, hertz.
    mode
        SPI mode, 0 to 3.
    clock
        Stamps what is received.

    Raises
    ------
    LinkError
        If spidev is not installed, or the device cannot be opened.
    """

    def __init__(self, device: str, *, speed_hz: int, mode: int = 0, clock: Clock = time.monotonic_ns) -> None:
        super().__init__(f"spi://spidev/{device}", clock)
        self.speed_hz = speed_hz
        self.holds = 1
        bus, _, line = device.partition(".")
        if not (bus.isdigit() and line.isdigit()):
            raise LinkError(f"{self.address} does not name a bus and a line.", hint="Write spi://spidev/0.0.")
        try:
            import spidev
        except ImportError as error:
            raise LinkError(
                f"{self.address} needs the package spidev, which is not installed.",
                hint="Install it: pip install 'tactbench[spi]' (Linux only; it is compiled).",
            ) from error
        self._replies: deque[SpiReply] = deque()
        self._device = spidev.SpiDev()
        try:
            self._device.open(int(bus), int(line))
            self._device.max_speed_hz = speed_hz
            self._device.mode = mode
        except OSError as error:
            self._device.close()
            raise cannot_open(self.address, error) from error

    def _submit(self, number: int, steps: Sequence[SpiStep]) -> None:
        if any(step.select != 1 for step in steps):
            raise LinkError(f"{self.address} has one select line.", hint="Give every step select=1.")
        data = []
        try:
            for step in steps:
                data.append(bytes(self._device.xfer2(list(step.data))) if step.data else b"")
                released = time.perf_counter_ns()
                # Shorter than a sleep can be: waits for tens of microseconds are spent here.
                while time.perf_counter_ns() - released < 1000 * step.pause_us:
                    pass
        except OSError as error:
            raise self._unplugged(error) from error
        self._replies.append(SpiReply(number, tuple(data), self._clock()))

    def _collect(self, timeout_s: float, deadline: float) -> SpiReply:
        if not self._replies:
            raise self._nothing_came(timeout_s)
        return self._replies.popleft()

    def abandon(self) -> None:  # noqa: D102
        self._replies.clear()

    def _release(self) -> None:
        self._device.close()
