"""Rigs built from what is installed, and the files that say which devices they have."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tactbench.core.errors import RigError, TactbenchError, error_text
from tactbench.core.plugins.interfaces import Operator, ReplayRig, Rig
from tactbench.core.plugins.registry import Registry, load_object
from tactbench.core.plugins.taking_part import rig_context
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
    physics = file.emulation.physics or registry.first_rig("simulated")
    return file.model_copy(update={"emulation": file.emulation.model_copy(update={"physics": physics})})


def rig_of(
    name: str,
    registry: Registry,
    recordings: Path | None = None,
    rig_file: RigFile | None = None,
    operator: Operator | None = None,
) -> Rig | ReplayRig:
    """Build the rig called `name`.

    Raises
    ------
    UsageError
        If the rig file is for another one.
    RigError
        If its own code fails, whatever that raises, or its devices cannot be emulated.
    """
    descriptor = registry.rigs[name]
    if rig_file is not None:
        rig_file.checked_for(name)
    context = rig_context(registry, recordings=recordings, rig_file=rig_file, operator=operator)
    with failing_as(f"The rig {name!r} could not be built"):
        built: Rig | ReplayRig = load_object(descriptor.where)(context)
    return built


@contextmanager
def failing_as(what: str) -> Iterator[None]:
    """Raise RigError, whose message begins with `what`, in place of whatever a rig's own code raises."""
    try:
        yield
    except TactbenchError:
        raise
    except (Exception, SystemExit) as error:
        raise RigError(
            f"{what}: {error_text(error)}.", hint="See `tactbench list plugins` for who brings it."
        ) from error
