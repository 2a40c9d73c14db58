"""Prompts on stderr for the operator of a rig, who answers with Enter."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext

from tactbench.core.errors import RigError
from tactbench.core.tables.terminal import remark


class TerminalOperator:
    """An operator at the terminal (:class:`~tactbench.core.plugins.interfaces.Operator`).

    Parameters
    ----------
    yes
        Show prompts without waiting, as all steps are done already (``--yes``).
    paused
        Context of a prompt, in which nothing else draws on the terminal: ``LiveView.paused``.
    """

    def __init__(self, *, yes: bool = False, paused: Callable[[], AbstractContextManager[None]] = nullcontext) -> None:
        self._yes = yes
        self._paused = paused

    def prompt(self, text: str) -> None:
        """Show `text` and wait for Enter; keys pressed before do not count.

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
                f"A step cannot be confirmed, as stdin is no terminal: {text}",
                hint="Run it in a terminal, or add --yes if all steps are done already.",
            )
        with self._paused():
            _drop_input()
            remark(f"{text}\nPress Enter when it is done, Ctrl-C to end.")
            if not sys.stdin.readline():
                raise RigError("The step was not confirmed: stdin was closed.", hint="Press Enter when it is done.")


def _drop_input() -> None:
    """Discard input that was typed before, where the system can."""
    try:
        import termios
    except ImportError:  # Windows
        return
    termios.tcflush(sys.stdin.fileno(), termios.TCIFLUSH)
