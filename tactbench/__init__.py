"""Tactbench: benchmark tactile sensors, and show the computing time of each score.

The functions and classes in `__all__` are described in docs/python.md; each is imported at its first use.
"""

from typing import TYPE_CHECKING

from tactbench.core.on_demand import on_demand

if TYPE_CHECKING:
    from tactbench.notebook import evaluate, load_task, results, run
    from tactbench.recordings import dataset, from_arrays, open_recordings

__all__ = ["dataset", "evaluate", "from_arrays", "load_task", "open_recordings", "results", "run"]
__version__ = "0.1.0"
__getattr__ = on_demand(__name__)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
