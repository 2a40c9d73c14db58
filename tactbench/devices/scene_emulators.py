"""The emulated devices of a rig file, and the simulated scenes that move them, in this process or in one of their own.

In real time a recording's own work would hold up the devices that it reads: they run in another process, in which a
simulated rig carries out the scene that the recording is of. The devices are at rest until the recording begins.
"""

from __future__ import annotations

import atexit
import json
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any, Protocol

from tactbench.core.errors import NotApplicable, RigError, TactbenchError, UsageError
from tactbench.core.plugins.interfaces import Acquisition, Rig
from tactbench.core.plugins.registry import Registry, load_object, load_registry
from tactbench.core.plugins.rigs import rig_context
from tactbench.core.spec.recording import PlanEntry
from tactbench.core.spec.rig import SensorDescriptor
from tactbench.core.spec.rig_file import FORCE, RigFile
from tactbench.core.spec.scene import Scene
from tactbench.devices.emulation.emulated_devices import EmulatedDevice, EmulatedDevices
from tactbench.devices.emulation.scene_samples import SceneSamples
from tactbench.devices.rig_devices import descriptor_of, emulators_of, options_of

PREPARE_S = 300.0
"""Longest wait for a scene to be simulated."""
BEGIN_S = 5.0
LISTEN_S = 0.2
"""How often a server looks whether its devices are whole, and whether it is to end."""


class RigEmulators(Protocol):
    """What ``RigDescriptor.emulators`` makes of a rig file and a registry: emulators that outlive scenes."""

    devices: Mapping[str, EmulatedDevice]
    """By their names in the rig file; at rest before the first scene."""

    def prepare(self, simulated: Acquisition, sensor: SensorDescriptor, scene: Scene, seed: int) -> None:
        """Take what the simulated rig has recorded of a scene; nothing is pressed before :meth:`begin`."""

    def begin(self, at_s: float) -> None:
        """Let the scene begin, at a second of the devices' clock."""


class SceneEmulators(RigEmulators):
    """Emulators of sensors and a force sensor that sense what a simulated rig has recorded; nothing moves."""

    def __init__(self, file: RigFile, registry: Registry) -> None:
        self._samples: SceneSamples | None = None
        devices: dict[str, EmulatedDevice] = {}
        for sensor in file.sensors:
            devices |= emulators_of(file, registry, sensor, self._sensed)
        self.devices = devices

    def _sensed(self, t_s: float) -> Mapping[str, float]:
        return {} if self._samples is None else self._samples(t_s)

    def prepare(self, simulated: Acquisition, sensor: SensorDescriptor, scene: Scene, seed: int) -> None:
        """Take a scene."""
        profile = scene.profile
        streams = (*simulated.streams, *simulated.reference)
        self._samples = SceneSamples(streams, simulated, profile.duration.to("s"), rest_s=profile.hold_s)

    def begin(self, at_s: float) -> None:
        """Press."""
        if self._samples is not None:
            self._samples.start(at_s)


def serve(
    file: RigFile,
    registry: Registry,
    *,
    started: Callable[[RigFile], None],
    over: Callable[[], bool] = lambda: False,
    told: Callable[[str], None] = lambda text: None,
) -> None:
    """Run the emulated devices of a rig file in real time, until `over` or an interrupt.

    Parameters
    ----------
    started
        Called with the rig file that opens them.
    told
        Called with a sentence for each scene that begins.

    Raises
    ------
    UsageError
        If a device, option or fault is not known, or has no emulator.
    """
    physics = physics_of(file, registry)
    where = registry.rigs[file.rig].emulators
    emulators: RigEmulators = (load_object(where) if where else SceneEmulators)(file, registry)
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as control,
        EmulatedDevices(emulators.devices, time="real") as emulated,
    ):
        control.bind(("127.0.0.1", 0))
        control.settimeout(LISTEN_S)
        started(_opening(file, registry, emulated.addresses, f"127.0.0.1:{control.getsockname()[1]}"))
        while not over():
            emulated.advance(emulated.clock())  # raises what an emulator has raised
            try:
                data, peer = control.recvfrom(65536)
            except TimeoutError:
                continue
            asked = json.loads(data)
            answer: dict[str, Any] = {}
            try:
                if asked.get("begin"):
                    emulators.begin(emulated.clock() * 1e-9)
                    told("The scene begins")
                elif physics is not None:
                    sensor, scene = registry.sensors[asked["sensor"]], Scene.model_validate(asked["scene"])
                    with physics.open(sensor, scene, seed=asked["seed"]) as simulated:
                        emulators.prepare(simulated, sensor, scene, asked["seed"])
                        answer = {
                            "plan": [entry.model_dump(mode="json") for entry in simulated.plan],
                            "assumptions": dict(simulated.assumptions),
                            "drawn": dict(simulated.drawn),
                        }
                    told(f"Ready for {scene.name}: {sensor.name}, {scene.indenter}")
            except TactbenchError as error:
                answer = {"error": error.message, "hint": error.hint, "skip": isinstance(error, NotApplicable)}
            control.sendto(json.dumps(answer).encode(), peer)


def _opening(file: RigFile, registry: Registry, addresses: Mapping[str, str], control: str) -> RigFile:
    """Return the rig file that opens emulated devices at their addresses."""

    def at(name: str, entry: Any) -> Any:
        if name not in addresses:
            return entry
        options = options_of(descriptor_of(registry, name, entry), entry)
        return entry.model_copy(update={"link": addresses[name], "options": options, "faults": (), "emulator": True})

    update: dict[str, Any] = {
        "sensors": {name: at(name, entry) for name, entry in file.sensors.items()},
        "devices": {name: at(name, entry) for name, entry in file.devices.items()},
        "emulation": file.emulation.model_copy(update={"time": "real", "control": control}),
    }
    if file.force is not None:
        update["force"] = at(FORCE, file.force)
    return file.model_copy(update=update)


class ScenePhysics(Rig):
    """What carries out the scenes that move a rig's emulated devices.

    Parameters
    ----------
    rig
        The simulated rig; None: it is in the process that the devices are in.
    control
        Where that process listens, ``host:port``, as ``emulation: control`` of a rig file says.
    """

    def __init__(self, rig: Rig | None, control: str = "") -> None:
        self._rig, self._control = rig, control

    @contextmanager
    def open(self, sensor: SensorDescriptor, scene: Scene, *, seed: int) -> Iterator[Acquisition]:
        """Carry out a scene; in another process its samples stay there, for the devices, until :meth:`begin`.

        Raises
        ------
        NotApplicable, RigError
            If it cannot be, or nobody answers.
        """
        if self._rig is not None:
            with self._rig.open(sensor, scene, seed=seed) as simulated:
                yield simulated
            return
        said = self._ask({"sensor": sensor.name, "scene": scene.model_dump(mode="json"), "seed": seed}, PREPARE_S)
        said["plan"] = tuple(map(PlanEntry.model_validate, said["plan"]))
        there: Any = SimpleNamespace(**said)  # an Acquisition without streams
        yield there

    def begin(self) -> None:
        """Let the scene begin in the other process; raises as :meth:`open`."""
        if self._rig is None:
            self._ask({"begin": True}, BEGIN_S)

    def _ask(self, message: dict[str, Any], timeout_s: float) -> dict[str, Any]:
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
                    hint="Start them again: `tactbench emulate`.",
                ) from error
        if "error" in answer:
            raise (NotApplicable if answer["skip"] else RigError)(answer["error"], hint=answer["hint"])
        return answer


def physics_of(file: RigFile, registry: Registry) -> ScenePhysics | None:
    """Return what carries out the scenes that move a rig's emulated devices; None: it has none.

    Raises
    ------
    UsageError
        If the file names a rig that is no simulation.
    """
    if not file.emulated:
        return ScenePhysics(None, file.emulation.control) if file.emulation.control else None
    descriptor = registry.rigs[file.emulation.physics or registry.first_rig("simulated")]
    if not descriptor.simulated:
        raise UsageError(
            f"`physics: {descriptor.name}` in the rig file is no simulated rig.", hint="Use `physics: twin`."
        )
    return ScenePhysics(load_object(descriptor.where)(rig_context(registry)))


class _Child:
    """The process of one rig file's emulators; it ends when its stdin is closed, or this process is gone."""

    def __init__(self, file: RigFile) -> None:
        code = "from tactbench.devices.scene_emulators import main; main()"
        self.process = subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write(file.model_dump_json().encode() + b"\n")
        self.process.stdin.flush()
        said = json.loads(self.process.stdout.readline() or '{"error": "its process ended", "hint": ""}')
        if "error" in said:
            self.close()
            raise RigError(f"The devices cannot be emulated: {said['error']}", hint=said["hint"])
        self.file = RigFile.model_validate(said)

    def close(self) -> None:
        try:
            self.process.communicate(timeout=10.0)  # it closes its stdin
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.communicate()


_children: dict[str, _Child] = {}
"""By rig file; at most one."""


def running(file: RigFile) -> RigFile:
    """Return a rig file whose devices can be opened: emulated ones in real time run in a process of their own.

    They go on until another file's are asked for, or this process ends. A file without such devices comes back as it
    is.

    Raises
    ------
    RigError
        If they cannot be emulated.
    """
    if not file.emulated or file.emulation.time == "virtual":
        return file
    key = file.model_dump_json()
    child = _children.get(key)
    if child is None or child.process.poll() is not None:
        end_running()
        child = _children[key] = _Child(file)
    return child.file


def end_running() -> None:
    """End the emulators that run in a process of their own."""
    while _children:
        _children.popitem()[1].close()


atexit.register(end_running)


def main() -> None:
    """Serve the rig file of the first line of stdin; end when stdin does."""
    for number in {signal.SIGINT, getattr(signal, "SIGHUP", signal.SIGINT)}:
        signal.signal(number, signal.SIG_IGN)  # of the whole terminal: who reads the devices has to end first
    over = threading.Event()
    file = RigFile.model_validate_json(sys.stdin.readline())

    def listen() -> None:
        sys.stdin.read()
        over.set()

    threading.Thread(target=listen, daemon=True).start()
    try:
        serve(file, load_registry(), started=lambda live: print(live.model_dump_json(), flush=True), over=over.is_set)
    except TactbenchError as error:
        print(json.dumps({"error": error.message, "hint": error.hint}), flush=True)
