"""Progress of a long run, and prompts for the person who operates a rig, on stderr."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import Any

from tactbench.core.errors import RigError
from tactbench.core.progress import Progress
from tactbench.core.tables.terminal import remark


class TerminalOperator:
    """Prompts for an operator at the terminal (:class:`~tactbench.core.plugins.interfaces.Operator`).

    Parameters
    ----------
    yes
        Show prompts without waiting for Enter, if all steps are done already (``--yes``).
    paused
        Function that returns the context of a prompt, in which no other output is drawn: ``LiveView.paused``.
    """

    def __init__(self, *, yes: bool = False, paused: Callable[[], AbstractContextManager[None]] = nullcontext) -> None:
        self._yes = yes
        self._paused = paused

    def prompt(self, text: str) -> None:
        """Show `text` and wait for Enter; keys pressed before the prompt are ignored.

        Raises
        ------
        RigError
            If stdin is no terminal, or is closed (Ctrl-D).
        """
        if self._yes:
            remark(text)
            return
        if not sys.stdin.isatty():
            raise RigError(
                f"A step cannot be confirmed, as stdin is not a terminal: {text}",
                hint="Run the command in a terminal, or add --yes if all steps are done already.",
            )
        with self._paused():
            _drop_input()
            remark(f"{text}\nPress Enter when this is done, Ctrl-C to end.")
            if not sys.stdin.readline():
                raise RigError("The step was not confirmed: stdin was closed.", hint="Press Enter after the step.")


def _drop_input() -> None:
    """Discard keys typed before a prompt, on systems with termios."""
    try:
        import termios
    except ImportError:  # Windows
        return
    termios.tcflush(sys.stdin.fileno(), termios.TCIFLUSH)


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
