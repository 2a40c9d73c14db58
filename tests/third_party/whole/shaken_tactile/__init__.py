"""A task that asks one answer of each recording, with features of its own beside a summary, and one by a vote."""

from tactbench.plugin import LabelTarget, Summary, TaskDescriptor, TaskSpec, hookimpl

TACTBENCH_API = 2

SHAKEN = TaskSpec(
    name="shaken",
    title="Shaken or not",
    question="Was the sensor shaken during the recording?",
    kind="classification",
    target=LabelTarget(name="shaken"),
    answer_per="recording",
    summaries=(Summary(measure="deviation"),),
    features_by="shaken_tactile.features:crest_factors",
    metric="macro_f1",
    protocols=("deployable",),
    splits=("session", "recording"),
    estimators=("logistic",),
    baselines=("majority",),
)
VOTED = SHAKEN.model_copy(
    update={
        "name": "shaken-by-vote",
        "summaries": (),
        "features_by": None,
        "vote": "frames",
        "protocols": ("karl2016",),
    }
)


@hookimpl
def tactbench_tasks():
    return [TaskDescriptor(spec=SHAKEN), TaskDescriptor(spec=VOTED)]
