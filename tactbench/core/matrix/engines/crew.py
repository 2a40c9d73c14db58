"""The processes that an engine has forked: at work, waiting to be asked, and killed but not gone yet."""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable, Sequence
from types import TracebackType
from typing import Any, Self

from tactbench.core.matrix.engines import cores, family
from tactbench.core.matrix.engines.guarded import PENDING, Guarded, wait_for
from tactbench.core.matrix.engines.limits import Limits

LOOK_S = 0.1
"""How often somebody looks, at least."""


class Crew:
    """Forked processes, whom nothing outlives that they have started.

    Parameters
    ----------
    work
        What they do with an item.
    limits
        What one item may take.
    again
        Whether a process is asked again once it is through with an item; else it is ended.

    Notes
    -----
    A process needs a core while it is at work, and while it ends: what it holds is taken apart page by page. So does
    this process while it forks another. Whoever keeps to `free` disturbs no item that is being timed.
    """

    def __init__(self, work: Callable[[Any], Any], limits: Limits, *, again: bool) -> None:
        self._work = work
        self._limits = limits
        self._again = again
        self._cores = cores.cores()
        self._dying: list[Guarded] = []
        self._instead: set[Guarded] = set()
        self.busy: list[Guarded] = []
        """At work."""
        self.waiting: list[Guarded] = []
        """Forked, and nothing asked of them."""

    def __enter__(self) -> Self:
        importlib.import_module("resource")  # once here, not once in every process
        self._before = family.adopt()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            for one in self.busy:
                one.give_grace()
        finally:
            with family.interrupts_held_back():
                everyone = {*self.busy, *self.waiting, *self._dying}
                for one in everyone:
                    one.kill()
                for one in everyone:
                    one.bury()
                family.bury_orphans()
                family.adopt(self._before)

    @property
    def free(self) -> int:
        """How many of the cores that this process may use nobody needs but itself, other programs included."""
        ours = len(self.busy) + len(self._dying)
        return self._cores - (ours if ours >= self._cores else max(ours, cores.wanted() - 1))

    @property
    def settled(self) -> bool:
        """Whether whoever was killed is gone."""
        return not self._dying

    def fork(self, items: Sequence[Any]) -> None:
        """Have one more process wait, that may be asked for any of `items`."""
        with family.interrupts_held_back():
            self.waiting.append(Guarded(self._work, items, self._limits))

    def announce(self, number: int) -> None:
        """Have the process that was forked last get ready for its item `number`."""
        self.waiting[-1].announce(number)

    def ask(self, number: int) -> None:
        """Have the process that was forked last carry out its item `number`."""
        one = self.waiting[-1]
        self.busy.append(one)
        self.waiting.pop()
        one.ask(number)

    def heard(self) -> list[tuple[Any, Any]]:
        """Wait until something may have happened; return each item that is through, and what came of it.

        A process that ended before it had begun costs no item: another one is asked, once.
        """
        self._listen()
        for one in [one for one in self._dying if one.gone()]:
            self._let_go(one)
        found = []
        for one in list(self.busy):
            outcome = one.look()
            if outcome is PENDING:
                continue
            assert one.number is not None
            item = one.items[one.number]
            if one.pid == 0 and not one.begun and one not in self._instead:
                self._replace(one, one.number)
            else:
                self._dismiss(one)
                found.append((item, outcome))
        return found

    def _listen(self) -> None:
        now_s = time.monotonic()
        ears = [one.link for one in self.busy] + [one.ended for one in (*self.busy, *self._dying)]
        wait_for([ear for ear in ears if ear >= 0], min([LOOK_S, *(one.waits_s(now_s) for one in self.busy)]))

    def _dismiss(self, one: Guarded) -> None:
        """End what is left of an item that is over; have its process wait, or end it."""
        self._instead.discard(one)
        if one.pid == 0:
            self._dying.append(one)
            self.busy.remove(one)
            self._let_go(one)
        elif self._again:
            one.tidy()
            self.waiting.append(one)
            self.busy.remove(one)
        else:
            one.kill()
            self._dying.append(one)
            self.busy.remove(one)
            if one.gone():
                self._let_go(one)

    def _let_go(self, one: Guarded) -> None:
        """Bury a process that is over, with those that it has left behind."""
        one.bury()
        self._dying.remove(one)
        family.bury_orphans()

    def _replace(self, one: Guarded, number: int) -> None:
        self.busy.remove(one)
        self.fork(one.items)
        self._instead.add(self.waiting[-1])
        self.ask(number)
