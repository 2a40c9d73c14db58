"""What counts as slip, as an alarm, as a hit and as a false alarm: every number stated."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from tactbench.core.spec.quantity import Frozen

Seconds = Annotated[float, Field(ge=0, le=1e6)]
"""A length of time that int64 nanoseconds hold many times over."""


AREA_PER_MINUTE = 20.0
"""False alarms a minute up to which recall is averaged to `recall_area` [1/min] (assumed)."""


def nanoseconds(seconds: float) -> int:
    """Return whole nanoseconds: times are compared as integers, so that rounding decides no hit."""
    return round(seconds * 1e9)


class AlarmPolicy(Frozen):
    """How a detector's frames become alarms, and what an alarm is held against.

    No field has a default. A hidden one may decide the result: those of timescoring 0.0.7, made for seizures (30 s
    before, 60 s after, merging below 90 s), give F1 = 1 to a detector whose last alarm comes 10 s after the event.
    """

    window_before_s: Seconds
    """An alarm at most this long before an onset may hit it [s]."""
    window_after_s: Seconds
    """An alarm at most this long after an onset may hit it [s]."""
    refractory_s: Seconds
    """After an alarm, no other for this long [s]. One that falls into it is dropped, not put off."""
    merge_gap_s: Seconds
    """Active frames at most this far apart belong to one segment [s], as neighbouring active frames always do."""
    minimum_length_s: Seconds
    """A segment raises its one alarm at its first active frame that comes this long after its beginning [s]."""
    false_alarm_time: Literal["disturbances", "non-events"]
    """The seconds that false alarms per minute are counted on and divided by: the declared disturbances, or all of the
    recording; in both without every event and its window."""

    def __str__(self) -> str:
        return (
            f"hit from {self.window_before_s:g} s before to {self.window_after_s:g} s after an onset, one alarm to one "
            f"event; refractory {self.refractory_s:g} s, merged up to {self.merge_gap_s:g} s, "
            f"at least {self.minimum_length_s:g} s long; false alarms per minute of {self.false_alarm_time}"
        )


class SlipThresholds(Frozen):
    """Where stick, incipient and gross slip part. No field has a default."""

    hold_s: Seconds = Field(gt=0)
    """A contact rests where its displacements of this long [s] differ by no more than `gross_displacement_m`."""
    gross_displacement_m: float = Field(gt=0)
    """Gross slip is displacement of more than this after such a hold [m]."""
    incipient_slip_share: float = Field(gt=0, lt=1)
    """Incipient slip begins where ``1 - c/a`` exceeds this [1]."""
    gross_stick_ratio: float = Field(gt=0, lt=1)
    """It ends where c/a is at or below this: by its forces the contact slips as a whole [1]."""
    contact_force_n: float = Field(gt=0)
    """With less normal force there is no contact worth a label [N]."""

    @model_validator(mode="after")
    def _in_order(self) -> SlipThresholds:
        if 1.0 - self.incipient_slip_share <= self.gross_stick_ratio:
            raise ValueError("1 - incipient_slip_share must exceed gross_stick_ratio: incipient slip comes first")
        return self

    def scaled(self, factor: float) -> SlipThresholds:
        """Return the same with displacement, slip share and stick ratio times `factor`.

        How long a hold lasts and what a contact is are not scaled: they say where labels exist, not where they part.
        """
        names = ("gross_displacement_m", "incipient_slip_share", "gross_stick_ratio")
        changed = {name: factor * getattr(self, name) for name in names}
        return SlipThresholds.model_validate({**self.model_dump(), **changed})


THRESHOLDS = SlipThresholds(
    hold_s=0.1, gross_displacement_m=1e-4, incipient_slip_share=0.1, gross_stick_ratio=0.1, contact_force_n=0.05
)
"""The published ones. All five are assumed: no source was found that states them for a whole contact. They see slip
faster than 1 mm/s, or by steps of more than 0.1 mm. What a score owes to them is shown by halving and doubling them
(`tactbench.core.evaluation.slip_reference`)."""


class SlipTarget(Frozen):
    """Whether the contact slips, frame by frame, by the reference alone.

    It needs forces called `normal` and `tangential` and a length called `slip`, the displacement of surface and skin
    against each other, all on one clock; and the coefficient of friction as a label of the recording.
    """

    source: Literal["slip"] = "slip"
    hop_s: Seconds = Field(gt=0)
    """A frame ends every so many seconds."""
    window_s: Seconds = Field(gt=0)
    """A frame looks at so many seconds before its end."""
    thresholds: SlipThresholds = THRESHOLDS
    friction: str = "friction_coefficient"
    """Label of a recording with the static coefficient of friction [1]."""
    disturbance: tuple[str, str] = ("event", "disturbance")
    """Label of a recording, and its value where the recording as a whole is a disturbance that is no slip."""

    def __str__(self) -> str:
        return f"frames of {self.window_s:g} s, one every {self.hop_s:g} s"
