"""Tasks: detect the times at which the contact begins to slip, from all streams of a sensor or its taxels alone."""

from __future__ import annotations

from tactbench.plugin import AlarmPolicy, SlipTarget, Summary, TaskDescriptor, TaskSpec, hookimpl
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


@hookimpl
def tactbench_tasks() -> list[TaskDescriptor]:
    """Return the descriptors of the slip detection tasks."""
    return [TaskDescriptor(spec=SPEC), TaskDescriptor(spec=TAXELS)]
