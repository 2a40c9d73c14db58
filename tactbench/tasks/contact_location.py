"""Where on the skin something touches, from taxels."""

from __future__ import annotations

from tactbench.plugin import TaskDescriptor, TaskSpec, VectorTarget, hookimpl
from tactbench.tasks.contact_scenes import LOCATION_SCENES

TACTBENCH_API = 2

SPEC = TaskSpec(
    name="contact-location",
    title="Contact location",
    question="Where on the skin does it touch?",
    kind="regression",
    # In the recording's own frame; the twin's is the unrolled skin: x along the finger, y along the arc.
    target=VectorTarget(kind="position", names=("x", "y"), unit="mm"),
    metric="mean_euclidean_error",
    unit="mm",
    equivalence=0.1,  # assumed: as far apart as two presses at one commanded place, see Placement.scatter
    scenes=LOCATION_SCENES,
    protocols=("deployable", "deployable-untared"),
    splits=("roles", "session", "recording", "shuffled"),
    estimators=("forest-100", "ridge"),
    baselines=("mean", "time-index"),
)


@hookimpl
def tactbench_tasks() -> list[TaskDescriptor]:
    """Offer the task."""
    return [TaskDescriptor(spec=SPEC)]
