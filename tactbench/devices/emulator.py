"""What an emulator is: a device at the far end of a link, as a model without input or output of its own."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

from tactbench.links.can_link import CanFrame

if TYPE_CHECKING:
    import numpy as np

Senses: TypeAlias = Callable[[float], Mapping[str, float]]
"""Second -> what the device's channels would read, by their names and in their units; those left out are at rest."""

Sent: TypeAlias = tuple[float, "bytes | CanFrame"]
"""When a piece has left the device, in seconds, and the piece: bytes of a stream, a CAN frame, a datagram."""


class DeviceEmulator(Protocol):
    """A device on a byte stream, a CAN bus or datagrams. Times are seconds of one clock and never go back.

    It gives the bytes of a serial line their time itself. One that has a `bytes_per_s` says what a line must carry.
    """

    def feed(self, piece: bytes | CanFrame, now_s: float) -> Sequence[Sent]:
        """Take what came from the host; return what has left the device by `now_s` and was not yet returned."""

    def poll(self, now_s: float) -> Sequence[Sent]:
        """Return what has left the device by `now_s` and was not yet returned, in order, each with its time."""

    def next_s(self) -> float:
        """Return when `poll` has something to do next; infinite: not before something comes. Only calls change it."""


class SpiDeviceEmulator(Protocol):
    """A device on an SPI bus: it sends only while the host clocks bytes."""

    def exchange(self, select: int, data: bytes, now_s: float) -> bytes:
        """Return as many bytes as go in, from a select mask and the second at which the first begins."""


@dataclass(frozen=True)
class EmulatorSettings:
    """What an emulator is built from."""

    senses: Senses
    rng: np.random.Generator
    """This device's own."""
    options: Mapping[str, Any] = field(default_factory=dict)
    """Those of the rig file's entry, which the driver gets as well: board numbers, periods, rates."""
    faults: Sequence[str] = ()
    """Faults, as :meth:`~tactbench.devices.fault.Fault.parse` reads them."""


class EmulatorFactory(Protocol):
    """What ``SensorDescriptor.emulator`` and ``DeviceDescriptor.emulator`` name."""

    def __call__(self, settings: EmulatorSettings) -> DeviceEmulator | SpiDeviceEmulator:
        """Build the model; raises UsageError for options or faults that are not known."""
