"""The eight hooks of plugins.

Each hook returns descriptors: a name, a spec, and *where* the code is as an import string, so that listing plugins
imports nothing heavy.
"""

from __future__ import annotations

from collections.abc import Sequence

import pluggy

from tactbench.core.spec.rig import (
    DeviceDescriptor,
    EffectDescriptor,
    EstimatorDescriptor,
    IndenterDescriptor,
    ProfileDescriptor,
    RigDescriptor,
    SensorDescriptor,
    TaskDescriptor,
)

GROUP = "tactbench"
"""Entry-point group, and the name of the pluggy project."""

API_VERSION = 2
"""Version of the plugin interface; a plugin states the one that it was written for: ``TACTBENCH_API = 2``."""

hookspec = pluggy.HookspecMarker(GROUP)
hookimpl = pluggy.HookimplMarker(GROUP)
"""Decorator of the functions by which a plugin implements the hooks."""


@hookspec
def tactbench_sensors() -> Sequence[SensorDescriptor]:  # type: ignore[empty-body]
    """Return the sensors of the plugin."""


@hookspec
def tactbench_rigs() -> Sequence[RigDescriptor]:  # type: ignore[empty-body]
    """Return the rigs of the plugin."""


@hookspec
def tactbench_devices() -> Sequence[DeviceDescriptor]:  # type: ignore[empty-body]
    """Return the force sensors and motors of the plugin."""


@hookspec
def tactbench_tasks() -> Sequence[TaskDescriptor]:  # type: ignore[empty-body]
    """Return the tasks of the plugin."""


@hookspec
def tactbench_estimators() -> Sequence[EstimatorDescriptor]:  # type: ignore[empty-body]
    """Return the estimators of the plugin."""


@hookspec
def tactbench_effects() -> Sequence[EffectDescriptor]:  # type: ignore[empty-body]
    """Return the simulation effects of the plugin."""


@hookspec
def tactbench_indenters() -> Sequence[IndenterDescriptor]:  # type: ignore[empty-body]
    """Return the shapes of indenters of the plugin."""


@hookspec
def tactbench_profiles() -> Sequence[ProfileDescriptor]:  # type: ignore[empty-body]
    """Return the force profiles of the plugin."""
