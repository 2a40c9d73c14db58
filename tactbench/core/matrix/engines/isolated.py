"""Each item of work in a process of its own: whatever it does, it does it to itself."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from operator import length_hint

from tactbench.core.matrix.engines.crew import Crew
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

    While the process of an item that is over is taken apart, an item that is at hand is taken and its process forked,
    and that one gets ready while what came of the last is dealt with: with one job, nothing is done beside an item.
    """

    def __init__(self, jobs: int = 1, limits: Limits = UNLIMITED) -> None:
        self._jobs = jobs
        self._limits = limits

    def each(
        self, work: Callable[[T], R], items: Iterable[T], meanwhile: Callable[[], None] | None = None
    ) -> Iterator[tuple[T, R | BaseException]]:
        """Yield every item with its result or what stopped it, in the order in which they end."""
        coming = iter(items)
        more = True
        with Crew(work, self._limits, again=False) as crew:
            while True:
                while (more or crew.waiting) and len(crew.busy) < self._jobs and (crew.free > 0 or crew.settled):
                    if not crew.waiting:
                        more = _forked(crew, coming)
                    if crew.waiting:
                        crew.ask(0)
                if not (more or crew.waiting or crew.busy):
                    return
                if meanwhile is not None:
                    meanwhile()
                    meanwhile = None
                for heard in crew.heard():
                    if more and not crew.waiting and length_hint(coming) > 0:
                        more = _forked(crew, coming)
                    if crew.waiting and crew.free > 1:  # one for it, and one for whoever hears of this outcome
                        crew.ask(0)
                    elif crew.waiting:
                        crew.announce(0)
                    yield heard


def _forked(crew: Crew, coming: Iterator[T]) -> bool:
    """Fork a process for the next item; return whether there was one."""
    try:
        item = next(coming)
    except StopIteration:
        return False
    crew.fork([item])
    return True
