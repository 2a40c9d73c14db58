"""How a long run tells what it is doing; the command line decides how that looks."""

from __future__ import annotations

from typing import Protocol


class Progress(Protocol):
    """Receives what happens; never decides anything."""

    def begin(self, stage: str, total: int) -> None:
        """Start a stage of `total` steps."""

    def advance(self, what: str, *, stopped: bool = False) -> None:
        """Finish one step; `what` names it.

        Parameters
        ----------
        stopped
            True: it should have ended otherwise.
        """

    def working(self, what: str) -> None:
        """Say what is being done now, without finishing anything."""


class Silence:
    """A progress that says nothing."""

    def begin(self, stage: str, total: int) -> None:
        """Say nothing."""

    def advance(self, what: str, *, stopped: bool = False) -> None:
        """Say nothing."""

    def working(self, what: str) -> None:
        """Say nothing."""
