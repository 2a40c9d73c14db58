"""Making recordings, in whatever process carries that out."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

from tactbench.core.matrix.installed import rig_of
from tactbench.core.matrix.plan_recordings import RecordingRequest
from tactbench.core.plugins.interfaces import Operator
from tactbench.core.plugins.registry import Registry
from tactbench.core.plugins.taking_part import taking_part
from tactbench.core.spec.rig_file import RigFile

GRACE_S = 5.0
"""Seconds that a real rig has to stand still and close its devices when its time is up."""


class Recorder:
    """Makes one recording after the other; each rig is built once.

    Parameters
    ----------
    registry
        Where sensors and rigs are looked up.
    operator
        Who stands at a rig of real devices.
    """

    def __init__(self, registry: Registry, operator: Operator | None = None) -> None:
        self._registry, self._operator = registry, operator
        self._rigs: dict[tuple[str, str], Any] = {}

    def __call__(self, request: RecordingRequest) -> str:
        """Make a recording and return its content digest; raises whatever the rig raises."""
        from tactbench.core.acquisition import acquire

        made = request.rig, request.rig_file
        if made not in self._rigs:
            devices = RigFile.model_validate_json(request.rig_file) if request.rig_file else None
            self._rigs[made] = rig_of(request.rig, self._registry, rig_file=devices, operator=self._operator)
        rig = self._registry.rigs[request.rig]
        acquired = acquire(
            self._rigs[made],
            self._registry.sensors[request.sensor],
            rig,
            request.scene,
            role=request.role,
            seed=request.seed,
            path=request.path,
            # Simulations run side by side: what they cost is the processor's time. A real rig is waited for.
            clock=time.process_time if rig.simulated else time.perf_counter,
            provenance={},
        )
        return acquired.content_digest


def recorder_for(
    requests: Sequence[RecordingRequest], registry: Registry, operator: Operator | None = None
) -> Recorder:
    """Return a recorder that knows what `requests` name, and no other plugins' effects and indenters."""
    sensors = dict.fromkeys(request.sensor for request in requests)
    effects = {
        owned.descriptor.name: None
        for request in requests
        for owned in taking_part(registry, registry.sensors[request.sensor], request.scene)
    }
    shapes = dict.fromkeys(request.scene.indenter.shape for request in requests)
    named = registry.only(
        sensors=sensors,
        rigs=dict.fromkeys(request.rig for request in requests),
        effects=effects,
        indenters=[shape for shape in shapes if shape is not None and shape in registry.indenters],
        profiles=registry.profiles.names(),
        devices=registry.devices.names(),
    )
    return Recorder(named, operator)


def is_computed(request: RecordingRequest, registry: Registry) -> bool:
    """Return whether a scene needs nothing but this machine, and no wall clock."""
    if registry.rigs[request.rig].simulated or not request.rig_file:
        return registry.rigs[request.rig].simulated
    devices = RigFile.model_validate_json(request.rig_file)
    return devices.emulation.time == "virtual" and all(entry.emulated for entry in devices.entries().values())
