"""Emulators behind links in virtual time."""

from __future__ import annotations

from collections import deque

import numpy as np

from tactbench.plugin import Block
from tactbench.plugin.devices import ByteLink, DatagramLink, Link, LinkUnplugged, Received


class VirtualLink(ByteLink, DatagramLink):
    """An emulator behind a link whose waits move a virtual clock: from one event of the emulator to the next.

    `begin_s` is when the clock starts; `unplugged_s` when the cable is pulled.
    """

    def __init__(self, emulator, *, begin_s=100.0, unplugged_s=float("inf")):
        self.now_s = begin_s
        Link.__init__(self, "virtual", self.clock)
        self.emulator = emulator
        self.unplugged_s = unplugged_s
        self.arrived = deque()

    def clock(self):
        return round(self.now_s * 1e9)

    def _release(self):
        pass

    def _check(self):
        self._usable()
        if self.now_s >= self.unplugged_s:
            raise LinkUnplugged("The cable was pulled.")

    def send(self, data):
        self._check()
        self.arrived.extend(self.emulator.feed(data, self.now_s))

    write = send

    def _wait(self, timeout_s):
        self._check()
        end_s = self.now_s + timeout_s
        self.arrived.extend(self.emulator.poll(self.now_s))
        while not self.arrived and self.now_s < end_s:
            self.now_s = min(max(self.emulator.next_s(), self.now_s), end_s)
            self._check()
            self.arrived.extend(self.emulator.poll(self.now_s))
        if not self.arrived:
            raise self._nothing_came(timeout_s)

    def receive(self, timeout_s):
        self._wait(timeout_s)
        sent_s, data = self.arrived.popleft()
        return Received(data, round(sent_s * 1e9))

    def read(self, timeout_s):
        self._wait(timeout_s)
        first_s = self.arrived[0][0]
        data = b"".join(piece for _, piece in self.arrived)
        self.arrived.clear()
        return Received(data, round(first_s * 1e9))

    def go(self, seconds):
        """Let time pass without anybody reading."""
        end_s = self.now_s + seconds
        while self.now_s < end_s:
            self.now_s = min(max(self.emulator.next_s(), self.now_s + 1e-6), end_s)
            self.arrived.extend(self.emulator.poll(self.now_s))


def read_for(driver, link, seconds):
    """Return one block of all rows of some time."""
    blocks, end_ns = [], link.clock() + round(1e9 * seconds)
    while link.clock() < end_ns:
        blocks += driver.read((end_ns - link.clock()) / 1e9)
    marks = [np.zeros(b.data.shape, np.uint8) if b.quality is None else b.quality for b in blocks]

    def joined(name):
        return np.concatenate([getattr(block, name) for block in blocks])

    return Block(
        blocks[0].stream, joined("t_ns"), joined("data"), np.concatenate(marks), joined("sequence"), joined("device_ns")
    )
