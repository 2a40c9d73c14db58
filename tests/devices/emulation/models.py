"""Small devices as models, one for each kind of link."""

from __future__ import annotations

import math
from collections import deque

from tactbench.plugin.devices import CanFrame, Senses


class Recorder:
    """Sends a record every `period_s` from power-on on: its number, what it senses, and a drawn number."""

    def __init__(self, period_s=0.01, senses: Senses = lambda t_s: {}, rng=None, can=False):
        self._period_s, self._senses, self._rng, self._can = period_s, senses, rng, can
        self._sent = 0

    def feed(self, piece, now_s):
        return self.poll(now_s)

    def poll(self, now_s):
        out = []
        while self.next_s() <= now_s:
            t_s = self.next_s()
            drawn = 0 if self._rng is None else int(self._rng.integers(256))
            sensed = round(self._senses(t_s).get("a", 0.0))
            data = bytes([self._sent & 0xFF, sensed & 0xFF, drawn])
            out.append((t_s, CanFrame(0x123, data) if self._can else data))
            self._sent += 1
        return out

    def next_s(self):
        return (self._sent + 1) * self._period_s


class Answerer:
    """Gives back what it is told, `after_s` later."""

    def __init__(self, after_s=0.2):
        self._after_s = after_s
        self._due = deque()
        self.told = []

    def feed(self, piece, now_s):
        self.told.append((now_s, piece))
        self._due.append((now_s + self._after_s, piece))
        return self.poll(now_s)

    def poll(self, now_s):
        out = []
        while self._due and self._due[0][0] <= now_s:
            out.append(self._due.popleft())
        return out

    def next_s(self):
        return self._due[0][0] if self._due else math.inf


class Complement:
    """On an SPI bus: answers each byte's complement."""

    def exchange(self, select, data, now_s):
        return bytes(255 - byte for byte in data)
