"""Emulated boards at the far end of a link, in virtual time."""

from collections import deque

import numpy as np

from tactbench.plugin import Block
from tactbench.plugin.devices import CanFrame, CanLink, DriverSettings, EmulatorSettings
from tactbench.sensors.icub import STREAMS
from tactbench.sensors.icub.driver import FingertipDriver
from tactbench.sensors.icub.emulator import build_emulator

NAMES = [channel.name for channel in STREAMS[0].channels]


def rising(now_s):
    """Return counts that tell taxels and times apart: they fall by one in 20 ms."""
    return {name: 200.0 - number - (int(50 * now_s + 0.25) % 100) for number, name in enumerate(NAMES)}


def emulator(senses=rising, faults=(), **options):
    return build_emulator(EmulatorSettings(senses, np.random.default_rng(1), options, faults))


class VirtualLink(CanLink):
    """A bus whose time goes on while somebody waits for it."""

    def __init__(self, bus):
        super().__init__("can://emulated", self.now_ns)
        self.bus = bus
        self.now_s = 0.0
        self.seen = []
        """All frames on the bus, in order, with their times."""
        self._waiting = deque()

    def now_ns(self):
        return round(1e9 * self.now_s)

    def put(self, frame):
        """Let somebody else on the bus send a frame now."""
        self._take([(None, CanFrame(frame.id, frame.data, frame.extended, self.now_ns()))])

    def receive(self, timeout_s):
        self._usable(timeout_s)
        until_s = self.now_s + timeout_s
        while not self._waiting:
            due_s = self.bus.next_s()
            if due_s > until_s:
                self.now_s = until_s
                raise self._nothing_came(timeout_s)
            self.now_s = max(self.now_s, due_s)
            self._take(self.bus.poll(self.now_s))
        return self._waiting.popleft()

    def send(self, frame):
        self._usable()
        self.seen.append(CanFrame(frame.id, frame.data, frame.extended, self.now_ns()))
        self._take(self.bus.feed(frame, self.now_s))

    def _take(self, sent):
        frames = [frame for _, frame in sent]
        self.seen += frames
        self._waiting += frames

    def _release(self):
        pass


def in_virtual_time(senses=rising, faults=(), **options):
    link = VirtualLink(emulator(senses, faults, **options))
    return FingertipDriver(DriverSettings(lambda: link, STREAMS, options, link.now_ns)), link


def joined(blocks):
    """Return blocks one after the other."""
    return Block("taxels", *(np.concatenate([getattr(one, name) for one in blocks])
                             for name in ("t_ns", "data", "quality")))  # fmt: skip
