"""Emulators: models of devices at the far end of a link, without input or output of their own."""

from __future__ import annotations

import dataclasses
import math
from abc import ABC, abstractmethod
from collections import Counter, deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, Self, TypeAlias

from tactbench.core.errors import UnknownNameError, UsageError
from tactbench.core.spec.sensor import StreamSpec
from tactbench.links.can_link import CanFrame

if TYPE_CHECKING:
    import numpy as np

Senses: TypeAlias = Callable[[float], Mapping[str, float]]
"""Function from a second to the readings of the device's channels by name, in their units; the others are at rest."""

Sent: TypeAlias = tuple[float, "bytes | CanFrame"]
"""Second at which a piece has left the device, and the piece: bytes of a stream, a CAN frame, a datagram."""


class DeviceEmulator(Protocol):
    """Device on a byte stream, a CAN bus or datagrams. Times are seconds of one clock and never go back.

    The times of a serial line's bytes are those at which the line has carried them.
    """

    def feed(self, piece: bytes | CanFrame, now_s: float) -> Sequence[Sent]:
        """Take a piece from the host; return as :meth:`poll`."""

    def poll(self, now_s: float) -> Sequence[Sent]:
        """Return the pieces that have left the device since the last call until `now_s`, in order of their times."""

    def next_s(self) -> float:
        """Return the second of the next event; infinite: none before a piece comes. Only calls change it."""


class SpiDeviceEmulator(Protocol):
    """Device on an SPI bus: it sends only while the host clocks bytes."""

    def exchange(self, select: int, data: bytes, now_s: float) -> bytes:
        """Return as many bytes as go in; `select` is the mask of select lines, `now_s` the second of the first byte."""


@dataclass(frozen=True)
class EmulatorSettings:
    """Arguments of an emulator."""

    senses: Senses
    rng: np.random.Generator
    """Generator of this device alone."""
    options: Mapping[str, Any] = field(default_factory=dict)
    """Options of the rig file's entry, which the driver gets as well: board numbers, periods, rates."""
    faults: Sequence[str] = ()
    """Faults, as :meth:`~tactbench.devices.emulator.Fault.parse` reads them."""


LINK_FAULTS = {
    "unplug": "the link is gone from start_s on",
    "late": "what the device sends comes later by delay_s, in the same order",
}
"""Faults that every emulated device has, and their effects."""


@dataclass(frozen=True)
class Fault:
    """Fault from `start_s` until before `end_s`, seconds of the emulator's clock.

    A device's own faults are a frozen subclass with :attr:`known`, and further fields for their details.

    Raises
    ------
    UsageError
        If the device has no fault of that name, or `every` is below 1.
    """

    known: ClassVar[Mapping[str, str]] = {}
    """Names of a device's faults, and their effects."""

    name: str
    start_s: float = -math.inf
    end_s: float = math.inf
    every: int = 1
    """The fault concerns each n-th word, frame, line or datagram that it could concern."""

    def __post_init__(self) -> None:
        if self.name not in self.known:
            raise UnknownNameError("fault", self.name, {*self.known, *LINK_FAULTS})
        if self.every < 1:
            raise UsageError(f"The fault {self.name!r} cannot concern every {self.every}.", hint="Give 1 or more.")

    @classmethod
    def parse(cls, text: str) -> Self:
        """Return the fault that ``name`` or ``name:key=value,key=value`` describes, as a rig file writes it.

        Keys are the fields of the class, values are numbers or text; several values of one key are joined by ``+``.

        Raises
        ------
        UsageError
            If name or key is unknown, or a value does not fit the field.
        """
        import yaml
        from pydantic import TypeAdapter, ValidationError

        name, _, rest = text.partition(":")
        fields = {one.name: str(one.type) for one in dataclasses.fields(cls) if one.name != "name"}
        given: dict[str, Any] = {}
        for key, _, value in (part.partition("=") for part in rest.split(",") if part):
            if key not in fields:
                raise UnknownNameError(f"key of the fault {name!r}", key, fields)
            given[key] = value.split("+") if fields[key].startswith("frozenset") else yaml.safe_load(value)
        try:
            return TypeAdapter(cls).validate_python({"name": name, **given})
        except ValidationError as error:
            raise UsageError(f"The fault {text!r} is wrong: {error.errors()[0]['msg']}.") from error

    def active(self, now_s: float) -> bool:
        """Return whether it is on."""
        return self.start_s <= now_s < self.end_s


def fault_concerns(faults: Iterable[Fault], name: str, now_s: float, seen: Counter[Fault]) -> bool:
    """Return whether a fault `name` concerns the next word, line or datagram; `seen` counts the possible ones."""
    concerned = [fault for fault in faults if fault.name == name and fault.active(now_s)]
    seen.update(concerned)
    return any(seen[fault] % fault.every == 0 for fault in concerned)


class RowEmulator(ABC):
    """Emulator of the device of a :class:`~tactbench.devices.row_driver.RowDriver`, without faults of its own."""

    stream: ClassVar[StreamSpec]
    """Stream that it senses."""
    rate_hz: ClassVar[float] = 0.0
    """Rows a second while it samples; 0: it sends answers alone."""
    from_power_on: ClassVar[bool] = False
    """Whether it samples without a command."""
    answer_s: ClassVar[float] = 1e-3
    """Seconds that an answer takes; above 0, or virtual time would stand still while a host polls."""

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
        """Return the answer to a piece from the host; :meth:`sample` may be called here."""
        return ()

    def sample(self, now_s: float, on: bool = True) -> None:
        """Begin to sample now, or end."""
        self._since_s, self._rows = (now_s if on else math.inf), 0

    def sensed(self, now_s: float) -> list[float]:
        """Return the readings of the channels; those that are not sensed are at their rest level."""
        felt = self.settings.senses(now_s)
        return [felt.get(one.name, 0.0 if one.rest is None else one.rest.to(one.unit)) for one in self.stream.channels]

    def feed(self, piece: bytes | CanFrame, now_s: float) -> Sequence[Sent]:
        """Take a piece from the host; the answers are sent `answer_s` later."""
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
