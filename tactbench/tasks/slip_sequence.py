"""Task: decide if the object slipped during a recording, with one prediction for each recording."""

from __future__ import annotations

from tactbench.plugin import LabelTarget, Summary, TaskDescriptor, TaskSpec, hookimpl

TACTBENCH_API = 2

SPEC = TaskSpec(
    name="slip-sequence",
    title="Slip in a recording",
    question="Did the object slip during the recording?",
    kind="classification",
    target=LabelTarget(name="slip"),
    answer_per="recording",
    # Measures of change; levels are left out: the rest level of a channel may reveal the session.
    summaries=(
        Summary(measure="deviation"),
        Summary(measure="mean-step"),
        Summary(measure="change"),
        Summary(measure="range"),
    ),
    metric="accuracy",
    equivalence=0.01,  # assumed: one answer in a hundred
    protocols=("deployable", "deployable-untared"),
    # The strictest that the recordings have labels for: objects never shown, another occasion, blocks of neighbouring
    # recordings; else recordings alone.
    splits=("object", "session", "roles", "block", "recording", "shuffled"),
    estimators=("forest", "svm", "logistic"),
    baselines=("majority", "chance"),
)


@hookimpl
def tactbench_tasks() -> list[TaskDescriptor]:
    """Return the descriptor of the slip sequence task."""
    return [TaskDescriptor(spec=SPEC)]
