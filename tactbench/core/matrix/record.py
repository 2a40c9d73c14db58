"""Making recordings, in whatever process carries that out."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

from tactbench.core.plugins.interfaces import Operator, RecordingRequest
from tactbench.core.plugins.registry import Family, Registry
from tactbench.core.plugins.rigs import rig_of

GRACE_S = 5.0
"""Seconds that a real rig has to stand still and close its devices when its time is up."""


class Recorder:
    """Makes one recording after the other; the rig, the same of all of them, is built once.

    Parameters
    ----------
    registry
        What the rig is built from.
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
            self._built = rig_of(request.rig.name, self._registry, rig_file=request.rig_file, operator=self._operator)
        # Simulations run side by side: what they cost is the processor's time. A real rig is waited for.
        acquire(self._built, request, clock=time.process_time if request.rig.simulated else time.perf_counter)


def is_computed(request: RecordingRequest) -> bool:
    """Return whether a scene needs nothing but this machine, and no wall clock."""
    simulated, devices = request.rig.simulated, request.rig_file
    if simulated or devices is None:
        return simulated
    return devices.emulation.time == "virtual" and all(entry.emulated for entry in devices.entries().values())
