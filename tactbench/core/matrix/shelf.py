"""Recordings that exist already: what they are, and which of them cannot be read."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from tactbench.core.errors import MissingRecordingError, UnknownNameError
from tactbench.core.matrix.engine import EngineChoice
from tactbench.core.matrix.recorded import Recorded, Subject, read_all, read_subject
from tactbench.core.plugins.registry import Registry
from tactbench.core.spec.task import TaskSpec

UNKNOWN = "unknown"
"""Sensor of recordings that cannot be read and lie where nothing tells whose they are."""


@dataclass(frozen=True)
class Holdings:
    """What a shelf holds."""

    recordings: Mapping[str, Mapping[Path, Subject]]
    """By name of sensor."""
    unreadable: Mapping[str, Mapping[Path, BaseException]] = field(default_factory=dict)
    """What could not be read, and why, by name of the sensor that it seems to be of."""

    @property
    def sensors(self) -> list[str]:
        """Names of the sensors, in order."""
        return sorted({*self.recordings, *self.unreadable})


def holdings(
    paths: Sequence[Path], asked: Sequence[str], registry: Registry, recorded: Recorded, choice: EngineChoice
) -> Holdings:
    """Look at the recordings of a shelf, in a process of its own: one that breaks the reader breaks nothing else.

    Raises
    ------
    MissingRecordingError
        If there are none.
    """
    if not paths:
        raise MissingRecordingError("The shelf is empty.", hint="Import recordings with `tactbench import`.")
    found: dict[str, dict[Path, Subject]] = {}
    broken = read_all(read_subject, recorded.unread(paths, "sensor"), recorded, choice)
    for path in paths:
        if path not in broken:
            subject = recorded.subject(path)
            found.setdefault(subject.sensor, {})[path] = subject
    unreadable: dict[str, dict[Path, BaseException]] = {}
    for path, error in broken.items():
        unreadable.setdefault(_owner(path, list(asked) or list(found), registry), {})[path] = error
    return Holdings(found, unreadable)


def _owner(path: Path, sensors: Sequence[str], registry: Registry) -> str:
    """Return whose recording this seems to be: a folder above has the name of a sensor, or there is one only."""
    for folder in path.parent.parts[::-1]:
        if folder in sensors or folder in registry.sensors:
            return folder
    return sensors[0] if len(sensors) == 1 else UNKNOWN


def sensors_on(shelf: Holdings, asked: Iterable[str]) -> list[str]:
    """Return the sensors to run: those asked for, or all that the shelf has recordings of."""
    names = list(asked)
    for name in names:
        if name not in shelf.sensors:
            raise UnknownNameError("sensor in these recordings", name, shelf.sensors)
    return names or shelf.sensors


def serving(
    task: TaskSpec, split: str | None, sensor: str, shelf: Holdings, registry: Registry
) -> tuple[list[Path], BaseException | None]:
    """Return the recordings of a sensor that belong to `task` under `split`, and why one of them cannot be read.

    A recording of a scene that some task planned serves the campaigns that plan a scene of this name; a recording whose
    scene nobody planned (an imported table) may serve any task. One that cannot be read is taken for a recording of the
    scene that its file is named after, and otherwise for one that would have served.
    """
    names = {planned.scene.name for planned in task.scenes_for(split)}
    readable = [
        path
        for path, (_, scene) in shelf.recordings.get(sensor, {}).items()
        if scene is None or not names or scene in names
    ]
    broken = shelf.unreadable.get(sensor, {})
    if not broken:
        return readable, None
    others = {planned.scene.name for known in registry.tasks for planned in known.spec.scenes_for(split)} - names
    for path, error in broken.items():
        if not names or path.stem.rpartition("-")[0] not in others:
            return readable, error
    return readable, None
