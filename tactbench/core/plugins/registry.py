"""The registry: every plugin is asked alone, and every failure is kept as a row.

Three holes of plain pluggy are closed here: a plugin that fails on import stops nobody else; two plugins giving one
name are refused naming both distributions; a misspelt hook is an error. Plugins of other distributions are imported in
child processes: what their import does to its process, or how that ends, is no other's, and what comes back is data.
"""

from __future__ import annotations

import importlib
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from importlib.metadata import Distribution, EntryPoint, entry_points
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any, Generic, Literal, TypeVar, cast, get_args

import pluggy

from tactbench.core.errors import (
    DuplicateNameError,
    PluginContractError,
    PluginError,
    UnknownNameError,
    UsageError,
    nearest,
)
from tactbench.core.plugins import hookspecs
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

Descriptor = (
    SensorDescriptor | RigDescriptor | DeviceDescriptor | TaskDescriptor | EstimatorDescriptor | EffectDescriptor
    | IndenterDescriptor | ProfileDescriptor
)  # fmt: skip
D = TypeVar("D", bound=Descriptor)


@dataclass(frozen=True)
class PluginRow:
    """One entry point, and what became of it."""

    entry_point: str
    module: str
    distribution: str
    version: str
    status: Literal["loaded", "failed"]
    brings: tuple[str, ...] = ()
    reason: str = ""


@dataclass(frozen=True)
class Owned(Generic[D]):
    """A descriptor, and the plugin that brought it."""

    descriptor: D
    module: str
    distribution: str
    version: str
    declared: str = ""
    """Of a task that came with recordings: what they say of it, as JSON; empty: a plugin's."""

    @property
    def ours(self) -> bool:
        """Whether it comes with this package: tested with it, and trusted not to change or end whoever imports it."""
        return _is_built_in(self.module)


@dataclass
class Family(Generic[D]):
    """All descriptors of one kind, by name."""

    kind: str
    _found: dict[str, list[Owned[D]]] = field(default_factory=dict)

    def add(self, owned: Owned[D]) -> None:
        """Remember a descriptor; a name given twice is kept twice and refused when asked for."""
        self._found.setdefault(owned.descriptor.name, []).append(owned)

    def owned(self, name: str) -> Owned[D]:
        """Return the descriptor called `name` with its owner.

        Raises
        ------
        UnknownNameError
            If nothing has this name.
        DuplicateNameError
            If two distributions give it.
        """
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
        """Return the descriptors that may be asked for, with their owners, sorted by name."""
        return [owners[0] for _, owners in sorted(self._found.items()) if len(owners) == 1]

    def names(self) -> list[str]:
        """Return the names that may be asked for."""
        return [descriptor.name for descriptor in self]

    def refused(self) -> list[DuplicateNameError]:
        """Return one error for every name that is given twice."""
        return [self._refusal(name) for name, owners in sorted(self._found.items()) if len(owners) > 1]

    def _refusal(self, name: str) -> DuplicateNameError:
        where = [f"{owner.distribution} ({owner.module})" for owner in self._found[name]]
        return DuplicateNameError(self.kind, name, where)


@dataclass
class Registry:
    """Everything that is installed."""

    sensors: Family[SensorDescriptor] = field(default_factory=lambda: Family("sensor"))
    rigs: Family[RigDescriptor] = field(default_factory=lambda: Family("rig"))
    devices: Family[DeviceDescriptor] = field(default_factory=lambda: Family("device"))
    tasks: Family[TaskDescriptor] = field(default_factory=lambda: Family("task"))
    estimators: Family[EstimatorDescriptor] = field(default_factory=lambda: Family("estimator"))
    effects: Family[EffectDescriptor] = field(default_factory=lambda: Family("effect"))
    indenters: Family[IndenterDescriptor] = field(default_factory=lambda: Family("indenter"))
    profiles: Family[ProfileDescriptor] = field(default_factory=lambda: Family("profile"))
    plugins: list[PluginRow] = field(default_factory=list)

    def families(self) -> Mapping[str, Family[Any]]:
        """Return the families by the name of their hook's plural."""
        return {name: getattr(self, name) for name in _KINDS}

    def first_rig(self, kind: Literal["simulated", "replays"]) -> str:
        """Return the name of the rig that is meant where none is named: of those of a kind ours, else the first.

        Raises
        ------
        UsageError
            If there is none.
        """
        able = [one for one in self.rigs.all_owned() if getattr(one.descriptor, kind)]
        if not able:
            what = "simulated rig" if kind == "simulated" else "rig that replays"
            raise UsageError(f"No {what} is installed.", hint="See `tactbench list plugins`.")
        return min(able, key=lambda one: not one.ours).descriptor.name

    @property
    def failures(self) -> list[PluginRow]:
        """The plugins that could not be used."""
        return [row for row in self.plugins if row.status == "failed"]

    @property
    def refused(self) -> list[DuplicateNameError]:
        """The names that are given twice."""
        return [error for family in self.families().values() for error in family.refused()]


_KINDS: dict[str, type[Any]] = {
    f"{kind.__name__.removesuffix('Descriptor').lower()}s": kind for kind in get_args(Descriptor)
}
"""By the plural that hooks and families are named after: ``sensors`` -> SensorDescriptor."""


ENTRY_POINT_S = 20.0
"""Seconds that the import of a plugin, and its hooks, may take."""


def load_registry(points: Iterable[EntryPoint] | None = None, *, timeout_s: float = ENTRY_POINT_S) -> Registry:
    """Load every plugin of the entry-point group, each one alone.

    Parameters
    ----------
    points
        Entry points to load instead of the installed ones.
    timeout_s
        Seconds that each may take.

    Returns
    -------
    Registry
        What could be loaded, and a row for each plugin that could not. Never raises for a bad plugin.
    """
    registry = Registry()
    found = entry_points(group=hookspecs.GROUP) if points is None else points
    unique = {(point.name, point.value, _owner(point.dist)): point for point in found}
    foreign = [(point.name, point.value) for point in unique.values() if not _is_built_in(point.module)]
    answers = _described_in_children(sorted(foreign), timeout_s)
    for (name, module, owner), point in sorted(unique.items()):
        _add(registry, point, owner, answers.get((name, module)))
    return registry


@lru_cache(maxsize=1)
def installed() -> Registry:
    """Return the registry of this process, loaded once."""
    return load_registry()


def _is_built_in(module: str) -> bool:
    return module.partition(".")[0] == __name__.partition(".")[0]


def _add(registry: Registry, point: EntryPoint, owner: tuple[str, str], reply: Any) -> None:
    """Add what a plugin brings: `reply` of a child process, or what it answers here if it is one of ours."""
    try:
        if isinstance(reply, BaseException):
            raise reply
        offered = ask_plugin(point) if reply is None else _described(reply)
    except Exception as error:
        reason = str(error) if isinstance(error, PluginError) else getattr(error, "message", None)
        reason = f"{reason or f'{type(error).__name__}: {error}'}{_line_in(point.module, error)}"
        registry.plugins.append(PluginRow(point.name, point.value, *owner, "failed", (), reason))
        return
    for family, descriptors in offered.items():
        for descriptor in descriptors:
            registry.families()[family].add(Owned(descriptor, point.value, *owner))
    brings = tuple(f"{family[:-1]} {one.name}" for family, descriptors in offered.items() for one in descriptors)
    registry.plugins.append(PluginRow(point.name, point.value, *owner, "loaded", brings))


def _line_in(module: str, error: Exception) -> str:
    """Return `` (file, line N)`` of the innermost line of a plugin's own package; "" if the error is not from there."""
    package, text = re.escape(module.partition(".")[0]), getattr(error, "traceback_text", "")
    own = re.findall(rf'File "[^"]*/({package}[/.][^"]*)", line (\d+)', text)
    return f" ({own[-1][0]}, line {own[-1][1]})" if own else ""


def _described_in_children(points: Sequence[tuple[str, str]], timeout_s: float) -> dict[tuple[str, str], Any]:
    """Ask each plugin in a child process; return what it describes, or what stopped it, by name and module."""
    if not points:
        return {}
    from tactbench.core.pool import Limits, Pool

    return dict(Pool(1, Limits(timeout_s=timeout_s)).each(_describe, points))


def _describe(point: tuple[str, str]) -> dict[str, Any]:
    """Ask a plugin; return its descriptors as JSON has them."""
    offered = ask_plugin(EntryPoint(*point, group=hookspecs.GROUP))
    return {family: [plain(descriptor) for descriptor in several] for family, several in offered.items()}


def plain(descriptor: Any, mode: Literal["json", "python"] = "python") -> dict[str, Any]:
    """Return a descriptor as plain data, with what stays out of recordings and keys: a sensor's data sheet."""
    dumped: dict[str, Any] = descriptor.model_dump(mode=mode)
    if isinstance(descriptor, SensorDescriptor):
        dumped["spec"]["data_sheet"] = descriptor.spec.data_sheet.model_dump(mode=mode)
    return dumped


def _described(reply: Mapping[str, Any]) -> dict[str, list[Any]]:
    return {family: [_KINDS[family].model_validate(one) for one in several] for family, several in reply.items()}


def ask_plugin(point: EntryPoint) -> dict[str, list[Any]]:
    """Import one plugin in this process; return its descriptors by family, all of them checked.

    Raises
    ------
    PluginError
        If it does not keep the contract of its hooks; and whatever its own code raises.
    """
    _check_api_version(point.value, _stated_version(point.value))
    module = cast(ModuleType, point.load())
    _check_api_version(point.value, getattr(module, "TACTBENCH_API", None))
    manager = pluggy.PluginManager(hookspecs.GROUP)
    manager.add_hookspecs(hookspecs)
    manager.register(module, name=point.name)
    known = {f"tactbench_{family}" for family in _KINDS}
    for name in sorted(vars(module)):
        close = nearest(name, known) if name.startswith("tactbench_") and name not in known else []
        if close and hasattr(getattr(module, name), f"{hookspecs.GROUP}_impl"):
            raise PluginContractError(f"{point.value}: there is no hook {name}.", hint=f"Is {close[0]} meant?")
    manager.check_pending()
    callers = manager.get_hookcallers(module) or []
    if not callers and not _mappings_beside(module):
        raise PluginContractError(
            f"{point.value} implements none of {', '.join(sorted(known))}.",
            hint="Decorate a function of that name with tactbench.plugin.hookimpl.",
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
    """Return whether a package brings mappings of data sets: see tactbench.core.recording.datasets."""
    return any(any(Path(folder).glob("datasets/*.yaml")) for folder in getattr(module, "__path__", ()))


def _stated_version(module: str) -> object:
    """Return the version that the source of a module states by a number of its own; else this one.

    It is looked at before the import, which may fail where another version is spoken.
    """
    spec = find_spec(module)
    if spec is None or not (spec.origin or "").endswith(".py"):
        return hookspecs.API_VERSION
    text = Path(str(spec.origin)).read_text(encoding="utf-8", errors="replace")
    found = re.search(r"^TACTBENCH_API\b[^=\n]*=\s*(\d+)", text, re.MULTILINE)
    return int(found[1]) if found else hookspecs.API_VERSION


def _check_api_version(module: str, written_for: object) -> None:
    """Raise PluginContractError if the version that a plugin states is not the one that is spoken here."""
    spoken = hookspecs.API_VERSION
    if written_for == spoken:
        return
    stated = "no TACTBENCH_API" if written_for is None else f"TACTBENCH_API = {written_for!r}"
    raise PluginContractError(
        f"{module} states {stated}; the plugin interface here is {spoken}.",
        hint=f"Write TACTBENCH_API = {spoken} in it, or update the older of the two: see docs/stability.md.",
    )


@lru_cache
def _owner(distribution: Distribution | None) -> tuple[str, str]:
    """Return name and version, which are read from a file."""
    return ("unknown", "") if distribution is None else (distribution.name, distribution.version)


def load_object(where: str) -> Any:
    """Import what a descriptor's ``module:attribute`` names.

    Raises
    ------
    PluginError
        If the module cannot be imported or has no such attribute; the cause is chained.
    """
    module, _, attribute = where.partition(":")
    try:
        return getattr(importlib.import_module(module), attribute)
    except (ImportError, AttributeError) as error:
        raise PluginError(
            f"{where} cannot be loaded: {error}.", hint="Check the plugin's installation with `tactbench list plugins`."
        ) from error
