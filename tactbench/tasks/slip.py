"""When does the contact begin to slip? Events in time, by all streams of a sensor and by its taxels alone."""

from __future__ import annotations

from tactbench.plugin import AlarmPolicy, SlipTarget, Summary, TaskDescriptor, TaskSpec, hookimpl
from tactbench.tasks.slip_scenes import SLIP_SCENES

TACTBENCH_API = 2

FRAMES = SlipTarget(hop_s=0.01, window_s=0.1)
# Assumed, all of it: a gripper that is told within half a second can still hold on, and asks for no second alarm within
# one; what is told before the label's 0.1 mm is early by less than what the surface needs for it at 1 mm/s.
POLICY = AlarmPolicy(
    window_before_s=0.1,
    window_after_s=0.5,
    refractory_s=1.0,
    merge_gap_s=0.2,
    minimum_length_s=0.02,
    false_alarm_time="disturbances",
)
# How much a channel moved within the frame, and no level of it.
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

# Whoever has a fast stream may owe it the answer: the same sensors without it.
TAXELS = SPEC.model_copy(
    update={
        "name": "slip-taxels",
        "title": "Slip as it begins, by taxels alone",
        "optional_features": (),
        "summaries": MOVES,
        "beside": ("slip",),
    }
)


@hookimpl
def tactbench_tasks() -> list[TaskDescriptor]:
    """Offer the tasks."""
    return [TaskDescriptor(spec=SPEC), TaskDescriptor(spec=TAXELS)]
