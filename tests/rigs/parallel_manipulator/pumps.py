"""Emulators behind links in virtual time."""

from __future__ import annotations

import numpy as np

from tactbench.devices.emulation.virtual_time import Line, VirtualByteLink, VirtualDatagramLink, VirtualTime
from tactbench.plugin import Block


class VirtualLink(VirtualByteLink, VirtualDatagramLink):
    """An emulator behind a link whose waits move a virtual clock."""

    def __init__(self, emulator, *, begin_s=100.0):
        self.emulator, self.line = emulator, Line(emulator)
        self.clock = VirtualTime([self.line])
        self.clock.now_s = begin_s
        super().__init__("device", self.clock, self.line)

    @property
    def now_s(self):
        return self.clock.now_s

    def arrive(self, data):
        """Let something arrive now that the emulator has not sent."""
        self._arrive(self.now_s, data)

    def go(self, seconds):
        """Let time pass without anybody reading."""
        self.clock.advance(self.clock() + round(1e9 * seconds))


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
