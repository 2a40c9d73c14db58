"""Specifications of the eight hooks by which plugins add sensors, rigs, devices, tasks and more.

Each hook returns descriptors: a name, a spec, and in `where` the import path of the code, so that listing plugins
imports no large package.
"""

from __future__ import annotations

from collections.abc import Sequence

import pluggy

from tactbench.core.spec import rig

GROUP = "tactbench"
"""Name of the entry-point group of plugins, and of the pluggy project."""

API_VERSION = 2
"""Version of the plugin interface; a plugin states the version for which it was written: ``TACTBENCH_API = 2``."""

hookspec = pluggy.HookspecMarker(GROUP)
hookimpl = pluggy.HookimplMarker(GROUP)
"""Decorator for the functions of a plugin that implement hooks."""


@hookspec
def tactbench_sensors() -> Sequence[rig.SensorDescriptor]:  # type: ignore[empty-body]
    """Return the descriptors of the plugin's sensors."""


@hookspec
def tactbench_rigs() -> Sequence[rig.RigDescriptor]:  # type: ignore[empty-body]
    """Return the descriptors of the plugin's rigs."""


@hookspec
def tactbench_devices() -> Sequence[rig.DeviceDescriptor]:  # type: ignore[empty-body]
    """Return the descriptors of the plugin's force sensors and motors."""


@hookspec
def tactbench_tasks() -> Sequence[rig.TaskDescriptor]:  # type: ignore[empty-body]
    """Return the descriptors of the plugin's tasks."""


@hookspec
def tactbench_estimators() -> Sequence[rig.EstimatorDescriptor]:  # type: ignore[empty-body]
    """Return the descriptors of the plugin's estimators."""


@hookspec
def tactbench_effects() -> Sequence[rig.EffectDescriptor]:  # type: ignore[empty-body]
    """Return the descriptors of the plugin's simulation effects."""


@hookspec
def tactbench_indenters() -> Sequence[rig.IndenterDescriptor]:  # type: ignore[empty-body]
    """Return the descriptors of the plugin's indenter shapes."""


@hookspec
def tactbench_profiles() -> Sequence[rig.ProfileDescriptor]:  # type: ignore[empty-body]
    """Return the descriptors of the plugin's force profiles."""
