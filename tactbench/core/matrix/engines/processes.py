"""Items of work in forked processes that are used again: what one has loaded and prepared serves the next item."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from tactbench.core.matrix.engines.crew import reused
from tactbench.core.matrix.engines.engine import R, T
from tactbench.core.matrix.engines.limits import UNLIMITED, Limits


class Processes:
    """Up to `jobs` reused processes; one that an item ends is replaced, and that item alone pays for it.

    Parameters
    ----------
    jobs
        Items carried out at the same time.
    limits
        What each may take; its process is ended beyond.

    Notes
    -----
    The calling process must be its only thread. All items are taken before the first process is forked.
    """

    def __init__(self, jobs: int = 1, limits: Limits = UNLIMITED) -> None:
        self._jobs = jobs
        self._limits = limits

    def each(
        self, work: Callable[[T], R], items: Iterable[T], meanwhile: Callable[[], None] | None = None
    ) -> Iterator[tuple[T, R | BaseException]]:
        """Yield every item with its result or what stopped it, in the order in which they end."""
        return reused(work, items, self._jobs, self._limits, meanwhile)
