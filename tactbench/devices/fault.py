"""Something wrong with an emulated device, by name and time."""

from __future__ import annotations

import dataclasses
import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

from tactbench.core.errors import UnknownNameError, UsageError


@dataclass(frozen=True)
class Fault:
    """A fault from `start_s` until before `end_s`, seconds of the clock that the emulator is given.

    A device's own faults are a frozen subclass with :attr:`known`, and fields of its own for their details.

    Raises
    ------
    UsageError
        For a name that the device does not have, or `every` below 1.
    """

    known: ClassVar[Mapping[str, str]] = {}
    """Names of a device's faults, and what they do."""

    name: str
    start_s: float = -math.inf
    end_s: float = math.inf
    every: int = 1
    """Of the words, frames, lines or datagrams that it could concern: each n-th."""

    def __post_init__(self) -> None:
        if self.name not in self.known:
            raise UnknownNameError("fault", self.name, self.known)
        if self.every < 1:
            raise UsageError(f"The fault {self.name!r} cannot concern every {self.every}.", hint="Give 1 or more.")

    @classmethod
    def parse(cls, text: str) -> Self:
        """Return the fault that ``name`` or ``name:key=value,key=value`` describes, as a rig file writes it.

        Keys are the fields of the class, values are numbers or text; several values of one key are joined by ``+``.

        Raises
        ------
        UsageError
            If name or key is unknown, or a value is not what the field holds.
        """
        name, _, rest = text.partition(":")
        fields = {one.name: str(one.type) for one in dataclasses.fields(cls) if one.name != "name"}
        given: dict[str, Any] = {}
        for key, _, value in (part.partition("=") for part in rest.split(",") if part):
            if key not in fields:
                raise UnknownNameError(f"key of the fault {name!r}", key, fields)
            kind = fields[key].partition("[")[0]
            try:
                given[key] = _READERS.get(kind.partition(" ")[0], str)(value)
            except ValueError:
                raise UsageError(f"The fault {text!r} has {value!r} for {key}.", hint=f"{key} is {kind}.") from None
        return cls(name, **given)

    def active(self, now_s: float) -> bool:
        """Return whether it is on."""
        return self.start_s <= now_s < self.end_s


_READERS: Mapping[str, Callable[[str], Any]] = {
    "frozenset": lambda text: frozenset(text.split("+")),
    "float": float,
    "int": lambda text: int(text, 0),
}
"""By the annotation of a field: what reads its text."""


def fault_concerns(faults: Iterable[Fault], name: str, now_s: float, seen: Counter[Fault]) -> bool:
    """Return whether a fault `name` concerns the next word, line or datagram; `seen` counts those it could concern."""
    concerned = [fault for fault in faults if fault.name == name and fault.active(now_s)]
    seen.update(concerned)
    return any(seen[fault] % fault.every == 0 for fault in concerned)
