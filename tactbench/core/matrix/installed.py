"""Rigs built from what is installed."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tactbench.core.errors import RigError, TactbenchError
from tactbench.core.plugins.interfaces import Operator, ReplayRig, Rig, RigContext
from tactbench.core.plugins.registry import Registry, load_object
from tactbench.core.spec.rig_file import RigFile


def rig_of(
    name: str,
    registry: Registry,
    recordings: Path | None = None,
    rig_file: RigFile | None = None,
    operator: Operator | None = None,
) -> Rig | ReplayRig:
    """Build the rig called `name`; raises UsageError if the rig file is for another one."""
    descriptor = registry.rigs[name]
    if rig_file is not None:
        rig_file.checked_for(name)
    context = RigContext(effects=tuple(registry.effects), recordings=recordings, rig_file=rig_file, operator=operator)
    built = load_object(descriptor.where)(context)
    if not (hasattr(built, "open") or hasattr(built, "recordings")):
        raise RigError(
            f"The rig {name!r} has neither open() nor recordings().", hint="See docs/plugins.md: a Rig or a ReplayRig."
        )
    return built  # type: ignore[no-any-return]


def built(
    name: str,
    registry: Registry,
    recordings: Path | None = None,
    rig_file: RigFile | None = None,
    operator: Operator | None = None,
) -> Rig | ReplayRig:
    """Build the rig called `name`; raises RigError where its own code fails, whatever that raises."""
    with _its_own_code(f"The rig {name!r} could not be built"):
        return rig_of(name, registry, recordings, rig_file, operator)


def listed(name: str, rig: ReplayRig) -> list[Path]:
    """Return the recordings of the rig called `name`; raises RigError where its own code fails."""
    with _its_own_code(f"The recordings of rig {name!r} cannot be listed"):
        return list(rig.recordings())


@contextmanager
def _its_own_code(what: str) -> Iterator[None]:
    try:
        yield
    except TactbenchError:
        raise
    except (Exception, SystemExit) as error:
        said = f"{what}: {type(error).__name__}: {error}".rstrip(": ")
        raise RigError(said + ".", hint="See `tactbench plugins` for who brings it.") from error
