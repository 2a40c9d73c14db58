"""Results on stdout, progress and remarks on stderr."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

from tactbench.core.matrix.progress import Progress

if TYPE_CHECKING:
    from rich.console import Console

WIDTH_WITHOUT_TERMINAL = 240
"""Wide enough for every column: a file or a pipe has no edge."""


def console() -> Console:
    """Return a console for stdout; without a terminal it is wide, plain and never cuts a table."""
    from rich.console import Console

    if sys.stdout.isatty():
        return Console(highlight=False)
    width = int(os.environ.get("COLUMNS", WIDTH_WITHOUT_TERMINAL))
    return Console(highlight=False, width=max(width, WIDTH_WITHOUT_TERMINAL), color_system=None)


def remark(text: str) -> None:
    """Say something beside the results."""
    click.echo(text, err=True)


@contextmanager
def progress() -> Iterator[Progress]:
    """Show progress on stderr: a bar on a terminal, a line a stage elsewhere."""
    if sys.stderr.isatty():
        with _bar() as bar:
            yield bar
    else:
        yield _Lines()


class _Lines:
    """One line a stage and one a finished tenth of it: readable in a log."""

    def __init__(self) -> None:
        self._stage, self._total, self._done = "", 0, 0

    def begin(self, stage: str, total: int, *, alone: bool = True) -> None:
        self._stage, self._total, self._done = stage, total, 0
        remark(f"{stage}: {total} to do")

    def advance(self, what: str) -> None:
        self._done += 1
        if self._done == self._total or self._done * 10 // self._total > (self._done - 1) * 10 // self._total:
            remark(f"{self._stage}: {self._done}/{self._total} {what}")

    def working(self, what: str) -> None:
        pass


class _Bar:
    """A bar a stage; its clock ticks by a thread where a thread is allowed, else with each step."""

    def __init__(self) -> None:
        self._shown: Any = None
        self._task: Any = None

    def begin(self, stage: str, total: int, *, alone: bool = True) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
        from rich.progress import Progress as RichProgress

        self.end()
        columns = (
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
            TextColumn("{task.fields[now]}", markup=False),
        )
        self._shown = RichProgress(*columns, console=Console(stderr=True), auto_refresh=alone)
        self._task = self._shown.add_task(f"{stage:<10}", total=total, now="")
        self._shown.start()

    def advance(self, what: str) -> None:
        self._shown.update(self._task, advance=1, now=what, refresh=True)

    def working(self, what: str) -> None:
        self._shown.update(self._task, now=what, refresh=True)

    def end(self) -> None:
        if self._shown is not None:
            self._shown.stop()
            self._shown = None


@contextmanager
def _bar() -> Iterator[Progress]:
    bar = _Bar()
    try:
        yield bar
    finally:
        bar.end()
