"""Base classes of emulators: models of devices behind a link, without real input or output."""

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
"""Function from a time [s] to the sensed values by channel, in the channels' units; channels left out are at rest."""

Sent: TypeAlias = tuple[float, "bytes | CanFrame"]
"""Time at which data have left the device [s], and the data: bytes of a stream, a CAN frame or a datagram."""


class DeviceEmulator(Protocol):
    """Emulated device on a byte stream, CAN bus or datagram link. Times are seconds of one clock that never goes back.

    On a serial line, the time of a byte is the time at which its transmission has ended.
    """

    def feed(self, piece: bytes | CanFrame, now_s: float) -> Sequence[Sent]:
        """Process data from the host; return the same as :meth:`poll`."""

    def poll(self, now_s: float) -> Sequence[Sent]:
        """Return the data that have left the device between the last call and `now_s`, in order of time."""

    def next_s(self) -> float:
        """Return the time of the next event [s]; infinite: no event until the host sends data. Only calls change it."""


class SpiDeviceEmulator(Protocol):
    """Emulated device on an SPI bus, which sends only while the host clocks bytes."""

    def exchange(self, select: int, data: bytes, now_s: float) -> bytes:
        """Return as many bytes as `data` has; `select` is the mask of select lines, `now_s` the first byte's time."""


@dataclass(frozen=True)
class EmulatorSettings:
    """Arguments with which an emulator is made."""

    senses: Senses
    rng: np.random.Generator
    """Random generator used by this device alone."""
    options: Mapping[str, Any] = field(default_factory=dict)
    """Options of the device from the rig file, also given to the driver: board numbers, periods, rates."""
    faults: Sequence[str] = ()
    """Faults as text, in the format of :meth:`~tactbench.devices.emulator.Fault.parse`."""


@dataclass(frozen=True)
class Fault:
    """Fault of an emulated device, active from `start_s` until just before `end_s` on the emulator's clock [s].

    The faults of one device are a frozen subclass with its :attr:`known`, and more fields for details.

    Raises
    ------
    UsageError
        If the device has no fault of this name, or `every` is below 1.
    """

    known: ClassVar[Mapping[str, str]] = {}
    """Names of the device's faults, with a description of their effects."""

    name: str
    start_s: float = -math.inf
    end_s: float = math.inf
    every: int = 1
    """The fault affects only each n-th word, frame, line or datagram that it can affect."""

    def __post_init__(self) -> None:
        if self.name not in self.known:
            raise UnknownNameError("fault", self.name, {*self.known, *LinkFault.known})
        if self.every < 1:
            raise UsageError(f"`every` of the fault {self.name!r} is {self.every}.", hint="Give 1 or more.")

    @classmethod
    def parse(cls, text: str) -> Self:
        """Return the fault described by ``name`` or ``name:key=value,key=value``, the format of rig files.

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
            raise UsageError(f"The stated fault {text!r} is invalid: {error.errors()[0]['msg']}.") from error

    def active(self, now_s: float) -> bool:
        """Return True if the fault is active at `now_s`."""
        return self.start_s <= now_s < self.end_s


@dataclass(frozen=True)
class LinkFault(Fault):
    """Fault of a link, possible for every emulated device."""

    known: ClassVar[Mapping[str, str]] = {
        "unplug": "the link is gone from start_s on",
        "late": "data sent by the device arrive later by delay_s, in the same order",
    }
    delay_s: float = 0.05
    """Delay of data by the fault [s]: five periods at 100 Hz."""


def fault_concerns(faults: Iterable[Fault], name: str, now_s: float, seen: Counter[Fault]) -> bool:
    """Return True if a fault `name` affects the next word, line or datagram; `seen` counts those it can affect."""
    concerned = [fault for fault in faults if fault.name == name and fault.active(now_s)]
    seen.update(concerned)
    return any(seen[fault] % fault.every == 0 for fault in concerned)


class RowEmulator(ABC):
    """Emulator of a device read by a :class:`~tactbench.devices.driver.RowDriver`; only its link can have faults."""

    stream: ClassVar[StreamSpec]
    """Stream of the values that the device senses."""
    rate_hz: ClassVar[float] = 0.0
    """Rows sent per second while sampling [Hz]; 0: the device only sends answers to requests."""
    from_power_on: ClassVar[bool] = False
    """True if the device samples from power-on, without a command."""
    answer_s: ClassVar[float] = 1e-3
    """Delay of an answer [s]; above 0, since virtual time would not advance while a host polls."""

    def __init__(self, settings: EmulatorSettings) -> None:
        for fault in settings.faults:
            Fault.parse(fault)
        self.settings = settings
        self._since_s = 0.0 if self.from_power_on else math.inf
        self._rows = 0
        self._answers: deque[Sent] = deque()

    @abstractmethod
    def sent(self, values: Sequence[float]) -> Iterable[bytes | CanFrame]:
        """Return one row as data sent by the device: bytes, datagrams or CAN frames."""

    def told(self, piece: bytes | CanFrame, now_s: float) -> Iterable[bytes | CanFrame]:
        """Return the answer to data from the host; a command may start or stop sampling by :meth:`sample`."""
        return ()

    def sample(self, now_s: float, on: bool = True) -> None:
        """Begin sampling now, or end sampling."""
        self._since_s, self._rows = (now_s if on else math.inf), 0

    def sensed(self, now_s: float) -> list[float]:
        """Return the channels' values at a time [s]; channels without a sensed value are at their rest level."""
        felt = self.settings.senses(now_s)
        return [felt.get(one.name, 0.0 if one.rest is None else one.rest.to(one.unit)) for one in self.stream.channels]

    def feed(self, piece: bytes | CanFrame, now_s: float) -> Sequence[Sent]:
        """Process data from the host; the answers are sent `answer_s` later."""
        before = self.poll(now_s)
        self._answers.extend((now_s + self.answer_s, answer) for answer in self.told(piece, now_s))
        return before

    def poll(self, now_s: float) -> Sequence[Sent]:
        """Return the rows and answers sent until `now_s`."""
        found: list[Sent] = []
        while (due_s := self.next_s()) <= now_s:
            if self._answers and self._answers[0][0] <= due_s:
                found.append(self._answers.popleft())
            else:
                found += [(due_s, piece) for piece in self.sent(self.sensed(due_s))]
                self._rows += 1
        return found

    def next_s(self) -> float:
        """Return the time at which the next row or answer is due [s]."""
        row_s = self._since_s + (self._rows + 1) / self.rate_hz if self.rate_hz else math.inf
        return min(row_s, self._answers[0][0]) if self._answers else row_s
