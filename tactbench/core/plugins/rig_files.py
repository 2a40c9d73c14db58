"""Rig files read from disk: what all have in common, and what their own rig asks for."""

from __future__ import annotations

from pathlib import Path

from tactbench.core.plugins.registry import Registry, load_object
from tactbench.core.spec.rig_file import RigFile
from tactbench.core.spec.yaml_file import load_yaml


def load_rig_file(path: Path, registry: Registry) -> RigFile:
    """Return the rig file at `path`, its own settings checked by its rig where that has a model of them.

    Raises
    ------
    ConfigError
        If it cannot be read, or says something unknown or wrong; the message names the line.
    UnknownNameError
        If no such rig is installed.
    """
    file = load_yaml(path, RigFile)
    where = registry.rigs[file.rig].file
    if where is not None:
        load_yaml(path, load_object(where))
    return file
