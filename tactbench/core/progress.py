"""Interface for the progress of a long run, implemented by `tactbench.core.study.terminal`."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext


class Progress:
    """Receiver of the progress of a run; this base class shows nothing, its subclasses do."""

    def begin(self, stage: str, total: int) -> None:
        """Start a stage that has `total` steps."""

    def advance(self, what: str, *, stopped: bool = False) -> None:
        """Finish one step, named `what`; `stopped` is true if the step failed."""

    def working(self, what: str) -> None:
        """Show the current activity, without finishing a step."""

    def paused(self) -> AbstractContextManager[None]:
        """Return a context in which no progress is drawn, for a prompt to the user."""
        return nullcontext()
