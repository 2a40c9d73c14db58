"""Imports at first use: names of a module, and additions of other packages of tactbench to the core."""

import sys
from collections.abc import Callable, Mapping
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any


def on_demand(door: str) -> Callable[[str], Any]:
    """Return a ``__getattr__`` for module `door` that imports, at first use, its names of :func:`public_names`.

    With it, a listing of plugins or a command that shows its help imports neither numpy nor links.
    """

    def imported(name: str) -> Any:
        if name not in _modules(door):
            raise AttributeError(f"module {door!r} has no attribute {name!r}")
        found = getattr(import_module(_modules(door)[name]), name)
        setattr(sys.modules[door], name, found)
        return found

    return imported


def public_names(door: str) -> list[str]:
    """Return the names that a module's source imports as themselves, like ``import Rig as Rig``."""
    return [*_modules(door)]


@cache
def _modules(door: str) -> Mapping[str, str]:
    """Return the module of each of the :func:`public_names`."""
    import ast

    tree = ast.parse(Path(sys.modules[door].__file__ or "").read_text(encoding="utf-8"))
    imports = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    return {alias.name: node.module or "" for node in imports for alias in node.names if alias.asname == alias.name}


def contributed(group: str) -> Mapping[str, Any]:
    """Return the additions of other packages of tactbench to the core, by name, from entry points."""
    from importlib.metadata import distribution

    return {point.name: point for point in sorted(distribution("tactbench").entry_points.select(group=group))}
