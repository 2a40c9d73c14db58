"""Tasks on slip: its onset, the state of slip in each frame, and presence of a slip in a whole recording."""

from __future__ import annotations

from tactbench.plugin import AlarmPolicy, LabelTarget, SlipTarget, Summary, TaskDescriptor, TaskSpec, hookimpl
from tactbench.tasks.slip_scenes import SLIP_SCENES

TACTBENCH_API = 2

FRAMES = SlipTarget(hop_s=0.01, window_s=0.1)
# All assumed: a gripper can still react to an alarm within half a second and needs no second one within a second; an
# alarm before the labelled 0.1 mm may be early by the time in which a surface at 1 mm/s slides as far.
POLICY = AlarmPolicy(
    window_before_s=0.1,
    window_after_s=0.5,
    refractory_s=1.0,
    merge_gap_s=0.2,
    minimum_length_s=0.02,
    false_alarm_time="disturbances",
)
# Measures of change within the frame; levels are left out.
MOVES = tuple(Summary(measure=measure) for measure in ("change", "mean-step", "deviation", "range"))
BAND = Summary(measure="band-energy", band_hz=(30.0, 200.0), kinds=("ac_pressure",))

SPEC = TaskSpec(
    name="slip",
    title="Slip as it begins",
    question="When does the contact begin to slip?",
    kind="events",
    optional_features=("dc_pressure", "ac_pressure"),
    target=FRAMES,
    answer_per="frame",
    summaries=(*MOVES, BAND),
    alarms=POLICY,
    max_false_alarms_per_minute=1.0,
    metric="recall_area",
    equivalence=0.02,  # assumed: one slip in fifty
    scenes=SLIP_SCENES,
    protocols=("deployable", "deployable-untared"),
    splits=("roles", "session"),
    estimators=(
        *("slip-forest", "slip-svm", "slip-spectrum"),
        *("pac-band", "wavelet-energy", "frame-difference"),
    ),
    baselines=("slip-never", "slip-always", "force-ratio"),
    beside=("slip-taxels",),
    # A campaign holds dozens of slips, and takes a minute or two.
    replicates=1,
)

# The same sensors without their fast streams, which may be what makes a good score.
TAXELS = SPEC.model_copy(
    update={
        "name": "slip-taxels",
        "title": "Slip as it begins, by taxels alone",
        "optional_features": (),
        "summaries": MOVES,
        "beside": ("slip",),
    }
)

STATE = TaskSpec(
    name="slip-state",
    title="State of slip",
    question="Does the contact stick, slip in part, or slip as a whole?",
    kind="classification",
    optional_features=("dc_pressure", "ac_pressure"),
    target=SlipTarget(hop_s=0.02, window_s=0.1),
    answer_per="frame",
    # The level too: partial slip is a matter of forces, not of motion alone.
    summaries=(*(Summary(measure=measure) for measure in ("mean", "change", "mean-step", "range")), BAND),
    metric="balanced_accuracy",
    equivalence=0.02,  # assumed: two frames in a hundred
    scenes=SLIP_SCENES,
    protocols=("deployable", "deployable-untared"),
    splits=("roles", "session"),
    estimators=("forest-50", "logistic"),
    baselines=("majority", "chance"),
    replicates=1,
)

SEQUENCE = TaskSpec(
    name="slip-sequence",
    title="Slip in a recording",
    question="Did the object slip during the recording?",
    kind="classification",
    target=LabelTarget(name="slip"),
    answer_per="recording",
    # Measures of change; levels are left out: the rest level of a channel may reveal the session.
    summaries=tuple(Summary(measure=measure) for measure in ("deviation", "mean-step", "change", "range")),
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
    """Return the descriptors of the slip tasks."""
    return [TaskDescriptor(spec=one) for one in (SPEC, TAXELS, STATE, SEQUENCE)]
