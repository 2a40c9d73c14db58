"""Virtual time: a clock that stands until somebody waits, and then goes on to what happens next."""

from __future__ import annotations

import math

from tactbench.devices.emulation.line import Line


class VirtualTime:
    """A clock, and the emulated devices that live by it: single-threaded, and the same each time.

    It is a :data:`~tactbench.links.link.Clock`: called, it returns nanoseconds, from 0 on.

    Attributes
    ----------
    now_s
        The same in seconds.
    """

    def __init__(self) -> None:
        self.now_s = 0.0
        self._lines: list[Line] = []

    def __call__(self) -> int:
        """Return the present time, nanoseconds."""
        return round(self.now_s * 1e9)

    def add(self, line: Line) -> None:
        """Let a device live by this clock. What several do at one moment happens in the order of adding."""
        self._lines.append(line)

    def advance(self, until_ns: int) -> None:
        """Let all devices go on up to and including `until_ns`; a time that is over changes nothing."""
        while self.step(until_ns * 1e-9):
            pass

    def step(self, until_s: float) -> bool:
        """Go on to the next event of a device and carry it out; without one up to `until_s` go there.

        Returns
        -------
        bool
            Whether there was an event.
        """
        due_s, line = math.inf, None
        for one in self._lines:
            next_s = one.next_s()
            if next_s < due_s:
                due_s, line = next_s, one
        if line is None or due_s > until_s:
            self.now_s = max(self.now_s, until_s)
            return False
        self.now_s = max(self.now_s, due_s)
        line.poll(self.now_s)
        return True
