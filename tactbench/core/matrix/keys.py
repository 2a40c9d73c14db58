"""Keys: what decides a recording or a result, and nothing else, in one digest.

What decides is listed in sections: the configuration, the descriptors, the versions, the source of each package, the
data. A key is a digest of the sections' digests; the sections themselves are what ``tactbench why`` compares.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from tactbench.core.files import sha256
from tactbench.core.matrix.plan import Cell
from tactbench.core.plugins.registry import Registry
from tactbench.core.plugins.taking_part import taking_part
from tactbench.core.provenance.source import Source, SourceDigests, versions
from tactbench.core.spec.rig_file import RigFile
from tactbench.core.spec.scene import Role, Scene

_NOT_IN_THE_KEY = {"published", "equivalence", "reference_score", "title", "question", "scenes", "campaigns"}
"""Of a task: what changes no number, and what its recordings say themselves, by their content."""

Section = Mapping[str, Any]

KEY_DIGITS = 32
"""Of a SHA-256, which a key is."""


class Fixed(NamedTuple):
    """Sections that many keys share."""

    digest: str
    sections: Mapping[str, Section]


_canonical = json.JSONEncoder(sort_keys=True, separators=(",", ":"), allow_nan=True, default=repr).encode


@dataclass
class Keys:
    """The keys of one run: what does not change from cell to cell is worked out once."""

    registry: Registry
    """Where descriptors and their owners are looked up."""
    sources: SourceDigests = field(default_factory=SourceDigests)
    """Digests of the owners' packages."""
    _answers: dict[tuple[str, str], Fixed] = field(default_factory=dict)
    _makers: dict[tuple[Any, ...], Fixed] = field(default_factory=dict)
    _data: dict[tuple[str, ...], str] = field(default_factory=dict)

    def of_cell(self, cell: Cell, data: Sequence[str]) -> str:
        """Return the key of a cell's result; `data` are the content digests of its recordings, in order."""
        several = tuple(data)
        if several not in self._data:
            self._data[several] = sha256("\n".join(several))[:KEY_DIGITS]
        digests = f"{self.shared_by_cells(cell).digest} {self._data[several]}"
        return sha256(f"{digests} {_canonical(configuration_of(cell))}")[:KEY_DIGITS]

    def shared_by_cells(self, cell: Cell) -> Fixed:
        """Return what all cells of one task and one estimator share."""
        pair = cell.task, cell.estimator
        if pair not in self._answers:
            task, estimator = self.registry.tasks.owned(cell.task), self.registry.estimators.owned(cell.estimator)
            code = [task.descriptor.spec.features_by, estimator.descriptor.where]
            modules = [task.module, estimator.module, *(where for where in code if where)]
            source = self.sources.behind(modules, "answer")
            self._answers[pair] = _fixed(
                source,
                estimator.descriptor.distributions,
                task=task.descriptor.spec.model_dump(exclude=_NOT_IN_THE_KEY),
                estimator=estimator.descriptor.model_dump(exclude={"title", "linear", "rehearsal"}),
            )
        return self._answers[pair]

    def of_recording(self, sensor: str, rig: str, scene: Scene, role: Role, seed: int, rig_file: str = "") -> str:
        """Return the key of a recording that `rig` is to make of `scene`."""
        made_by = self.maker(sensor, rig, rig_file, scene)
        return sha256(f"{made_by.digest} {_canonical([scene.model_dump(), role, seed])}")[:KEY_DIGITS]

    def maker(self, sensor: str, rig: str, rig_file: str, scene: Scene) -> Fixed:
        """Return what all recordings by one rig of one sensor share whose scenes name the same indenter and effects.

        What real devices gave is no less true once the code that read them has changed: of them it is sensor, rig and
        rig file alone, so that nobody has to press everything again.
        """
        shape = scene.indenter.shape
        made = sensor, rig, rig_file, shape, scene.simulation.effects
        if made not in self._makers:
            devices = RigFile.model_validate_json(rig_file) if rig_file else None
            if devices is not None and not devices.emulated:
                sections = {"sensor": {"name": sensor}, "rig": {"name": rig, "file": rig_file}}
                return Fixed(sha256(_canonical(sections))[:KEY_DIGITS], sections)
            maker, carrier = self.registry.sensors.owned(sensor), self.registry.rigs.owned(rig)
            effects = taking_part(self.registry, maker.descriptor, scene)
            modules = [maker.module, carrier.module, carrier.descriptor.where]
            modules += [where for where in (maker.descriptor.transducer, maker.descriptor.driver) if where]
            modules += [] if devices is None else self._behind(devices)
            for effect in effects:
                modules += [effect.module, effect.descriptor.where, effect.descriptor.called_for]
            named = {}
            if shape is not None and shape in self.registry.indenters:  # of an unknown one the rig itself complains
                body = self.registry.indenters.owned(shape)
                modules += [body.module, body.descriptor.where]
                named["indenter"] = body.descriptor.model_dump(exclude={"title"})
            self._makers[made] = _fixed(
                self.sources.behind(modules, "recording"),
                (),
                sensor=maker.descriptor.model_dump(),
                rig=carrier.descriptor.model_dump(),
                effects={owner.descriptor.name: owner.descriptor.model_dump() for owner in effects},
                **({"rig file": {"says": rig_file}} if rig_file else {}),
                **named,
            )
        return self._makers[made]

    def _behind(self, devices: RigFile) -> list[str]:
        """Return where the code of the devices of a rig file is, and of the simulation that moves the emulated ones."""
        names = [entry.device for entry in (devices.force, *devices.devices.values()) if entry is not None]
        owners = [self.registry.devices.owned(name) for name in names]
        physics = self.registry.rigs.owned(devices.emulation.physics)
        return [*(owner.module for owner in owners), physics.module, physics.descriptor.where]


def configuration_of(cell: Cell) -> Section:
    """Return what a cell's key covers of its configuration. Its number among the repeats is not: the seed is."""
    return {
        "sensor": cell.sensor,
        "protocol": cell.protocol,
        "split": cell.split,
        "params": dict(cell.params),
        "seed": cell.seed,
        **({} if cell.latency else {"latency": False}),
    }


def _fixed(source: Source, distributions: tuple[str, ...], **descriptors: Section) -> Fixed:
    sections: dict[str, Section] = dict(descriptors)
    imported = {f"import {name}": found for name, found in source.versions.items()}
    sections["versions"] = {**versions(distributions), **imported}
    sections.update({f"source of {package}": files for package, files in source.packages.items()})
    return Fixed(sha256(_canonical(sections))[:KEY_DIGITS], sections)
