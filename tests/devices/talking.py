"""A plugin of devices that send what they sense as JSON datagrams."""

import json
from typing import ClassVar

import numpy as np

from tactbench.plugin import Block, ChannelSpec, SensorDescriptor, StreamSpec, UsageError, hookimpl
from tactbench.plugin.devices import DeviceDescriptor, Driver, LinkTimeout
from tactbench.sensors.ideal import SPEC

TACTBENCH_API = 2
HERE = "tests.devices.talking"
WHERE = {"driver": f"{HERE}:TalkingDriver", "emulator": f"{HERE}:build_emulator", "emulated_link": "datagram"}


@hookimpl
def tactbench_sensors():
    pad = SPEC.model_copy(update={"name": "pad"})
    return [
        SensorDescriptor(spec=pad, transducer="tactbench.sensors.ideal:build", **WHERE),
        SensorDescriptor(spec=pad.model_copy(update={"name": "mute"})),
    ]


@hookimpl
def tactbench_devices():
    return [
        DeviceDescriptor(name="scale", title="a scale", kind="force", emulated_options={"unit": "N"}, **WHERE),
        DeviceDescriptor(name="bare-scale", title="a scale", kind="force", driver=f"{HERE}:TalkingDriver"),
        DeviceDescriptor(name="screw", title="a motor", kind="motor", **WHERE),
    ]


class Talker:
    """Sends what it senses every 10 ms, with a drawn number."""

    def __init__(self, settings):
        self._settings, self._sent = settings, 0

    def feed(self, piece, now_s):
        return self.poll(now_s)

    def poll(self, now_s):
        out = []
        while (t_s := self.next_s()) <= now_s:
            said = {"senses": dict(self._settings.senses(t_s)), "drawn": int(self._settings.rng.integers(1 << 30))}
            out.append((t_s, json.dumps(said).encode()))
            self._sent += 1
        return out

    def next_s(self):
        return (self._sent + 1) * 0.01


def build_emulator(settings):
    if settings.faults:
        raise UsageError(f"It has no fault {settings.faults[0]!r}.")
    return Talker(settings)


class TalkingDriver(Driver):
    streams = ()
    counts: ClassVar = {}

    def __init__(self, settings):
        if set(settings.options) - {"baud", "unit"}:
            raise UsageError(f"It has no option {next(iter(settings.options))!r}.")
        if not settings.streams and "unit" not in settings.options:
            raise UsageError("A scale needs the option 'unit'.")
        fz = StreamSpec(name="scale", channels=(ChannelSpec(name="fz", kind="force", unit="N"),))
        self.streams = settings.streams or (fz,)
        self._link = settings.open_link()

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
        rows = {one.name: [[senses.get(channel.name, np.nan) for channel in one.channels]] for one in self.streams}
        return [Block(name, np.array([came.t_ns]), np.array(row)) for name, row in rows.items()]

    def stop(self):
        pass

    def close(self):
        self._link.close()
