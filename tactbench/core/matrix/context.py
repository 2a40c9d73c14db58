"""What all steps of one run work with."""

from __future__ import annotations

from dataclasses import dataclass

from tactbench.core.matrix.engine import EngineChoice
from tactbench.core.matrix.key_book import KeyBook
from tactbench.core.matrix.keys import Keys
from tactbench.core.matrix.plan_recordings import RecordingPlan
from tactbench.core.matrix.progress import Progress
from tactbench.core.matrix.recorded import Recorded
from tactbench.core.matrix.store import Store


@dataclass(frozen=True)
class RunContext:
    """The run, once it is planned."""

    store: Store
    """Where results lie; held by this run."""
    keys: Keys
    book: KeyBook
    """Told what goes into keys."""
    recording_plan: RecordingPlan
    recorded: Recorded
    """What is known of recordings, those made now among them."""
    choice: EngineChoice
    progress: Progress
    made_by: str
    """Id of this run's provenance."""
