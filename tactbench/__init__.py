"""Tactbench: benchmark tactile sensors, and show what each score costs in time.

In Python: :func:`open_recordings`, :func:`load_task`, :func:`evaluate`, :func:`run` and :func:`results`; see
docs/python.md. Each is imported when it is first used: ``import tactbench`` loads no library of numbers or files.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tactbench.notebook import evaluate, load_task, open_recordings, results, run

__all__ = ["evaluate", "load_task", "open_recordings", "results", "run"]
__version__ = "0.1.0"

_MODULES = dict.fromkeys(("evaluate", "load_task", "open_recordings", "results", "run"), "tactbench.notebook")
"""Where each name of `__all__` is."""


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = globals()[name] = getattr(import_module(_MODULES[name]), name)
    return found


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
