"""Names of a door that are imported when somebody asks for them."""

import sys
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from typing import Any


def on_demand(door: str, places: Mapping[str, Sequence[str]]) -> Callable[[str], Any]:
    """Return the ``__getattr__`` of module `door` for names by the module they are in.

    What stands on numpy, and links, are imported so: a plugin that is only listed need not have them.
    """
    module_of = {name: module for module, names in places.items() for name in names}

    def imported(name: str) -> Any:
        if name not in module_of:
            raise AttributeError(f"module {door!r} has no attribute {name!r}")
        found = getattr(import_module(module_of[name]), name)
        setattr(sys.modules[door], name, found)
        return found

    return imported
