"""Task: decide for each frame if the contact sticks, slips in part or slips as a whole."""

from __future__ import annotations

from tactbench.plugin import SlipTarget, Summary, TaskDescriptor, TaskSpec, hookimpl
from tactbench.tasks.slip_scenes import SLIP_SCENES

TACTBENCH_API = 2

SPEC = TaskSpec(
    name="slip-state",
    title="State of slip",
    question="Does the contact stick, slip in part, or slip as a whole?",
    kind="classification",
    optional_features=("dc_pressure", "ac_pressure"),
    target=SlipTarget(hop_s=0.02, window_s=0.1),
    answer_per="frame",
    # The level too: partial slip is a matter of forces, not of motion alone.
    summaries=(
        *(Summary(measure=measure) for measure in ("mean", "change", "mean-step", "range")),
        Summary(measure="band-energy", band_hz=(30.0, 200.0), kinds=("ac_pressure",)),
    ),
    metric="balanced_accuracy",
    equivalence=0.02,  # assumed: two frames in a hundred
    scenes=SLIP_SCENES,
    protocols=("deployable", "deployable-untared"),
    splits=("roles", "session"),
    estimators=("forest-50", "logistic"),
    baselines=("majority", "chance"),
    replicates=1,
)


@hookimpl
def tactbench_tasks() -> list[TaskDescriptor]:
    """Return the descriptor of the slip state task."""
    return [TaskDescriptor(spec=SPEC)]
