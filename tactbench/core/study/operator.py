"""The operator of a rig: prompts go to stderr, and Enter confirms them."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext

from tactbench.core.errors import RigError
from tactbench.core.tables.terminal import remark


class TerminalOperator:
    """An :class:`~tactbench.core.plugins.interfaces.Operator` at the terminal.

    Parameters
    ----------
    yes
        Every step is done already: prompts are shown, and none is waited for (``--yes``).
    paused
        Entered during a prompt, so that nothing else draws on the terminal: ``LiveView.paused``.
    """

    def __init__(self, *, yes: bool = False, paused: Callable[[], AbstractContextManager[None]] = nullcontext) -> None:
        self._yes = yes
        self._paused = paused

    def prompt(self, text: str) -> None:
        """Show `text` and wait for Enter; keys pressed before it was shown are ignored.

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
                f"An operator is needed: {text}",
                hint="Run it in a terminal, or add --yes if all of that is done already.",
            )
        with self._paused():
            _forget_typed()
            remark(f"{text}\nPress Enter when it is done, Ctrl-C to end.")
            if not sys.stdin.readline():
                raise RigError(
                    "The prompt was not confirmed: standard input is closed.", hint="Press Enter when it is done."
                )


def _forget_typed() -> None:
    """Discard keys that were typed before, where the system can."""
    try:
        import termios
    except ImportError:  # Windows
        return
    termios.tcflush(sys.stdin.fileno(), termios.TCIFLUSH)
