"""The rig; nothing is opened."""

from contextlib import contextmanager

import numpy as np

from tactbench.plugin import Block, ChannelSpec, StreamSpec

FZ = ChannelSpec(name="fz", kind="force", unit="N", sign=1)
FORCE = StreamSpec(name="force_torque", rate_hz=100.0, channels=(FZ,))


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


class Rig:
    @contextmanager
    def open(self, sensor, scene, *, seed):
        yield Ramp(sensor, scene, seed)


def build(context):
    return Rig()
