"""Interface for the progress of a long run, which `tactbench.core.study.progress` shows."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext


class Progress:
    """Receiver of the progress of a run, which shows nothing; subclasses do."""

    def begin(self, stage: str, total: int) -> None:
        """Start a stage of `total` steps."""

    def advance(self, what: str, *, stopped: bool = False) -> None:
        """Finish one step, named `what`; `stopped` states that it has failed."""

    def working(self, what: str) -> None:
        """Show what is being done now, without finishing a step."""

    def paused(self) -> AbstractContextManager[None]:
        """Return a context in which nothing is drawn, for a prompt."""
        return nullcontext()
