"""The code behind the rigs. All of them carry out a scene by yielding a ramp of force; if they come to it."""

import os
import time
from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType

import numpy as np

from tactbench.plugin import Block, ChannelSpec, StreamSpec

FORCE = StreamSpec(name="force_torque", channels=(ChannelSpec(name="fz", kind="force", unit="N"),))
SECOND = "flat-validation"
"""The second scene of the task `force`."""


class Ramp:
    plan, reference = (), (FORCE,)
    assumptions = drawn = MappingProxyType({})

    def __init__(self, sensor):
        self.streams = sensor.spec.streams

    def __iter__(self):
        t_ns = np.arange(500, dtype=np.int64) * 10_000_000
        force = np.linspace(0.0, 5.0, 500)
        for stream in self.streams:
            gains = np.arange(1, len(stream.channels) + 1)
            yield Block(stream.name, t_ns, (100 + np.outer(force, gains)).astype(stream.dtype))
        yield Block("force_torque", t_ns, force[:, None])


class Rig:
    def __init__(self, happens):
        self.happens = happens

    @contextmanager
    def open(self, sensor, scene, *, seed):
        try:
            self.happens(scene)
            yield Ramp(sensor)
        finally:
            with Path("let-go-of").open("a") as file:
                file.write(f"{scene.name}\n")


def unbuilt(context):
    raise OSError("no such port: /dev/ttyEVIL0")


def _dying(scene):
    if scene.name == SECOND:
        os.abort()


def _stuck(scene):
    if scene.name == SECOND:
        print("stuck in", scene.name, flush=True)
        time.sleep(3600)


def dying(context):
    return Rig(_dying)


def device(context):
    return Rig(_stuck)
