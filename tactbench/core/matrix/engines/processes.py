"""Items of work in forked processes that are used again: what one has loaded and prepared serves the next item."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from tactbench.core.matrix.engines.crew import Crew
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

    Where there are more cores than jobs, a process is asked for the next item before what came of the last is yielded;
    but not where it has a device to close: whoever hears of that outcome may want no other item begun.
    """

    def __init__(self, jobs: int = 1, limits: Limits = UNLIMITED) -> None:
        self._jobs = jobs
        self._limits = limits

    def each(
        self, work: Callable[[T], R], items: Iterable[T], meanwhile: Callable[[], None] | None = None
    ) -> Iterator[tuple[T, R | BaseException]]:
        """Yield every item with its result or what stopped it, in the order in which they end."""
        every = list(items)
        left = list(range(len(every)))[::-1]
        with Crew(work, self._limits, again=True) as crew:
            while left or crew.busy:
                while left and len(crew.busy) < self._jobs:
                    if not crew.waiting:
                        crew.fork(every)
                    crew.ask(left.pop())
                if meanwhile is not None:
                    meanwhile()
                    meanwhile = None
                for heard in crew.heard():
                    # One core for the item, and one for whoever hears of this outcome.
                    if left and crew.waiting and crew.free > 1 and not self._limits.grace_s:
                        crew.ask(left.pop())
                    yield heard
