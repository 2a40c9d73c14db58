"""Tactbench: benchmark tactile sensors, and show the computing time of each score.

The functions and classes in `__all__` are described in docs/python.md; each is imported at its first use.
"""

from typing import TYPE_CHECKING

from tactbench.core.on_demand import on_demand

if TYPE_CHECKING:
    from tactbench.arrays import from_arrays as from_arrays
    from tactbench.notebook import evaluate as evaluate, load_task as load_task, results as results, run as run
    from tactbench.recordings import dataset as dataset, open_recordings as open_recordings

__all__ = ["dataset", "evaluate", "from_arrays", "load_task", "open_recordings", "results", "run"]
__version__ = "0.1.0"
__getattr__ = on_demand(__name__)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
