"""Prompts on stderr for the person who operates a rig, confirmed with Enter."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext

from tactbench.core.errors import RigError
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
                raise RigError("The step was not confirmed: stdin was closed.", hint="Press Enter when it is done.")


def _drop_input() -> None:
    """Discard keys typed before a prompt, on systems with termios."""
    try:
        import termios
    except ImportError:  # Windows
        return
    termios.tcflush(sys.stdin.fileno(), termios.TCIFLUSH)
