"""The rigs; nothing is opened, and a skin lets go of its load at once."""

import os
import signal
from contextlib import contextmanager

import numpy as np

from tactbench.plugin import Block, ChannelSpec, StreamSpec

FZ = ChannelSpec(name="fz", kind="force", unit="N", sign=1)
FORCE = StreamSpec(name="force_torque", rate_hz=100.0, channels=(FZ,))
STOPPED = []
LEFT_N = 0.0


class Ramp:
    plan, assumptions, drawn, reference = (), {}, {}, (FORCE,)

    def __init__(self, sensor, scene, seed):
        self.streams = tuple(stream.model_copy(update={"rate_hz": 100.0}) for stream in sensor.spec.streams)
        self.t_s = np.arange(round(100 * scene.profile.duration.to("s"))) / 100.0
        self.force = np.interp(self.t_s, *scene.profile.corners)
        self.rng = np.random.default_rng(seed)

    def __iter__(self):
        t_ns = np.round(self.t_s * 1e9).astype(np.int64)
        for stream in self.streams:
            rest = np.array([channel.rest.value for channel in stream.channels])
            data = np.round(rest - 10.0 * self.force[:, None] * np.linspace(0.5, 1.0, len(rest)))
            yield Block(stream.name, t_ns, data)
        yield Block("force_torque", t_ns, (self.force + self.rng.normal(0.0, 0.002, len(t_ns)))[:, None])


class Press(Ramp):
    """A motor's press, block by block."""

    clocks, stream_counts, counts, emulation, ended = {}, {}, {}, None, ""
    stopped, signal_at = False, None

    def __iter__(self):
        for begin in range(0, len(self.t_s), 20):
            rows = slice(begin, begin + 20)
            t_ns = np.round(1e9 * self.t_s[rows]).astype(np.int64)
            force = self.force[rows] + LEFT_N
            if begin == self.signal_at:
                os.kill(os.getpid(), signal.SIGINT)
            if self.stopped:
                force = 0.0 * force
            for stream in self.streams:
                data = 100.0 + np.outer(np.round(10.0 * force), np.ones(len(stream.channels)))
                yield Block(stream.name, t_ns, data)
            yield Block("force_torque", t_ns, force[:, None])
            if self.stopped:
                return

    def stop(self, why):
        STOPPED.append(why)
        self.stopped = True
        return ""


class Rig:
    made = Ramp

    @contextmanager
    def open(self, sensor, scene, *, seed):
        yield self.made(sensor, scene, seed)


class PressRig(Rig):
    made = Press


def build(context):
    return Rig()


def build_press(context):
    return PressRig()
