"""Rigs that move something, with one flaw each; nothing is opened, and a skin lets go of its load at once."""

import os
import signal
from contextlib import contextmanager

import numpy as np

from flawed_tactile.rigs import FORCE, RATE_HZ
from tactbench.plugin import Block, RigDescriptor, hookimpl

TACTBENCH_API = 2
FLAWS = ("that-breaks-off", "that-pulls", "that-overshoots", "that-stays-pressed", "that-does-not-stop")
BLOCK = 20
STOPPED = []
"""Why presses were stopped, in this process."""


class Press:
    """A sound acquisition of a motor's press."""

    def __init__(self, rig, sensor, scene):
        self.plan, self.assumptions = (), {}
        self.streams, self.reference, self.drawn, self.ended = sensor.spec.streams, (FORCE,), {}, ""
        self._flaw, self._rest_n, self._stopped = rig.flaw, rig.left_n, False
        self.clocks, self.stream_counts, self.counts, self.emulation = {}, {}, {}, None
        profile = scene.profile
        self._t_s = np.arange(round(profile.duration.to("s") * RATE_HZ)) / RATE_HZ
        self._force_n = np.interp(self._t_s, *profile.corners)

    def __iter__(self):
        t_ns = np.round(1e9 * self._t_s).astype(np.int64)
        for begin in range(0, len(t_ns), BLOCK):
            rows = slice(begin, begin + BLOCK)
            force = self._force_n[rows] + self._rest_n
            if self._flaw == "that-pulls":
                force = -force
            if self._flaw == "that-overshoots" and 3.0 < self._t_s[begin] < 4.0:
                force = force + 2.0
            if self._flaw == "that-is-interrupted" and self._t_s[begin] == 4.0:
                os.kill(os.getpid(), signal.SIGINT)
            if self._flaw == "that-breaks-off" and self._t_s[begin] > 4.0:
                self.ended = "the belt has slipped"
                return
            if self._stopped and self._flaw != "that-does-not-stop":
                force = 0.0 * force
            for stream in self.streams:
                data = 100.0 + np.outer(np.round(10.0 * force), np.ones(len(stream.channels)))
                yield Block(stream.name, t_ns[rows], data)
            yield Block("force_torque", t_ns[rows], force[:, None])
            if self._stopped and self._flaw != "that-does-not-stop":
                return

    def stop(self, why):
        STOPPED.append(why)
        self._stopped = True
        return ""


class Rig:
    left_n = 0.0

    def __init__(self, flaw):
        self.flaw = flaw

    @contextmanager
    def open(self, sensor, scene, *, seed):
        yield Press(self, sensor, scene)
        if self.flaw == "that-stays-pressed":
            self.left_n = 0.4


def code(flaw):
    return f"moving_rig_{flaw}".replace("-", "_").rstrip("_")


def build(flaw):
    # Each press builds its rig, so what is left of the one before is kept outside.
    kept = Rig(flaw)
    return lambda context: kept


globals().update({code(flaw): build(flaw) for flaw in ("", *FLAWS, "that-is-interrupted")})


@hookimpl
def tactbench_rigs():
    names = {"sound-moving-rig": "", **{f"moving-rig-{flaw}": flaw for flaw in (*FLAWS, "that-is-interrupted")}}
    return [
        RigDescriptor(name=name, title="A motor presses", where=f"flawed_tactile.moving:{code(flaw)}")
        for name, flaw in names.items()
    ]
