"""Names of a door that are imported when somebody asks for them."""

import sys
import warnings
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from typing import Any, NamedTuple


class Renamed(NamedTuple):
    """A name that a door will lose. It works, with a warning, in at least one release."""

    now: str
    """The name of the same door to use instead."""
    until: str
    """The first release without the old one."""


def on_demand(
    door: str, places: Mapping[str, Sequence[str]], renamed: Mapping[str, Renamed] | None = None
) -> Callable[[str], Any]:
    """Return the ``__getattr__`` of module `door` for names by the module they are in, and for those it is to lose.

    What stands on numpy, and links, are imported so: a plugin that is only listed need not have them.
    """
    module_of = {name: module for module, names in places.items() for name in names}

    def imported(name: str) -> Any:
        if renamed is not None and name in renamed:
            from tactbench.core.errors import PluginDeprecationWarning

            now, until = renamed[name]
            warnings.warn(
                f"{door}.{name} is called {now} now; {name} is gone from tactbench {until} on.",
                PluginDeprecationWarning,
                stacklevel=2,
            )
            return getattr(sys.modules[door], now)
        if name not in module_of:
            raise AttributeError(f"module {door!r} has no attribute {name!r}")
        found = getattr(import_module(module_of[name]), name)
        setattr(sys.modules[door], name, found)
        return found

    return imported
