"""The registry of plugins: each is loaded separately, and a failure to load one is kept as a row.

A plugin that fails on import does not affect others; a name that two plugins define is refused, with both named; a
misspelt hook is an error. Plugins of other distributions are imported in child processes, which return data: effects
of an import on its process do not reach other plugins.
"""

from __future__ import annotations

import importlib
import re
from collections.abc import Iterable, Iterator, Mapping
from copy import copy
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import Distribution, EntryPoint, entry_points
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any, Generic, Literal, NamedTuple, TypeVar, cast, get_args

import pluggy

from tactbench.core.errors import (
    DuplicateNameError,
    PluginContractError,
    PluginError,
    UnknownNameError,
    UsageError,
    error_text,
)
from tactbench.core.plugins import hookspecs
from tactbench.core.spec import rig

Descriptor = (
    rig.SensorDescriptor | rig.RigDescriptor | rig.DeviceDescriptor | rig.TaskDescriptor | rig.EstimatorDescriptor
    | rig.EffectDescriptor | rig.IndenterDescriptor | rig.ProfileDescriptor
)  # fmt: skip
D = TypeVar("D", bound=Descriptor)


class PluginRow(NamedTuple):
    """A plugin's entry point, and the error if it could not be loaded."""

    entry_point: str
    module: str
    distribution: str
    version: str
    status: Literal["loaded", "failed"]
    brings: tuple[str, ...] = ()
    reason: str = ""


class Owned(NamedTuple, Generic[D]):
    """A descriptor, and the plugin that defines it."""

    descriptor: D
    module: str
    distribution: str
    version: str
    declared: str = ""
    """JSON declaration of a task that came with recordings; empty: a plugin defines the descriptor."""

    @property
    def ours(self) -> bool:
        """True if the plugin is part of this package, and hence safe to import."""
        return _is_built_in(self.module)


@dataclass
class Family(Generic[D]):
    """All descriptors of one kind, such as sensors, by name."""

    kind: str
    _found: dict[str, list[Owned[D]]] = field(default_factory=dict)

    def add(self, owned: Owned[D]) -> None:
        """Add a descriptor; a name that was added twice is refused on use."""
        self._found.setdefault(owned.descriptor.name, []).append(owned)

    def owned(self, name: str) -> Owned[D]:
        """Return the descriptor called `name` with its plugin; raise UnknownNameError or DuplicateNameError."""
        if name not in self._found:
            raise UnknownNameError(self.kind, name, self.names())
        if len(self._found[name]) > 1:
            raise self._refusal(name)
        return self._found[name][0]

    def __getitem__(self, name: str) -> D:
        return self.owned(name).descriptor

    def __contains__(self, name: object) -> bool:
        return name in self._found

    def __iter__(self) -> Iterator[D]:
        return (owned.descriptor for owned in self.all_owned())

    def all_owned(self) -> list[Owned[D]]:
        """Return the descriptors whose names are unique, with their plugins, sorted by name."""
        return [owners[0] for _, owners in sorted(self._found.items()) if len(owners) == 1]

    def names(self) -> list[str]:
        """Return the unique names of the descriptors, sorted."""
        return [descriptor.name for descriptor in self]

    def refused(self) -> list[DuplicateNameError]:
        """Return one error for every name that two or more plugins define."""
        return [self._refusal(name) for name, owners in sorted(self._found.items()) if len(owners) > 1]

    def _refusal(self, name: str) -> DuplicateNameError:
        where = [f"{owner.distribution} ({owner.module})" for owner in self._found[name]]
        return DuplicateNameError(self.kind, name, where)


class Registry:
    """All installed descriptors, by kind."""

    def __init__(self) -> None:
        self.sensors: Family[rig.SensorDescriptor] = Family("sensor")
        self.rigs: Family[rig.RigDescriptor] = Family("rig")
        self.devices: Family[rig.DeviceDescriptor] = Family("device")
        self.tasks: Family[rig.TaskDescriptor] = Family("task")
        self.estimators: Family[rig.EstimatorDescriptor] = Family("estimator")
        self.effects: Family[rig.EffectDescriptor] = Family("effect")
        self.indenters: Family[rig.IndenterDescriptor] = Family("indenter")
        self.profiles: Family[rig.ProfileDescriptor] = Family("profile")
        self.plugins: list[PluginRow] = []

    def with_tasks(self, tasks: Family[rig.TaskDescriptor]) -> Registry:
        """Return the registry with `tasks` in place of its tasks."""
        found = copy(self)
        found.tasks = tasks
        return found

    def families(self) -> Mapping[str, Family[Any]]:
        """Return the groups of descriptors by the plural in the name of their hook, such as ``sensors``."""
        return {name: getattr(self, name) for name in _KINDS}

    def first_rig(self, kind: Literal["simulated", "replays"]) -> str:
        """Return a kind's default rig: the first of tactbench, or else any first; raise UsageError if there is none."""
        able = [one for one in self.rigs.all_owned() if getattr(one.descriptor, kind)]
        if not able:
            raise UsageError(f"No rig of kind {kind!r} is installed.", hint="See `tactbench list plugins`.")
        return min(able, key=lambda one: not one.ours).descriptor.name

    @property
    def failures(self) -> list[PluginRow]:
        """Plugins that could not be loaded, with their errors."""
        return [row for row in self.plugins if row.status == "failed"]

    @property
    def refused(self) -> list[DuplicateNameError]:
        """Errors for names that two or more plugins define."""
        return [error for family in self.families().values() for error in family.refused()]


_KINDS: dict[str, type[Any]] = {
    f"{kind.__name__.removesuffix('Descriptor').lower()}s": kind for kind in get_args(Descriptor)
}
"""Classes of descriptors by the plural in the names of hooks: ``sensors`` -> SensorDescriptor."""


def load_registry(points: Iterable[EntryPoint] | None = None, *, timeout_s: float = 20.0) -> Registry:
    """Load every plugin of the entry-point group, each separately from the others.

    A bad plugin raises no error: it has a row in the registry. The import of a plugin and its hooks may take
    `timeout_s` [s]; `points` are entry points to load instead of the installed ones.
    """
    registry = Registry()
    found = entry_points(group=hookspecs.GROUP) if points is None else points
    unique = {(point.name, point.value, _owner(point.dist)): point for point in found}
    foreign = [(point.name, point.value) for point in unique.values() if not _is_built_in(point.module)]
    answers: dict[tuple[str, str], Any] = {}
    if foreign:
        from tactbench.core.pool import Limits, Pool

        answers = dict(Pool(1, Limits(timeout_s=timeout_s)).each(_describe, sorted(foreign)))
    for (name, module, owner), point in sorted(unique.items()):
        _add(registry, point, owner, answers.get((name, module)))
    return registry


@cache
def installed() -> Registry:
    """Return the registry of this process; it is loaded at the first call."""
    return load_registry()


def _is_built_in(module: str) -> bool:
    return module.partition(".")[0] == __name__.partition(".")[0]


def _add(registry: Registry, point: EntryPoint, owner: tuple[str, str], reply: Any) -> None:
    """Add the descriptors of a plugin, from the `reply` of a child process, or imported here if built in."""
    try:
        if isinstance(reply, BaseException):
            raise reply
        if reply is None:
            offered = ask_plugin(point)
        else:
            offered = {name: [_KINDS[name].model_validate(one) for one in several] for name, several in reply.items()}
    except Exception as error:
        reason = str(error) if isinstance(error, PluginError) else getattr(error, "message", error_text(error))
        reason += line_in(point.module, getattr(error, "traceback_text", ""))
        registry.plugins.append(PluginRow(point.name, point.value, *owner, "failed", (), reason))
        return
    for family, descriptors in offered.items():
        for descriptor in descriptors:
            registry.families()[family].add(Owned(descriptor, point.value, *owner))
    brings = tuple(f"{family[:-1]} {one.name}" for family, descriptors in offered.items() for one in descriptors)
    registry.plugins.append(PluginRow(point.name, point.value, *owner, "loaded", brings))


def line_in(module: str, trace: str) -> str:
    """Return `` (file, line N)`` of the innermost line of `trace` in a plugin's own package; empty if there is none."""
    package = re.escape(module.partition(".")[0])
    own = re.findall(rf'File "[^"]*/({package}[/.][^"]*)", line (\d+)', trace)
    return f" ({own[-1][0]}, line {own[-1][1]})" if own else ""


def _describe(point: tuple[str, str]) -> dict[str, Any]:
    """Return the descriptors of a plugin as plain data, to be sent between processes."""
    offered = ask_plugin(EntryPoint(*point, group=hookspecs.GROUP))
    found = {family: [plain(descriptor) for descriptor in several] for family, several in offered.items()}
    for descriptor, dumped in zip(offered.get("sensors", ()), found.get("sensors", ()), strict=True):
        dumped["spec"]["ranges"] = dict(descriptor.spec.ranges)  # recordings and keys leave them out, too
    return found


def plain(descriptor: Any, mode: Literal["json", "python"] = "python") -> dict[str, Any]:
    """Return a descriptor as plain data, including a sensor's data sheet, which recordings and keys omit."""
    dumped: dict[str, Any] = descriptor.model_dump(mode=mode)
    if isinstance(descriptor, rig.SensorDescriptor):
        dumped["spec"]["data_sheet"] = descriptor.spec.data_sheet.model_dump(mode=mode)
    return dumped


def ask_plugin(point: EntryPoint) -> dict[str, list[Any]]:
    """Import a plugin in this process, and return its descriptors by plural of their kind, after checks.

    Raises PluginError if it violates the contract of its hooks, and any error raised in its own code.
    """
    _check_api_version(point.value, _stated_version(point.value))
    module = cast(ModuleType, point.load())
    _check_api_version(point.value, getattr(module, "TACTBENCH_API", None))
    manager = pluggy.PluginManager(hookspecs.GROUP)
    manager.add_hookspecs(hookspecs)
    manager.register(module, name=point.name)
    manager.check_pending()
    callers = manager.get_hookcallers(module) or []
    if not callers and not _mappings_beside(module):
        raise PluginContractError(
            f"{point.value} implements no hook of {', '.join(f'tactbench_{family}' for family in _KINDS)}.",
            hint="Decorate a function that has one of these names with tactbench.plugin.hookimpl.",
        )
    offered: dict[str, list[Any]] = {}
    for caller in callers:
        family = caller.name.removeprefix("tactbench_")
        descriptors = [descriptor for answer in caller() for descriptor in answer]  # pluggy leaves None out
        for descriptor in descriptors:
            if not isinstance(descriptor, _KINDS[family]):
                raise PluginContractError(
                    f"{caller.name} of {point.value} returned {type(descriptor).__name__}, "
                    f"not {_KINDS[family].__name__}.",
                    hint="Return a list of descriptors from tactbench.plugin.",
                )
        offered[family] = descriptors
    return offered


def _mappings_beside(module: ModuleType) -> bool:
    """Return True if a package has mappings of data sets: see tactbench.core.recording.datasets."""
    return any(any(Path(folder).glob("datasets/*.yaml")) for folder in getattr(module, "__path__", ()))


def _stated_version(module: str) -> object:
    """Return the interface version in a module's source text, by default the current one; importing may fail."""
    origin = getattr(find_spec(module), "origin", None)
    text = Path(origin).read_text(encoding="utf-8", errors="replace") if origin else ""
    found = re.search(r"^TACTBENCH_API\b[^=\n]*=\s*(\d+)", text, re.MULTILINE)
    return int(found[1]) if found else hookspecs.API_VERSION


def _check_api_version(module: str, written_for: object) -> None:
    """Raise PluginContractError if a plugin was written for another version of the plugin interface."""
    here = hookspecs.API_VERSION
    if written_for != here:
        raise PluginContractError(
            f"{module} states TACTBENCH_API = {written_for!r}, but this tactbench has version {here} of the interface.",
            hint=f"Update plugin or tactbench, whichever is older; state TACTBENCH_API = {here} (docs/stability.md).",
        )


@cache
def _owner(distribution: Distribution | None) -> tuple[str, str]:
    """Return the name and the version of an entry point's distribution, read from its metadata file."""
    return ("unknown", "") if distribution is None else (distribution.name, distribution.version)


def load_object(where: str) -> Any:
    """Return the object at the import path ``module:attribute``; raise PluginError if it cannot be imported."""
    module, _, attribute = where.partition(":")
    try:
        return getattr(importlib.import_module(module), attribute)
    except (ImportError, AttributeError) as error:
        raise PluginError(
            f"{where} cannot be loaded: {error}.", hint="Check the plugin's installation with `tactbench list plugins`."
        ) from error
