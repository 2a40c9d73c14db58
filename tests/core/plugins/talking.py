"""A plugin of a pad and a scale that send what they sense as JSON datagrams, and of a motor that is silent."""

from __future__ import annotations

import json
import math

import numpy as np

from tactbench.plugin import Block, ChannelSpec, SensorDescriptor, StreamSpec, UsageError, hookimpl
from tactbench.plugin.devices import DatagramLink, DeviceDescriptor, Driver, LinkTimeout
from tactbench.sensors.ideal import SPEC

TACTBENCH_API = 1
HERE = "tests.core.plugins.talking"


@hookimpl
def tactbench_sensors():
    where = {"driver": f"{HERE}:build_driver", "emulator": f"{HERE}:build_emulator", "emulated_link": "datagram"}
    pad = SPEC.model_copy(update={"name": "pad"})
    return [
        SensorDescriptor(spec=pad, transducer="tactbench.sensors.ideal.transduction:build", **where),
        SensorDescriptor(spec=pad.model_copy(update={"name": "mute"})),
    ]


@hookimpl
def tactbench_devices():
    where = {"driver": f"{HERE}:build_driver", "emulated_link": "datagram"}
    return [
        DeviceDescriptor(
            name="scale",
            title="a scale",
            kind="force",
            emulator=f"{HERE}:build_emulator",
            emulated_options={"unit": "N"},
            **where,
        ),
        DeviceDescriptor(name="bare-scale", title="a scale", kind="force", driver=f"{HERE}:build_driver"),
        DeviceDescriptor(name="screw", title="a motor", kind="motor", emulator=f"{HERE}:build_emulator", **where),
    ]


class Talker:
    """Sends what it senses every 10 ms, with a drawn number."""

    def __init__(self, settings):
        self._settings = settings
        self._sent = 0

    def feed(self, piece, now_s):
        return self.poll(now_s)

    def poll(self, now_s):
        out = []
        while self.next_s() <= now_s:
            t_s = self.next_s()
            said = {"senses": dict(self._settings.senses(t_s)), "drawn": int(self._settings.rng.integers(1 << 30))}
            out.append((t_s, json.dumps(said).encode()))
            self._sent += 1
        return out

    def next_s(self):
        return math.inf if self._settings.options.get("silent") else (self._sent + 1) * 0.01


def build_emulator(settings):
    if settings.faults:
        raise UsageError(f"It has no fault {settings.faults[0]!r}.")
    return Talker(settings)


class TalkingDriver(Driver):
    """Reads them."""

    def __init__(self, settings):
        if set(settings.options) - {"silent", "baud", "unit"}:
            raise UsageError(f"It has no option {next(iter(settings.options))!r}.")
        if not settings.streams and "unit" not in settings.options:
            raise UsageError("A scale needs the option 'unit'.")
        fz = StreamSpec(name="scale", channels=(ChannelSpec(name="fz", kind="force", unit="N"),))
        self._streams = settings.streams or (fz,)
        self._clock = settings.clock
        self._link = settings.open_link()
        assert isinstance(self._link, DatagramLink)

    @property
    def streams(self):
        return self._streams

    @property
    def counts(self):
        return {}

    def identify(self):
        return {}

    def start(self):
        self._link.send(b"start")

    def read(self, timeout_s):
        try:
            came = self._link.receive(timeout_s)
        except LinkTimeout:
            return []
        senses = json.loads(came.data)["senses"]
        return [
            Block(
                stream.name,
                np.array([came.t_ns]),
                np.array([[senses.get(channel.name, math.nan) for channel in stream.channels]]),
            )
            for stream in self.streams
        ]

    def stop(self):
        pass

    def close(self):
        self._link.close()


def build_driver(settings):
    return TalkingDriver(settings)
