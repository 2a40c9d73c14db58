"""The base of all links: open when made, closed once, and a named error for each kind of failure."""

from __future__ import annotations

import errno
import math
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Self

from tactbench.core.errors import LinkClosed, LinkError, LinkTimeout, LinkUnplugged

try:
    import termios

    SYSTEM_ERRORS: tuple[type[Exception], ...] = (OSError, termios.error)
except ImportError:  # Windows has none
    SYSTEM_ERRORS = (OSError,)
"""Errors of the system: that of terminals is no OSError, and passes through pyserial where a port has gone."""

Clock = Callable[[], int]
"""Returns nanoseconds of a clock that never goes back, as :func:`time.monotonic_ns` does."""

WRITE_TIMEOUT_S = 1.0
"""Longest time in which the other end takes data (assumed; 9600 baud carry 960 bytes in it)."""

MOST_AT_ONCE = 4096
"""Pieces of one :meth:`Link.receive_all`, 4 s at 1 kHz: it returns also from a bus that never rests."""


@dataclass(frozen=True, slots=True)
class Received:
    """Bytes and the time of receipt of the first of them."""

    data: bytes
    t_ns: int
    """Nanoseconds of the link's clock."""


class Link(ABC):
    """A connection to a device: open when it is made, until :meth:`close` or the end of its ``with`` block.

    One thread uses a link. Timeouts are counted by :meth:`timer`, whatever the clock; with 0 a read returns at once.
    Every read and write raises LinkTimeout if nothing was received or taken in time (:data:`WRITE_TIMEOUT_S` for
    writes), LinkUnplugged if device or other end is gone, LinkClosed once it was closed, and LinkError otherwise.

    Parameters
    ----------
    address
        Its name in messages.
    clock
        Gives the times of receipt.
    """

    silence_hint = "Is the device on, started and set to the same speed? Then wait longer."

    def __init__(self, address: str, clock: Clock = time.monotonic_ns) -> None:
        self.address = address
        self._clock = clock
        self._closed = False
        self._loss: BaseException | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the link; once closed, or unplugged and closed, this does nothing."""
        if not self._closed:
            self._closed = True
            self._release()

    def timer(self) -> float:
        """Return the seconds of its timeouts: real ones, or virtual ones where time is virtual."""
        return time.monotonic()

    def receive_all(self, timeout_s: float) -> list[Any]:
        """Return all pieces received, waiting at most so long for the first; an empty list: there is none.

        Raises as a read does; pieces received before the link was unplugged are returned first.
        """
        found: list[Any] = []
        with suppress(LinkTimeout):
            while len(found) < MOST_AT_ONCE:
                try:
                    found.append(self.receive(0.0 if found else timeout_s))
                except LinkUnplugged:
                    if not found:
                        raise
                    break
        return found

    def discard(self) -> None:
        """Drop all pieces received so far, not those still under way. Raises as a read does."""
        self.receive_all(0.0)

    @abstractmethod
    def receive(self, timeout_s: float) -> Any:
        """Return the next piece, waiting for it at most so long."""

    def _sendable(self, piece: Any) -> None:
        """Raise LinkError for a link that is closed or unplugged, and for a piece that cannot be sent."""
        self._usable()

    @abstractmethod
    def _release(self) -> None:
        """Release the link's resources; called once, also after the other end is gone, and raises nothing."""

    def _usable(self, timeout_s: float = 0.0) -> float:
        """Return the end of a wait of `timeout_s`, in seconds of :meth:`timer`; raises as every :class:`Link`."""
        if self._closed:
            raise LinkClosed(f"The link {self.address} is closed.", hint="Open a new one.")
        if self._loss is not None:
            raise self._unplugged(self._loss)
        if not 0 <= timeout_s < math.inf:
            raise LinkError(
                f"{self.address}: the timeout is {timeout_s} s; a finite one of 0 or more was expected.",
                hint="Use 0 to return at once.",
            )
        return self.timer() + timeout_s

    def _unplugged(self, cause: BaseException) -> LinkUnplugged:
        self._loss = cause
        return LinkUnplugged(
            f"The other end of {self.address} is gone: {cause}.",
            hint="Check cable, power and other end, close this link and open a new one.",
        )

    def _nothing_came(self, timeout_s: float) -> LinkTimeout:
        return LinkTimeout(
            f"Nothing was received from {self.address} within {timeout_s:g} s.",
            hint=self.silence_hint,
        )

    def _not_sent(self, cause: BaseException) -> LinkTimeout:
        return LinkTimeout(
            f"{self.address} did not take all data within {WRITE_TIMEOUT_S:g} s ({cause}); part may have been sent.",
            hint="Is the other end reading, or, on CAN, does any node acknowledge?",
        )


_HINTS = {
    errno.ENOENT: "Check the name and the cable; `python -m serial.tools.list_ports` lists serial ports.",
    errno.EACCES: "Your user may not open it: join the group that owns the device (often dialout) and log in again.",
    errno.EAGAIN: "Another program has it open: end that one.",
    errno.EBUSY: "Another program has it open: end that one.",
    errno.EADDRINUSE: "Another program uses this local port: end that one, or choose another port.",
    errno.EAFNOSUPPORT: "This machine's kernel does not have that kind of network; CAN needs Linux with CONFIG_CAN.",
    errno.ENODEV: "There is no such interface; `ip link` lists them.",
    errno.ECONNREFUSED: "Nothing listens there: check host and port, and that the device is on.",
}


def os_error_in(error: BaseException) -> OSError | None:
    """Return the system's error that `error` is or was raised from; the innermost with a number, if one has."""
    found: OSError | None = None
    cause: BaseException | None = error
    while cause is not None:
        if isinstance(cause, SYSTEM_ERRORS):
            own = cause if isinstance(cause, OSError) else OSError(*cause.args)
            found = own if found is None or own.errno is not None else found
        cause = cause.__cause__ or cause.__context__
    return found


def cannot_open(address: str, error: BaseException, *, hint: str = "") -> LinkError:
    """Return the error of a link that does not open, with a hint for the system's reason."""
    reason = os_error_in(error)
    number = reason.errno if reason is not None and reason.errno is not None else 0
    return LinkError(f"{address} cannot be opened: {error}.", hint=hint or _HINTS.get(number, "Check its address."))
