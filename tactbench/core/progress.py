"""How a long run tells what it is doing; `tactbench.core.study.progress` decides how that looks."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext


class Progress:
    """Receives what happens, and says nothing of it; never decides anything."""

    def begin(self, stage: str, total: int) -> None:
        """Start a stage of `total` steps."""

    def advance(self, what: str, *, stopped: bool = False) -> None:
        """Finish one step, named `what`; `stopped`: it should have ended otherwise."""

    def working(self, what: str) -> None:
        """Say what is being done now, without finishing anything."""

    def paused(self) -> AbstractContextManager[None]:
        """Return a context in which nothing is drawn: somebody is asked something."""
        return nullcontext()
