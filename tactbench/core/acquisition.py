"""One scene, on one rig, into one recording."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from tactbench.core.plugins.interfaces import Acquisition, Rig
from tactbench.core.recording.writer import RecordingWriter
from tactbench.core.samples import Block
from tactbench.core.spec.recording import RecordingMeta
from tactbench.core.spec.rig import RigDescriptor, SensorDescriptor
from tactbench.core.spec.scene import Role, Scene


class Acquired(NamedTuple):
    """A finished recording."""

    meta: RecordingMeta
    content_digest: str


def acquire(
    rig: Rig,
    sensor: SensorDescriptor,
    descriptor: RigDescriptor,
    scene: Scene,
    *,
    role: Role | None,
    seed: int,
    path: Path,
    clock: Callable[[], float],
    provenance: Mapping[str, Any],
    watch: Callable[[Block], None] | None = None,
) -> Acquired:
    """Carry out `scene` and write what the rig yields to `path`.

    Parameters
    ----------
    rig, descriptor
        The rig, and what it says about itself.
    role
        What the recording is for, or None.
    clock
        Seconds, monotonic; its difference over the scene becomes ``provenance["sim_s"]`` for a simulated rig and
        ``provenance["acquisition_s"]`` otherwise. Writing the file is not counted.
    watch
        Is given every block before it is written; it must not keep or change it, nor wait.

    Raises
    ------
    RigError, NotApplicable
        If the rig cannot carry out the scene; nothing is left behind.
    RecordingError
        If the file cannot be written.
    """
    began = clock()
    with rig.open(sensor, scene, seed=seed) as acquisition:
        meta = _meta(acquisition, sensor, descriptor, scene, role, seed)
        spent = clock() - began
        with RecordingWriter(path, meta) as writer:
            blocks = iter(acquisition)
            while True:
                began = clock()
                block = next(blocks, None)
                spent += clock() - began
                if block is None:
                    break
                if watch is not None:
                    watch(block)
                writer.append(block)
            key = "sim_s" if descriptor.simulated else "acquisition_s"
            writer.revise(
                plan=tuple(acquisition.plan),
                assumptions=dict(acquisition.assumptions),
                drawn=dict(acquisition.drawn),
                remarks=tuple(str(text) for name, text in acquisition.drawn.items() if name.startswith("remark ")),
                provenance={**provenance, key: spent},
            )
    return Acquired(writer.meta, writer.content_digest)


def _meta(
    acquisition: Acquisition,
    sensor: SensorDescriptor,
    descriptor: RigDescriptor,
    scene: Scene,
    role: Role | None,
    seed: int,
) -> RecordingMeta:
    recorded_hz = {stream.name: stream.rate_hz for stream in acquisition.streams}
    own_hz = {stream.name: stream.rate_hz for stream in sensor.spec.streams if stream.rate_hz is not None}
    return RecordingMeta(
        name=scene.name,
        sensor=sensor.spec.model_copy(update={"streams": tuple(acquisition.streams)}),
        own_rates_hz={name: rate for name, rate in own_hz.items() if recorded_hz.get(name, rate) != rate},
        reference=tuple(acquisition.reference),
        rig=descriptor.name,
        simulated=descriptor.simulated,
        clock="device",
        session=scene.session,
        role=role,
        scene=scene,
        labels=dict(scene.labels),
        seed=seed,
    )
