"""Acquisition of requested recordings."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

from tactbench.core.plugins.interfaces import Operator, RecordingRequest
from tactbench.core.plugins.registry import Family, Registry
from tactbench.core.plugins.rigs import rig_of, taking_part

GRACE_S = 5.0
"""Seconds for a real rig to stop and close its devices after a timeout."""


class Recorder:
    """Makes recordings one after the other; their rig, from `registry`, is built once."""

    def __init__(self, registry: Registry, operator: Operator | None) -> None:
        self._operator = operator
        self._built: Any = None
        self._registry = replace(registry, tasks=Family("task"))  # tasks would be most of the pickled data

    def __call__(self, request: RecordingRequest) -> None:
        """Make a recording; raises whatever the rig raises."""
        from tactbench.core.acquisition import acquire

        if self._built is None:
            self._built = rig_of(request.rig.name, self._registry, rig_file=request.rig_file, operator=self._operator)
        # The cost of a simulation is processor time, since several run at once; that of a real rig is wall time.
        acquire(self._built, request, clock=time.process_time if request.rig.simulated else time.perf_counter)


def foreign_components(registry: Registry, request: RecordingRequest) -> tuple[str, ...]:
    """Return the names of effects and of an indenter of other packages that making a recording may import."""
    effects, indenters = taking_part(registry, request.sensor, request.scene), registry.indenters
    shape = str(request.scene.indenter.shape)
    foreign = [shape] if shape in indenters and not indenters.owned(shape).ours else []
    return (*(one.descriptor.name for one in effects if not one.ours), *foreign)


def is_computed(request: RecordingRequest) -> bool:
    """Return whether a recording is computed on this machine, without real devices and wall-clock time."""
    simulated, devices = request.rig.simulated, request.rig_file
    if simulated or devices is None:
        return simulated
    return all(entry.emulated for entry in devices.entries().values())
