"""A pad that sends a line of text for each sample once it is told ``go``; and drivers of it with one flaw each."""

import math
from contextlib import suppress

import numpy as np

from tactbench.plugin import Block, UsageError
from tactbench.plugin.devices import Driver, LinkTimeout, LinkUnplugged

PERIOD_S = 0.01


class Pad:
    """The device."""

    def __init__(self, settings):
        self._senses, self._sent, self._began_s = settings.senses, 0, None

    def feed(self, piece, now_s):
        told = bytes(piece)
        if b"go" in told:
            self._began_s, self._sent = now_s, 0
        if b"stop" in told:
            self._began_s = None
        return [*((now_s, b"pad 1\n") for _ in range(told.count(b"id"))), *self.poll(now_s)]

    def poll(self, now_s):
        out = []
        while self.next_s() <= now_s:
            t_s = self.next_s()
            values = self._senses(t_s).values()
            out.append((t_s, " ".join(str(round(value)) for value in values).encode() + b"\n"))
            self._sent += 1
        return out

    def next_s(self):
        return math.inf if self._began_s is None else self._began_s + (self._sent + 1) * PERIOD_S


def build_emulator(settings):
    return Pad(settings)


class PadDriver(Driver):
    """The sound driver."""

    known = frozenset()

    def __init__(self, settings):
        if set(settings.options) - self.known:
            raise UsageError(f"It has no option {min(settings.options)!r}.")
        self._streams, self._clock, self._text, self._rows = settings.streams, settings.clock, b"", 0
        self._link = settings.open_link()

    @property
    def streams(self):
        return self._streams

    @property
    def counts(self):
        return {}

    def identify(self):
        self._link.write(b"id\n")
        return {"model": self._link.read(1.0).data.decode().strip()}

    def start(self):
        self._link.write(b"go\n")

    def stop(self):
        with suppress(LinkUnplugged):
            self._link.write(b"stop\n")

    def close(self):
        self._link.close()

    def read(self, timeout_s):
        try:
            received = self._link.read(timeout_s)
        except LinkTimeout:
            return []
        *lines, self._text = (self._text + received.data).split(b"\n")
        return self.blocks([[float(word) for word in line.split()] for line in lines], received.t_ns)

    def blocks(self, rows, t_ns):
        if not rows:
            return []
        numbers = np.arange(self._rows, self._rows + len(rows), dtype=np.int64)
        self._rows += len(rows)
        times = np.full(len(rows), t_ns, dtype=np.int64)
        return [Block(self._streams[0].name, times, np.array(rows), sequence=numbers)]


sound = PadDriver


class opens_two_lines(PadDriver):
    def __init__(self, settings):
        super().__init__(settings)
        self._link.close()
        self._link = settings.open_link()


class is_a_number(PadDriver):
    def identify(self):
        return {"serial": 7}


class has_a_stream_of_its_own(PadDriver):
    @property
    def streams(self):
        return (self._streams[0].model_copy(update={"name": "mine"}),)


class goes_back_in_time(PadDriver):
    def blocks(self, rows, t_ns):
        return [
            Block(block.stream, -block.t_ns, block.data, sequence=block.sequence)
            for block in super().blocks(rows, t_ns)
        ]


class swaps_taxels(PadDriver):
    def blocks(self, rows, t_ns):
        return super().blocks([row[::-1] for row in rows], t_ns)


class doubles_samples(PadDriver):
    def blocks(self, rows, t_ns):
        return super().blocks(rows * 2, t_ns)


class keeps_what_waited(PadDriver):
    """It lets the device send from its opening on."""

    def __init__(self, settings):
        super().__init__(settings)
        self._link.write(b"go\n")

    def start(self):
        pass


class waits_anyhow(PadDriver):
    def read(self, timeout_s):
        until_ns, found = self._clock() + 200_000_000, []
        while self._clock() < until_ns:
            found += super().read(0.05)
        return found


class leaves_its_line_open(PadDriver):
    def close(self):
        self.stop()


class hides_the_unplugging(PadDriver):
    def read(self, timeout_s):
        try:
            return super().read(timeout_s)
        except LinkUnplugged:
            return []


class takes_any_option(PadDriver):
    known = frozenset({"no_such_option"})
