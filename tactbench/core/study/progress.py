"""Progress of a long run: a progress bar on a terminal, otherwise one line for each finished tenth."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, TextIO

from tactbench.core.progress import Progress
from tactbench.core.tables.terminal import remark

_FEW = 10
"""Largest number of steps of a stage that shows no remaining time, since single steps differ by orders of magnitude."""


@contextmanager
def progress() -> Iterator[Progress]:
    """Return a context whose value shows progress on stderr."""
    if not sys.stderr.isatty():
        yield _Lines()
        return
    # A cell in this process prints to its log: what is shown meanwhile needs a way of its own to the terminal.
    with os.fdopen(os.dup(sys.stderr.fileno()), "w", encoding="utf-8", errors="replace") as terminal:
        bar = _Bar(terminal)
        try:
            yield bar
        finally:
            bar.end()


class _Lines(Progress):
    """Progress for logs: one line for each stage and for each finished tenth of a stage."""

    def begin(self, stage: str, total: int) -> None:
        self._stage, self._total, self._done, self._stopped = stage, total, 0, 0
        remark(f"{stage}: {total} to do")

    def advance(self, what: str, *, stopped: bool = False) -> None:
        self._done += 1
        self._stopped += stopped
        if self._done * 10 // self._total > (self._done - 1) * 10 // self._total:
            ended = f" ({self._stopped} stopped)" if self._stopped else ""
            remark(f"{self._stage}: {self._done}/{self._total} {what}{ended}")


class _Bar(Progress):
    """Progress on a terminal: a progress bar for each stage."""

    def __init__(self, terminal: TextIO) -> None:
        self._terminal = terminal
        self._shown: Any = None
        self._task: Any = None
        self._stopped = 0

    def begin(self, stage: str, total: int) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
        from rich.progress import Progress as RichProgress

        self.end()
        columns = (
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[stopped]}", markup=False, style="red"),
            TimeElapsedColumn(),
            *([TimeRemainingColumn()] if total > _FEW else []),
            TextColumn("{task.fields[now]}", markup=False),
        )
        # The terminal is handed over as it is: rich must not take over streams that cells print to.
        self._shown = RichProgress(
            *columns, console=Console(file=self._terminal), redirect_stdout=False,
            redirect_stderr=False, transient=True,
        )  # fmt: skip
        self._stopped = 0
        self._task = self._shown.add_task(f"{stage}", total=total, now="", stopped="")
        self._shown.start()

    def advance(self, what: str, *, stopped: bool = False) -> None:
        self._stopped += stopped
        text = f"{self._stopped} stopped" if self._stopped else ""
        self._shown.update(self._task, advance=1, now=what, stopped=text, refresh=True)

    def working(self, what: str) -> None:
        self._shown.update(self._task, now=what, refresh=True)

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Return a context in which the progress bar is hidden."""
        shown = self._shown
        if shown is not None:
            shown.stop()
        try:
            yield
        finally:
            if shown is not None:
                shown.start()

    def end(self) -> None:
        if self._shown is not None:
            self._shown.stop()
            self._shown = None
