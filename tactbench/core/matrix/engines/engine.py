"""What an engine is."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Protocol, TypeVar

T = TypeVar("T")
R = TypeVar("R")


class Engine(Protocol):
    """Carries out work; what comes of an item does not depend on which engine it was."""

    def each(
        self, work: Callable[[T], R], items: Iterable[T], meanwhile: Callable[[], None] | None = None
    ) -> Iterator[tuple[T, R | BaseException]]:
        """Yield every item exactly once with its result, or with what stopped it, as they come.

        Parameters
        ----------
        work
            Called with one item. Whatever it does, the other items are carried out.
        items
            Engines may take them one by one, as there is room for them, or all at once.
        meanwhile
            Done here while workers elsewhere are busy.

        Notes
        -----
        What stopped an item is the exception that was raised, or `tactbench.core.errors.CellStopped`. Only a real
        Ctrl-C by the user ends the iteration.
        """
