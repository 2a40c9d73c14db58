"""One forked process as its parent sees it: started, watched, ended."""

from __future__ import annotations

import os
import select
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from typing import Any

from tactbench.core.errors import CellStopped, TactbenchError
from tactbench.core.matrix.engines import family, memory, verdict
from tactbench.core.matrix.engines.child import WHERE_ARE_YOU, live
from tactbench.core.matrix.engines.limits import Limits
from tactbench.core.matrix.engines.log import cut_back, flush, open_log, tail
from tactbench.core.matrix.engines.message import Inbox, Message, Told, ask, asked
from tactbench.core.matrix.engines.share import get_ready

WORD_S = 0.1
"""Seconds that a process which is about to be ended has to say where it is."""

_open: set[int] = set()
"""Descriptors by which this process looks after others: one that is forked closes them."""


class Guarded:
    """A forked process that carries out items, one at a time.

    Parameters
    ----------
    work
        What it does with an item; inherited, never pickled.
    items
        What it may be asked for, by number; inherited as well.
    limits
        What one item may take.
    """

    def __init__(self, work: Callable[[Any], Any], items: Sequence[Any], limits: Limits) -> None:
        self.items = items
        self.number: int | None = None
        """The item it is busy with."""
        self.begun = False
        """Whether it had begun with that, known once it is buried."""
        self._limits = limits
        self._log = open_log()
        self._last = ""
        """What the log held when the process was buried."""
        self._inbox = Inbox()
        self._stopped: CellStopped | None = None
        """Why this process was told to end."""
        self.link, theirs = os.pipe()
        self._unread, self._orders = os.pipe()
        flush()
        parent = os.getpid()
        self.pid = os.fork()
        if self.pid == 0:
            ours = (*_open, self.link, self._orders)
            _open.clear()
            live(work, _ordered(work, items, self._unread), theirs, self._log, limits, parent, ours)
        family.born(self.pid)
        os.close(theirs)
        os.set_blocking(self.link, False)
        self.ended = os.pidfd_open(self.pid) if hasattr(os, "pidfd_open") else -1
        """Becomes readable when the process is over; -1 where the system has no such thing."""
        self._descriptors = {self.link, self._unread, self._orders, self._log, self.ended} - {-1}
        _open.update(self._descriptors)
        self._began_mb = memory.resident_mb(parent)
        self._kills = -1
        """Processes that the system had ended for want of memory when this one was first asked."""

    def announce(self, number: int) -> None:
        """Have it get ready for item `number`."""
        ask(self._orders, ~number)

    def ask(self, number: int) -> None:
        """Have it carry out item `number`, which may take what it may from now on."""
        self.number = number
        self._began_mb = max(self._began_mb, memory.resident_mb(self.pid))
        self._began_s = time.monotonic()
        self._ends_s = None if self._limits.timeout_s is None else self._began_s + self._limits.timeout_s
        ask(self._orders, number)
        if self._kills < 0:
            self._kills = memory.oom_kills()

    def waits_s(self, now_s: float) -> float:
        """Return the seconds until this process must be looked at again, at most."""
        tick = 0.1 if self._limits.memory_mb is None else 0.02
        return tick if self._ends_s is None else max(0.0, min(tick, self._ends_s - now_s))

    def look(self) -> Any:
        """Return what came of the item it is busy with: a result, an error, or `PENDING`."""
        outcome = self._looked()
        if isinstance(outcome, CellStopped):
            outcome.spent_s = time.monotonic() - self._began_s
        return outcome

    def _looked(self) -> Any:
        alive = self._inbox.read(self.link)
        over = not alive or (self.ended >= 0 and wait_for([self.ended], 0))
        if not alive and self.ended >= 0 and not wait_for([self.ended], WORD_S):
            self._stopped = self._stopped or verdict.silenced()
        if over:
            self._inbox.read(self.link)
        try:
            message = self._inbox.message()
        except Exception as error:
            return self._said(Told.of(error))
        if message is not None and self._stopped is None:
            return self._judged(message)
        if over:
            return self._over()
        return self._limited()

    def _judged(self, message: Message) -> Any:
        if self._limits.exceeded(message.spent_s):
            return self._with_log(verdict.too_slow(self._limits))
        return self._said(message.result) if isinstance(message.result, Told) else message.result

    def _said(self, told: Told) -> TactbenchError:
        return told.error(self._printed())

    def _over(self) -> CellStopped:
        """Say why the process ended without a result, and bury it."""
        self.kill()
        status = self.bury()
        if self._stopped is not None:
            return self._with_log(self._stopped)
        return verdict.crashed(status, self._printed(), memory_was_short=memory.oom_kills() > self._kills)

    def _limited(self) -> Any:
        """End the process if it has taken more than it may."""
        cut_back(self._log)
        now_s = time.monotonic()
        if self._ends_s is not None and now_s >= self._ends_s:
            if self._stopped is not None:  # it was asked to end, and the time for that is up as well
                return self._over()
            self._stopped = verdict.too_slow(self._limits)
            self._stopped.traceback_text = self._where()
            if not self._limits.grace_s:
                return self._over()
            self._please_end(now_s)
        elif self._stopped is None and self._takes_too_much():
            self._stopped = verdict.out_of_memory(self._limits)
            return self._over()
        return PENDING

    def _takes_too_much(self) -> bool:
        most = self._limits.memory_mb
        return most is not None and memory.taken_mb(self.pid, self._began_mb) > most

    def _please_end(self, now_s: float) -> None:
        self._ends_s = now_s + self._limits.grace_s
        with suppress(ProcessLookupError):
            os.kill(self.pid, signal.SIGTERM)

    def _where(self) -> str:
        """Have the process write where it is, and return that; "" if it does not."""
        if WHERE_ARE_YOU is None:
            return ""
        before = len(self._printed())
        with suppress(ProcessLookupError):
            os.kill(self.pid, WHERE_ARE_YOU)
        until = time.monotonic() + WORD_S
        length = -1
        while time.monotonic() < until and not (length == len(self._printed()) > before):
            length = len(self._printed())
            wait_for([], WORD_S / 20)
        said = self._printed()[before:]
        return said if "most recent call first" in said else ""

    def _with_log(self, stopped: CellStopped) -> CellStopped:
        stopped.log = self._printed()
        return stopped

    def tidy(self) -> None:
        """End what an item that is over has left running below this process."""
        self.number = None
        family.kill_below(self.pid)

    def give_grace(self) -> None:
        """Leave it the time that it has to close what is open."""
        if self.pid and self.number is not None and self._limits.grace_s and self.ended >= 0:
            self._please_end(time.monotonic())
            wait_for([self.ended], self._limits.grace_s)

    def kill(self) -> None:
        """Have it end, and whatever it has started; how long that takes nobody knows."""
        if self.pid:
            family.kill(self.pid)

    def gone(self) -> bool:
        """Return whether it is over, as far as the system tells; then burying it takes no time."""
        return self.ended < 0 or wait_for([self.ended], 0)

    def bury(self) -> int:
        """Wait for the end of the process and let go of it; return its wait status."""
        if not self.pid:
            return 0
        with family.interrupts_held_back():
            status = family.buried(self.pid)
            self.pid = 0
            self._last = tail(self._log)
            self.begun = not wait_for([self._unread], 0)
            for descriptor in self._descriptors:
                os.close(descriptor)
            _open.difference_update(self._descriptors)
        return status

    def _printed(self) -> str:
        return tail(self._log) if self.pid else self._last


def wait_for(descriptors: list[int], seconds: float) -> bool:
    """Wait until one of `descriptors` can be read or so many seconds have passed; return whether one can."""
    poll = select.poll()
    for descriptor in descriptors:
        poll.register(descriptor, select.POLLIN)
    return bool(poll.poll(1e3 * seconds))


class Pending:
    """Says that there is nothing to say yet."""


PENDING = Pending()


def _ordered(work: Callable[[Any], Any], items: Sequence[Any], orders: int) -> Iterator[Any]:
    """Yield the items that the parent asks for, until it asks for no more; get ready for those that it announces."""
    while (number := asked(orders)) is not None:
        if number < 0:
            get_ready(work, items[~number])
        else:
            yield items[number]
