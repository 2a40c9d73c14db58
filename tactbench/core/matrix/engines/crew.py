"""Several guarded processes at once: what `Isolated` and `Processes` share."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from tactbench.core.matrix.engines import family
from tactbench.core.matrix.engines.engine import R, T
from tactbench.core.matrix.engines.guarded import PENDING, Guarded, wait_for
from tactbench.core.matrix.engines.limits import Limits


def guarded(
    work: Callable[[T], R], items: Iterable[T], jobs: int, limits: Limits, meanwhile: Callable[[], None] | None
) -> Iterator[tuple[T, R | BaseException]]:
    """Yield every item with what came of it, each in a process of its own, up to `jobs` at once.

    The next item is taken, and its process forked, when there is room for it: what the taking has prepared in this
    process, that process inherits.
    """
    busy: dict[Guarded, T] = {}
    coming = iter(items)
    more = True
    with family.adopting():
        strangers = family.own_children()
        try:
            while more or busy:
                while more and len(busy) < jobs:
                    try:
                        item = next(coming)
                    except StopIteration:
                        more = False
                        break
                    one = Guarded(work, [item], limits)
                    busy[one] = item
                    one.ask(0)
                if meanwhile is not None:
                    meanwhile()
                    meanwhile = None
                for one, outcome in _heard(list(busy)):
                    item = busy.pop(one)
                    one.number = None
                    one.end()
                    if not busy:
                        family.bury_orphans(strangers)
                    yield item, outcome
        finally:
            _end(list(busy))


def reused(
    work: Callable[[T], R], items: Iterable[T], jobs: int, limits: Limits, meanwhile: Callable[[], None] | None
) -> Iterator[tuple[T, R | BaseException]]:
    """Yield every item with what came of it, from up to `jobs` processes that are used again and again.

    One that ends with an item has the others done by another.
    """
    every = list(items)
    waiting = list(range(len(every)))[::-1]
    crew: list[Guarded] = []
    with family.adopting():
        try:
            while waiting or any(one.number is not None for one in crew):
                idle = [one for one in crew if one.number is None]
                while waiting and (idle or len(crew) < jobs):
                    if idle:
                        one = idle.pop()
                    else:
                        one = Guarded(work, every, limits)
                        crew.append(one)
                    one.ask(waiting.pop())
                if meanwhile is not None:
                    meanwhile()
                    meanwhile = None
                for one, outcome in _heard([one for one in crew if one.number is not None]):
                    number, one.number = one.number, None
                    if one.pid:
                        one.tidy()
                    else:
                        crew.remove(one)
                    assert number is not None
                    yield every[number], outcome
        finally:
            _end(crew)


def _heard(busy: list[Guarded]) -> Iterator[tuple[Guarded, Any]]:
    """Wait until something may have happened; yield each process that is through with its item, and what came of it."""
    if not busy:
        return
    now_s = time.monotonic()
    ears = [one.link for one in busy] + [one.ended for one in busy if one.ended >= 0]
    wait_for(ears, min(one.waits_s(now_s) for one in busy))
    for one in busy:
        outcome = one.look()
        if outcome is not PENDING:
            yield one, outcome


def _end(crew: list[Guarded]) -> None:
    for one in crew:
        one.end()
