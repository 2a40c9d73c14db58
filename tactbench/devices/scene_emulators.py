"""Emulated devices of a rig file, and the simulated scenes that they sense, in this process or in another process.

In virtual time the devices are in the process of the rig. In real time `tactbench emulate` serves them in a process of
its own, which the rig's work cannot delay; there a simulated rig carries out each scene requested by the rig. The
devices are at rest until the recording begins.
"""

from __future__ import annotations

import json
import socket
from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any, Protocol

from tactbench.core.errors import NotApplicable, RigError, TactbenchError, UsageError
from tactbench.core.plugins.interfaces import Acquisition, Rig
from tactbench.core.plugins.registry import Registry, load_object
from tactbench.core.plugins.rigs import rig_context
from tactbench.core.samples import Block, join_blocks
from tactbench.core.spec.recording import PlanEntry
from tactbench.core.spec.rig import SensorDescriptor
from tactbench.core.spec.rig_file import FORCE, RigFile
from tactbench.core.spec.scene import Scene
from tactbench.core.spec.sensor import StreamSpec
from tactbench.devices.emulation.real_time import RealTimeDevices
from tactbench.devices.emulation.virtual_time import EmulatedDevice
from tactbench.devices.rig_devices import descriptor_of, emulators_of, options_of

PREPARE_S = 300.0
"""Timeout for the simulation of a scene in another process [s]."""
BEGIN_S = 5.0
"""Timeout for the begin of a scene in another process [s]."""
LISTEN_S = 0.2
"""Longest wait for a message [s], after which the devices are checked for errors."""


class SceneSamples:
    """A scene as :data:`~tactbench.devices.emulator.Senses`: each channel's latest sample up to a given time.

    Each channel holds its value until its next sample, so that the samples of sensor and force sensor stay as
    simultaneous as they were simulated. Before and after the scene nothing is pressed: the samples of its first
    `rest_s` seconds, before pressing began, repeat, offsets and noise included. :meth:`start` begins the scene.

    Parameters
    ----------
    streams
        Streams of the sensor and the force sensor.
    blocks
        Their blocks, with times in nanoseconds since the begin of the scene.
    duration_s
        Length of the scene [s].
    rest_s
        Length of the scene's unloaded beginning [s]; 0: only the first sample is held.
    """

    def __init__(
        self, streams: Sequence[StreamSpec], blocks: Iterable[Block], duration_s: float, *, rest_s: float = 0.0
    ) -> None:
        self._end_ns, self._rest_ns = round(1e9 * duration_s), round(1e9 * min(rest_s, duration_s))
        self._start_s: float | None = None
        came, self._tracks = list(blocks), []
        for stream in streams:
            own = [block for block in came if block.stream == stream.name]
            if own and (whole := join_blocks(own)).t_ns is not None:
                names = tuple(channel.name for channel in stream.channels)
                self._tracks.append((whole.t_ns.tolist(), names, whole.data.tolist()))
        self._last: tuple[tuple[int, ...], Mapping[str, float]] = (), {}

    def start(self, at_s: float) -> None:
        """Let the scene begin at `at_s` on the devices' clock; a scene may be begun several times."""
        self._start_s = at_s

    def __call__(self, t_s: float) -> Mapping[str, float]:
        """Return the value of every channel, in its unit, at the time `t_s` of the devices' clock [s]."""
        since_ns = round(1e9 * (t_s - (self._start_s or 0.0)))
        if self._start_s is None or not 0 <= since_ns < self._end_ns:
            since_ns = since_ns % self._rest_ns if self._rest_ns else 0
        rows = tuple(max(bisect_right(times, since_ns) - 1, 0) for times, _, _ in self._tracks)
        if rows != self._last[0]:
            found: dict[str, float] = {}
            for row, (_, names, samples) in zip(rows, self._tracks, strict=True):
                found.update(zip(names, samples[row], strict=True))
            self._last = rows, found
        return self._last[1]


class RigEmulators(Protocol):
    """Emulators of a rig, for several scenes; made by ``RigDescriptor.emulators`` from a rig file and a registry."""

    devices: Mapping[str, EmulatedDevice]
    """Devices by their name in the rig file; at rest before the first scene."""

    def prepare(self, simulated: Acquisition, sensor: SensorDescriptor, scene: Scene, seed: int) -> None:
        """Take a scene's samples, recorded by the simulated rig; the sensor is not pressed before :meth:`begin`."""

    def begin(self, at_s: float) -> None:
        """Let the scene begin at a time of the devices' clock [s]."""


class SceneEmulators(RigEmulators):
    """Emulators of sensors and a force sensor that replay the samples of a simulated rig; nothing moves."""

    def __init__(self, file: RigFile, registry: Registry) -> None:
        self._samples: SceneSamples | None = None
        devices: dict[str, EmulatedDevice] = {}
        for sensor in file.sensors:
            devices |= emulators_of(file, registry, sensor, self._sensed)
        self.devices = devices

    def _sensed(self, t_s: float) -> Mapping[str, float]:
        return {} if self._samples is None else self._samples(t_s)

    def prepare(self, simulated: Acquisition, sensor: SensorDescriptor, scene: Scene, seed: int) -> None:
        """Take the samples of a scene from the simulated rig."""
        profile = scene.profile
        streams = (*simulated.streams, *simulated.reference)
        self._samples = SceneSamples(streams, simulated, profile.duration.to("s"), rest_s=profile.hold_s)

    def begin(self, at_s: float) -> None:
        """Let the prepared scene begin."""
        if self._samples is not None:
            self._samples.start(at_s)


def serve(
    file: RigFile, registry: Registry, *, started: Callable[[RigFile], None], progress: Callable[[str], None]
) -> None:
    """Run the emulated devices of a rig file in real time, until interrupted.

    Parameters
    ----------
    started
        Function called once with the rig file that opens the devices.
    progress
        Function called with a message for each scene that is prepared or begins.

    Raises
    ------
    UsageError
        If a device, option or fault is not known, or has no emulator.
    """
    physics = physics_of(file, registry)
    where = registry.rigs[file.rig].emulators
    emulators: RigEmulators = (load_object(where) if where else SceneEmulators)(file, registry)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as control, RealTimeDevices(emulators.devices) as emulated:
        control.bind(("127.0.0.1", 0))
        control.settimeout(LISTEN_S)
        started(_opening(file, registry, emulated.addresses, f"127.0.0.1:{control.getsockname()[1]}"))
        while True:
            emulated.check()
            try:
                data, peer = control.recvfrom(65536)
            except TimeoutError:
                continue
            request, answer = json.loads(data), dict[str, Any]()
            try:
                if request.get("begin"):
                    emulators.begin(emulated.clock() * 1e-9)
                    progress("The scene begins")
                else:
                    sensor, scene = registry.sensors[request["sensor"]], Scene.model_validate(request["scene"])
                    with physics.open(sensor, scene, seed=request["seed"]) as simulated:
                        emulators.prepare(simulated, sensor, scene, request["seed"])
                        answer = {
                            "plan": [entry.model_dump(mode="json") for entry in simulated.plan],
                            "assumptions": dict(simulated.assumptions),
                            "drawn": dict(simulated.drawn),
                        }
                    progress(f"Ready for {scene.name}: {sensor.name}, {scene.indenter}")
            except TactbenchError as error:
                answer = {"error": error.message, "hint": error.hint, "skip": isinstance(error, NotApplicable)}
            control.sendto(json.dumps(answer).encode(), peer)


def _opening(file: RigFile, registry: Registry, addresses: Mapping[str, str], control: str) -> RigFile:
    """Return a rig file with the addresses of the emulated devices' links."""
    plain, entries = file.model_dump(), file.entries()
    for name, address in addresses.items():
        part = plain if name == FORCE else plain["sensors" if name in file.sensors else "devices"]
        options = options_of(descriptor_of(registry, name, entries[name]), entries[name])
        part[name].update(link=address, options=options, faults=(), emulator=True)
    plain["emulation"]["control"] = control
    return type(file).model_validate(plain)


class ScenePhysics(Rig):
    """Simulation of the scenes that a rig's emulated devices sense.

    Parameters
    ----------
    rig
        The simulated rig; None: it runs in the process of the emulated devices, or no device is emulated.
    control
        Address ``host:port`` of the devices' process, from ``emulation: control`` of a rig file; empty: no such
        process, and without a rig nothing is simulated.
    """

    def __init__(self, rig: Rig | None, control: str = "") -> None:
        self._rig, self._control = rig, control

    @contextmanager
    def open(self, sensor: SensorDescriptor, scene: Scene, *, seed: int) -> Iterator[Acquisition]:
        """Simulate a scene; if another process does so, the samples stay there for its devices until :meth:`begin`.

        Raises
        ------
        NotApplicable, RigError
            If the scene cannot be carried out, or the other process does not answer.
        """
        if self._rig is not None:
            with self._rig.open(sensor, scene, seed=seed) as simulated:
                yield simulated
            return
        if not self._control:
            nothing: Any = SimpleNamespace(plan=(), assumptions={}, drawn={})
            yield nothing
            return
        request = {"sensor": sensor.name, "scene": scene.model_dump(mode="json"), "seed": seed}
        answer = self._request(request, PREPARE_S)
        plan = tuple(map(PlanEntry.model_validate, answer.pop("plan")))
        without_streams: Any = SimpleNamespace(plan=plan, **answer)
        yield without_streams

    def begin(self) -> None:
        """Let the scene begin in the other process; raises the errors of :meth:`open`."""
        if self._control:
            self._request({"begin": True}, BEGIN_S)

    def _request(self, message: dict[str, Any], timeout_s: float) -> dict[str, Any]:
        host, _, port = self._control.rpartition(":")
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
            link.settimeout(timeout_s)
            try:
                link.connect((host, int(port)))
                link.send(json.dumps(message).encode())
                answer: dict[str, Any] = json.loads(link.recv(65536))
            except OSError as error:
                raise RigError(
                    f"The emulated devices at {self._control} do not answer: {error}.",
                    hint="Start the devices again with `tactbench emulate`.",
                ) from error
        if "error" in answer:
            raise (NotApplicable if answer["skip"] else RigError)(answer["error"], hint=answer["hint"])
        return answer


def physics_of(file: RigFile, registry: Registry) -> ScenePhysics:
    """Return the simulation of scenes for a rig's emulated devices, if it has any.

    Raises
    ------
    UsageError
        If the rig under `physics` is not a simulation.
    """
    if not file.emulated:
        return ScenePhysics(None, file.emulation.control)
    descriptor = registry.rigs[file.emulation.physics or registry.first_rig("simulated")]
    if not descriptor.simulated:
        raise UsageError(
            f"`physics: {descriptor.name}` in the rig file is not a simulated rig.", hint="Use `physics: twin`."
        )
    return ScenePhysics(load_object(descriptor.where)(rig_context(registry)))
