"""Keys of recordings and results: digests of all inputs that determine a recording or result.

A key is the digest of its sections: configuration, versions, source of each package (with its descriptors) and data.
``tactbench why`` compares the sections of two keys.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tactbench.core.matrix.plan import Cell
from tactbench.core.plugins.registry import Registry
from tactbench.core.plugins.rigs import taking_part
from tactbench.core.provenance import ANSWERING, RECORDING, digest_of, identity_of, sources_of, versions
from tactbench.core.spec.rig_file import RigFile
from tactbench.core.spec.scene import Role, Scene
from tactbench.core.spec.task import TaskSpec

Sections = dict[str, Any]

_canonical = json.JSONEncoder(sort_keys=True, separators=(",", ":"), default=repr).encode


@dataclass
class Keys:
    """Keys of the recordings and results of one run."""

    registry: Registry

    def of_cell(self, cell: Cell, data: Mapping[Path, str]) -> tuple[str, Sections]:
        """Return the key of a cell's result, and the key's sections; `data` has content digests by recording."""
        task = self.registry.tasks.owned(cell.task)
        return self._of_answer(cell, data, [task.module], task=task.declared or cell.task)

    def of_given(
        self, cell: Cell, task: TaskSpec, how: Mapping[str, Any], data: Mapping[Path, str]
    ) -> tuple[str, Sections]:
        """Return the key, and its sections, of a cell for which a Python caller gives objects, as to `solve`.

        Raises ValueError as :func:`identity_of` does.
        """
        tasks, metric = self.registry.tasks, how["metric"]
        modules = [tasks.owned(task.name).module if task.name in tasks else None]
        given = identity_of({**how, "metric": metric.function or metric.name})
        named = how["given"] is None
        return self._of_answer(cell, data, modules, named, task=digest_of(task.model_dump_json()), given=given)

    def _of_answer(
        self, cell: Cell, data: Mapping[Path, str], modules: list[str | None], named: bool = True, **more: Any
    ) -> tuple[str, Sections]:
        """Return the key of a result and its sections; names of recordings are in the sections, but not in the key."""
        estimator = self.registry.estimators.owned(cell.estimator) if named else None
        modules += [estimator.module, estimator.descriptor.where] if estimator else []
        sections = {
            **more,
            "estimator": cell.estimator,
            "versions": versions(estimator.descriptor.distributions if estimator else ()),
            "source": sources_of(filter(None, modules), ANSWERING),
            "configuration": {
                "sensor": cell.sensor, "protocol": cell.protocol, "split": cell.split, "params": dict(cell.params),
                "seed": cell.seed, "timed": cell.timed, "include incomplete": cell.include_incomplete,
            },
        }  # fmt: skip
        key = digest_of(_canonical({**sections, "data": list(data.values())}))
        return key, {**sections, "data": {path.stem: digest for path, digest in data.items()}}

    def of_recording(
        self, sensor: str, rig: str, scene: Scene, role: Role | None, seed: int, rig_file: RigFile | None = None
    ) -> str:
        """Return the key of a recording to be made by a rig."""
        made_by = self._making(sensor, rig, rig_file, scene)
        return digest_of(_canonical({**made_by, "scene": scene.model_dump(mode="json"), "role": role, "seed": seed}))

    def _making(self, sensor: str, rig: str, rig_file: RigFile | None, scene: Scene) -> Sections:
        """Return the sections of a recording's key, apart from the content of its scene, its role and its seed.

        Notes
        -----
        Recordings of real devices stay valid when the code of drivers changes: such a key covers sensor, rig and
        rig file alone.
        """
        stated = "" if rig_file is None else rig_file.model_dump_json()
        sections: Sections = {"sensor": sensor, "rig": rig, "rig file": stated}
        if rig_file is not None and not rig_file.emulated:
            return sections
        registry, shape = self.registry, scene.indenter.shape
        owner, rigs = registry.sensors.owned(sensor), [rig]
        modules = [owner.module, owner.descriptor.transducer, owner.descriptor.driver]
        if rig_file is not None:
            names = [entry.device for entry in (rig_file.force, *rig_file.devices.values()) if entry is not None]
            modules += [registry.devices.owned(name).module for name in names]
            rigs.append(rig_file.emulation.physics)
        effects = taking_part(registry, owner.descriptor, scene)
        modules += [effect.descriptor.called_for for effect in effects]
        shapes = [shape] if shape is not None and shape in registry.indenters else []  # the rig refuses an unknown one
        makers: list[Any] = [*effects, *map(registry.rigs.owned, rigs), *map(registry.indenters.owned, shapes)]
        modules += [name for one in makers for name in (one.module, one.descriptor.where)]
        return sections | {"versions": versions(), "source": sources_of(filter(None, modules), RECORDING)}


def differences(
    before: Mapping[str, Any], now: Mapping[str, Any], same: Callable[[Any, Any], bool] | None = None, within: str = ""
) -> list[str]:
    """Return one sentence, ``name old -> new``, for each difference of two nested mappings.

    Parameters
    ----------
    same
        Function that compares values that are not mappings; by default as JSON.
    within
        Text at the beginning of each sentence.
    """
    found = []
    for name in sorted({*before, *now}):
        old, new = before.get(name), now.get(name)
        if isinstance(old, Mapping) and isinstance(new, Mapping):
            found += differences(old, new, same, f"{within}{name}: ")
        elif not (same(old, new) if same else _canonical(old) == _canonical(new)):
            found.append(f"{within}{name} {_short(old)} -> {_short(new)}")
    return found


def _short(value: Any) -> str:
    text = "nothing" if value is None else value if isinstance(value, str) else _canonical(value)
    return text if len(text) <= 60 else f"{text[:59]}…"
