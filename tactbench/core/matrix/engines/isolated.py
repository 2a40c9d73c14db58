"""Each item of work in a process of its own: whatever it does, it does it to itself."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from tactbench.core.matrix.engines.crew import guarded
from tactbench.core.matrix.engines.engine import R, T
from tactbench.core.matrix.engines.limits import UNLIMITED, Limits


class Isolated:
    """A forked child for each item, up to `jobs` at once.

    Parameters
    ----------
    jobs
        Items carried out at the same time.
    limits
        What each may take; its process is killed beyond.

    Notes
    -----
    The calling process must be its only thread. What it holds when an item is taken, libraries and recordings, its
    child shares until one of the two writes to it.
    """

    def __init__(self, jobs: int = 1, limits: Limits = UNLIMITED) -> None:
        self._jobs = jobs
        self._limits = limits

    def each(
        self, work: Callable[[T], R], items: Iterable[T], meanwhile: Callable[[], None] | None = None
    ) -> Iterator[tuple[T, R | BaseException]]:
        """Yield every item with its result or what stopped it, in the order in which they end."""
        return guarded(work, items, self._jobs, self._limits, meanwhile)
