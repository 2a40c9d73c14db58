"""Definitions of slip, alarms, hits and false alarms, with all their parameters."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from tactbench.core.spec.quantity import Frozen

Seconds = Annotated[float, Field(ge=0, le=1e6)]
"""A duration [s], short enough for int64 nanoseconds."""


AREA_PER_MINUTE = 20.0
"""Largest rate of false alarms [1/min] of the range over which recall is averaged to `recall_area` (assumed)."""


def nanoseconds(seconds: float) -> int:
    """Return a duration as whole nanoseconds, so that comparisons of times with limits have no rounding errors."""
    return round(seconds * 1e9)


class AlarmPolicy(Frozen):
    """Rules by which a detector's frames become alarms, and by which alarms count as hits or false alarms.

    No field has a default, as a hidden default may decide the result: with the defaults of timescoring 0.0.7, made for
    seizures, a detector whose last alarm comes 10 s after the event has F1 = 1.
    """

    window_before_s: Seconds
    """Longest time by which an alarm may precede an onset and still count as a hit [s]."""
    window_after_s: Seconds
    """Longest time by which an alarm may follow an onset and still count as a hit [s]."""
    refractory_s: Seconds
    """Time after an alarm in which further alarms are ignored [s]."""
    merge_gap_s: Seconds
    """Longest gap between active frames of one segment [s]; neighbouring active frames always belong to one segment."""
    minimum_length_s: Seconds
    """Time for which a segment must last before it raises its single alarm, at its next active frame [s]."""
    false_alarm_time: Literal["disturbances", "non-events"]
    """Time in which false alarms are counted, as a rate per minute: the declared disturbances or the whole recording,
    in both cases without the events and their windows."""

    def __str__(self) -> str:
        return (
            f"hit from {self.window_before_s:g} s before to {self.window_after_s:g} s after an onset, one alarm to one "
            f"event; refractory {self.refractory_s:g} s, merged up to {self.merge_gap_s:g} s, "
            f"at least {self.minimum_length_s:g} s long; false alarms per minute of {self.false_alarm_time}"
        )


class SlipThresholds(Frozen):
    """Thresholds between stick, incipient slip and gross slip of a contact. No field has a default."""

    hold_s: Seconds = Field(gt=0)
    """Time for which displacements must differ by at most `gross_displacement_m` for a contact to be at rest [s]."""
    gross_displacement_m: float = Field(gt=0)
    """Displacement from the last position of rest above which slip is gross [m]."""
    incipient_slip_share: float = Field(gt=0, lt=1)
    """Value of ``1 - c/a`` (c: radius that sticks, a: radius of the contact) above which slip is incipient [1]."""
    gross_stick_ratio: float = Field(gt=0, lt=1)
    """Ratio c/a, computed from the forces, at or below which the whole contact slips [1]."""
    contact_force_n: float = Field(gt=0)
    """Normal force below which no label is given, for lack of a contact [N]."""

    @model_validator(mode="after")
    def _in_order(self) -> SlipThresholds:
        if 1.0 - self.incipient_slip_share <= self.gross_stick_ratio:
            raise ValueError("1 - incipient_slip_share must exceed gross_stick_ratio: incipient slip is the earlier")
        return self


THRESHOLDS = SlipThresholds(
    hold_s=0.1, gross_displacement_m=1e-4, incipient_slip_share=0.1, gross_stick_ratio=0.1, contact_force_n=0.05
)
"""Thresholds of the published tasks. All five are assumed, as no source states thresholds for a whole contact. They
detect slip faster than 1 mm/s, or in steps of more than 0.1 mm."""


class SlipTarget(Frozen):
    """Target for frames: 1 if the contact slips by the reference, else 0.

    The reference has forces `normal` and `tangential` and a length `slip`, the displacement of surface and skin against
    each other, on one clock; the recording has the coefficient of friction as a label.
    """

    source: Literal["slip"] = "slip"
    hop_s: Seconds = Field(gt=0)
    """Time between the ends of consecutive frames [s]."""
    window_s: Seconds = Field(gt=0)
    """Length of a frame, the time window of one answer [s]."""
    thresholds: SlipThresholds = THRESHOLDS
    friction: str = "friction_coefficient"
    """Name of the recordings' label with the static coefficient of friction [1]."""
    disturbance: tuple[str, str] = ("event", "disturbance")
    """Name of a label of recordings, and the value by which it marks a disturbance without slip."""

    def __str__(self) -> str:
        return f"frames of {self.window_s:g} s, one every {self.hop_s:g} s"
