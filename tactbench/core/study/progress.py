"""Progress of a long run: a progress bar on a terminal, otherwise one line for each finished tenth."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from tactbench.core.progress import Progress
from tactbench.core.tables.terminal import remark


@contextmanager
def progress() -> Iterator[Progress]:
    """Return a context whose value shows progress on stderr."""
    if not sys.stderr.isatty():
        yield _Lines()
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
    from rich.progress import Progress as RichProgress

    # A cell in this process prints to its log: what is shown meanwhile needs a way of its own to the terminal, and rich
    # must not take over the streams.
    with os.fdopen(os.dup(sys.stderr.fileno()), "w", encoding="utf-8", errors="replace") as terminal:
        shown = RichProgress(
            TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(),
            TimeRemainingColumn(), TextColumn("{task.fields[now]}", markup=False), console=Console(file=terminal),
            redirect_stdout=False, redirect_stderr=False, transient=True,
        )  # fmt: skip
        try:
            yield _Bar(shown)
        finally:
            shown.stop()


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

    def __init__(self, shown: Any) -> None:
        self._shown = shown

    def begin(self, stage: str, total: int) -> None:
        for task in self._shown.task_ids:
            self._shown.remove_task(task)
        self._stopped = 0
        self._task = self._shown.add_task(stage, total=total, now="")
        self._shown.start()

    def advance(self, what: str, *, stopped: bool = False) -> None:
        self._stopped += stopped
        ended = f"({self._stopped} stopped) " if self._stopped else ""
        self._shown.update(self._task, advance=1, now=f"{ended}{what}", refresh=True)

    def working(self, what: str) -> None:
        self._shown.update(self._task, now=what, refresh=True)

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Return a context in which the progress bar is hidden."""
        self._shown.stop()
        try:
            yield
        finally:
            self._shown.start()
