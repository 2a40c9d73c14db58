"""Something wrong with an emulated device, by name and time."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import ClassVar

from tactbench.plugin import UsageError


@dataclass(frozen=True)
class Fault:
    """A fault from `start_s` until before `end_s`, seconds of the clock that the emulator is given.

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
    """Of the lines or datagrams that it could concern: each n-th."""

    def __post_init__(self) -> None:
        if self.name not in self.known:
            raise UsageError(f"There is no fault called {self.name!r}.", hint=f"Known: {', '.join(self.known)}.")
        if self.every < 1:
            raise UsageError(f"The fault {self.name!r} cannot concern every {self.every}.", hint="Give 1 or more.")

    def active(self, now_s: float) -> bool:
        """Return whether it is on."""
        return self.start_s <= now_s < self.end_s


def concerned(faults: Iterable[Fault], name: str, now_s: float, seen: Counter[Fault]) -> bool:
    """Return whether a fault `name` concerns the next line or datagram; `seen` counts those it could concern."""
    hit = False
    for fault in faults:
        if fault.name == name and fault.active(now_s):
            seen[fault] += 1
            hit |= seen[fault] % fault.every == 0
    return hit
