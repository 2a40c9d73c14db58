"""CAN logs, Vector's ASC and BLF, as links that are only read."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from datetime import UTC, datetime
from itertools import islice
from pathlib import Path
from typing import Any

from tactbench.core.errors import LinkEnded, LinkError
from tactbench.links.can_link import CanFrame, CanLink
from tactbench.links.link import cannot_open


class CanLog(CanLink):
    """A log: its frames one after the other, without waiting, stamped with the log's own times.

    Stamps count from the log's start, which is the only time that both formats keep under python-can: an ASC file's
    date has no time zone, and its reader takes stamps as relative to it unless told otherwise; a BLF file that was
    written with times before 1990 keeps no start. BLF stamps come within 0.25 us of the stored ones, since python-can
    returns seconds since 1970 as float64 (2**-22 s apart from 2004 to 2038).

    Parameters
    ----------
    file
        Ends in ``.asc`` or ``.blf``.

    Attributes
    ----------
    started
        The log's start as the file states it: ASC in the writer's local time, BLF in ISO 8601 as UTC; empty if it
        does not.
    backward
        How many frames so far have an earlier stamp than the one before them; they are returned as they are.

    Raises
    ------
    LinkError
        If the file cannot be read, is of another kind, or is an ASC file with times relative to the event before:
        events that are no frames carry part of the time, and python-can leaves them out.
    """

    def __init__(self, file: Path) -> None:
        import can
        from can.io.blf import BLFParseError

        super().__init__(f"can://log/{file}")
        self.backward = 0
        self._last_ns = 0
        self._count = 0
        self._start_s = 0.0
        if file.suffix.lower() not in (".asc", ".blf"):
            raise LinkError(f"{file} is not a log that can be read.", hint="Give a file that ends in .asc or .blf.")
        with ExitStack() as opened:
            try:
                if file.suffix.lower() == ".asc":
                    text = opened.enter_context(file.open(encoding="utf-8", errors="replace"))
                    self.started = _asc_start(self.address, text)
                    text.seek(0)
                    self._reader: Any = can.ASCReader(text, relative_timestamp=True)
                else:
                    self._reader = can.BLFReader(opened.enter_context(file.open("rb")))
                    self._start_s = self._reader.start_timestamp
                    self.started = datetime.fromtimestamp(self._start_s, UTC).isoformat() if self._start_s else ""
            except (OSError, ValueError, BLFParseError, struct.error) as error:
                raise cannot_open(self.address, error) from error
            self._file = opened.pop_all()
        self._messages: Iterator[Any] = iter(self._reader)

    def receive(self, timeout_s: float) -> CanFrame:
        """Return the next data frame at once.

        Raises
        ------
        LinkEnded
            If the log is over.
        LinkError
            If the log is damaged from here on.
        LinkClosed
            If the link was closed.
        """
        from can.io.blf import BLFParseError

        self._usable(timeout_s)
        while True:
            try:
                message = next(self._messages)
            except StopIteration:
                raise LinkEnded(f"The log {self.address} is over after {self._count} frames.") from None
            except (ValueError, LookupError, OSError, BLFParseError, struct.error, zlib.error) as error:
                raise LinkError(
                    f"The log {self.address} is damaged after {self._count} frames: {error}.",
                    hint="Use the frames before, or export the log anew.",
                ) from error
            self._count += 1
            t_ns = round((message.timestamp - self._start_s) * 1e9)
            self.backward += t_ns < self._last_ns
            self._last_ns = t_ns
            frame = self._data_frame(message, t_ns)
            if frame is not None:
                return frame

    def send(self, frame: CanFrame) -> None:
        """Refuse: a log takes nothing.

        Raises
        ------
        LinkError
            Always.
        """
        self._usable()
        raise LinkError(f"{self.address} is a log: nothing can be sent to it.", hint="Read it, or open a bus.")

    def _release(self) -> None:
        self._file.close()


def _asc_start(address: str, lines: Iterable[str]) -> str:
    """Return the start that the head of an ASC file states."""
    started = ""
    for line in islice(lines, 50):
        words = line.split()
        if [word.lower() for word in words[:1]] == ["date"]:
            started = " ".join(words[1:])
        elif [word.lower() for word in words[:2]] == ["begin", "triggerblock"]:
            return " ".join(words[2:])
        elif [word.lower() for word in words[2:4]] == ["timestamps", "relative"]:
            raise LinkError(
                f"The times in {address} are relative to the event before, absolute ones were expected.",
                hint="Export the log with absolute time stamps.",
            )
    return started
