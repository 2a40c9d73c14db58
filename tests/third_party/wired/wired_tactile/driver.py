"""Asked with ``id``, started with ``go``, stopped with ``stop``; each sample is a line of numbers, its own first."""

import numpy as np

from tactbench.plugin import Block, RigError
from tactbench.plugin.devices import Driver, LinkTimeout
from wired_tactile import PAD, SCALE


class LineDriver(Driver):
    def __init__(self, settings, stream):
        self._stream = stream
        self._clock = settings.clock
        self._link = settings.open_link()
        self._text = b""
        self._odd = 0

    @property
    def streams(self):
        return (self._stream,)

    @property
    def counts(self):
        return {"lines that are no samples": self._odd}

    def identify(self):
        self._link.write(b"id\n")
        lines = self._lines(1.0)
        if not lines:
            raise RigError("It does not say who it is.", hint="Is it a wired device?")
        model, serial = lines[0][1].split()
        return {"model": model.decode(), "serial": serial.decode()}

    def start(self):
        self._link.discard()
        self._text = b""
        self._link.write(b"go\n")

    def read(self, timeout_s):
        rows = []
        for t_ns, line in self._lines(timeout_s):
            try:
                rows.append((t_ns, *map(float, line.split())))
            except ValueError:
                self._odd += 1
        if not rows:
            return []
        table = np.array(rows)
        return [
            Block(
                self._stream.name,
                np.array([row[0] for row in rows], dtype=np.int64),
                table[:, 2:],
                sequence=table[:, 1].astype(np.int64),
            )
        ]

    def _lines(self, timeout_s):
        until_ns = self._clock() + round(timeout_s * 1e9)
        found = []
        while not found:
            try:
                received = self._link.read(max(0.0, (until_ns - self._clock()) * 1e-9))
            except LinkTimeout:
                break
            *lines, self._text = (self._text + received.data).split(b"\n")
            found = [(received.t_ns, line) for line in lines]
        return found

    def stop(self):
        self._link.write(b"stop\n")

    def close(self):
        self._link.close()


def build(settings):
    return LineDriver(settings, PAD)


def scale(settings):
    return LineDriver(settings, SCALE)
