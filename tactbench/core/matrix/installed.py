"""What is installed in this process: the registry, and rigs built from it."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from tactbench.core.errors import RigError
from tactbench.core.plugins.interfaces import Rig, RigContext, Shelf
from tactbench.core.plugins.registry import Registry, load_object, load_registry


@lru_cache(maxsize=1)
def installed() -> Registry:
    """Return the registry of this process."""
    return load_registry()


def rig_of(name: str, registry: Registry, recordings: Path | None = None) -> Rig | Shelf:
    """Build the rig called `name`."""
    descriptor = registry.rigs[name]
    built = load_object(descriptor.where)(RigContext(effects=tuple(registry.effects), recordings=recordings))
    if not (hasattr(built, "open") or hasattr(built, "recordings")):
        raise RigError(
            f"The rig {name!r} has neither open() nor recordings().", hint="See docs/plugins.md: a Rig or a Shelf."
        )
    return built  # type: ignore[no-any-return]
