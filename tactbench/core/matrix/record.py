"""Making recordings, in whatever process carries that out."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

from tactbench.core.matrix.plan_recordings import RecordingRequest
from tactbench.core.plugins.interfaces import Operator
from tactbench.core.plugins.registry import Family, Registry
from tactbench.core.plugins.rigs import rig_of
from tactbench.core.spec.rig_file import RigFile

GRACE_S = 5.0
"""Seconds that a real rig has to stand still and close its devices when its time is up."""


class Recorder:
    """Makes one recording after the other; the rig, the same of all of them, is built once.

    Parameters
    ----------
    registry
        Where sensors and rigs are looked up.
    operator
        Who stands at a rig of real devices.
    """

    def __init__(self, registry: Registry, operator: Operator | None) -> None:
        self._operator = operator
        self._built: Any = None
        self._registry = replace(registry, tasks=Family("task"))  # most of what a process would be sent

    def __call__(self, request: RecordingRequest) -> None:
        """Make a recording; raises whatever the rig raises."""
        from tactbench.core.acquisition import acquire

        if self._built is None:
            devices = RigFile.model_validate_json(request.rig_file) if request.rig_file else None
            self._built = devices, rig_of(request.rig, self._registry, rig_file=devices, operator=self._operator)
        devices, built = self._built
        rig = self._registry.rigs[request.rig]
        acquire(
            built,
            self._registry.sensors[request.sensor],
            rig,
            request.scene,
            role=request.role,
            seed=request.seed,
            path=request.path,
            # Simulations run side by side: what they cost is the processor's time. A real rig is waited for.
            clock=time.process_time if rig.simulated else time.perf_counter,
            provenance={},
            rig_file=devices,
        )


def is_computed(request: RecordingRequest, registry: Registry) -> bool:
    """Return whether a scene needs nothing but this machine, and no wall clock."""
    if registry.rigs[request.rig].simulated or not request.rig_file:
        return registry.rigs[request.rig].simulated
    devices = RigFile.model_validate_json(request.rig_file)
    return devices.emulation.time == "virtual" and all(entry.emulated for entry in devices.entries().values())
