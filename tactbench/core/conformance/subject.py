"""What is checked: one descriptor of one plugin, as the plugin itself gives it."""

from __future__ import annotations

import copy
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

from tactbench.core.conformance.check import CheckFailed, Kind
from tactbench.core.errors import PluginError
from tactbench.core.plugins import hookspecs
from tactbench.core.plugins.interfaces import Operator
from tactbench.core.plugins.registry import Registry, ask_plugin, load_object


@dataclass(frozen=True, eq=False)
class Subject:
    """A sensor, rig, device, task, estimator, effect, indenter or profile under check, and what else is installed."""

    kind: Kind
    name: str
    module: str
    """The plugin's, as its entry point names it."""
    distribution: str
    registry: Registry
    recording: Path | None = None
    """What is read in the mode `recording`."""
    rig_file: Path | None = None
    """What is opened in the mode `invasive`."""
    operator: Operator | None = None
    """Who stands at the rig in the mode `invasive`."""

    @property
    def descriptor(self) -> Any:
        """What the plugin's hook gives in this very process."""
        return self._first[0]

    @property
    def as_it_was(self) -> dict[str, Any]:
        """The descriptor as plain data, from before any code that it names had run."""
        return self._first[1]

    @cached_property
    def _first(self) -> tuple[Any, dict[str, Any]]:
        descriptor = self.asked_again()
        return descriptor, copy.deepcopy(descriptor.model_dump())

    def asked_again(self) -> Any:
        """Ask the plugin's hook once more; CheckFailed if it does not give the descriptor any more."""
        try:
            offered = ask_plugin(EntryPoint("checked", self.module, hookspecs.GROUP))[f"{self.kind}s"]
        except (PluginError, KeyError) as error:
            raise CheckFailed(self.hook, f"it does not answer when it is asked again: {error}") from error
        for descriptor in offered:
            if descriptor.name == self.name:
                return descriptor
        raise CheckFailed(self.hook, f"it does not give {self.name!r} when it is asked again")

    @property
    def hook(self) -> str:
        """The hook that brings it, as a place in messages."""
        return f"{self.module}.tactbench_{self.kind}s"

    @property
    def package(self) -> str:
        """The top of the plugin's module names."""
        return self.module.partition(".")[0]

    @property
    def fields(self) -> dict[str, str]:
        """Names of the descriptor's fields that name code, with what they name."""
        named = {"features_by": self.descriptor.spec.features_by} if self.kind == "task" else dict(self.descriptor)
        fields = (
            *("transducer", "driver", "emulator", "log_reader", "features_by", "where", "called_for"),
            *("verification", "work_precision", "file", "check"),
        )
        return {field: named[field] for field in fields if isinstance(named.get(field), str)}

    def code(self, field: str) -> Any:
        """Return what a field of the descriptor names, imported."""
        return load_object(self.fields[field])
