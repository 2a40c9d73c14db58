"""Definitions of slip, alarms, hits and false alarms, with all their numbers."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from tactbench.core.spec.quantity import Frozen

Seconds = Annotated[float, Field(ge=0, le=1e6)]
"""A duration [s], short enough for int64 nanoseconds."""


AREA_PER_MINUTE = 20.0
"""Largest rate of false alarms up to which recall is averaged to `recall_area` [1/min] (assumed)."""


def nanoseconds(seconds: float) -> int:
    """Return a duration in whole nanoseconds; times are compared as integers, so that rounding decides no hit."""
    return round(seconds * 1e9)


class AlarmPolicy(Frozen):
    """Rules by which frames of a detector become alarms, and alarms become hits or false alarms.

    No field has a default, as a hidden one may decide the result: those of timescoring 0.0.7, made for seizures, give
    F1 = 1 to a detector whose last alarm comes 10 s after the event.
    """

    window_before_s: Seconds
    """Longest time by which an alarm that hits comes before an onset [s]."""
    window_after_s: Seconds
    """Longest time by which an alarm that hits comes after an onset [s]."""
    refractory_s: Seconds
    """Time after an alarm in which further alarms are dropped [s]."""
    merge_gap_s: Seconds
    """Longest gap between active frames of one segment [s]; neighbouring active frames always share one."""
    minimum_length_s: Seconds
    """Time after which a segment raises its one alarm, at its next active frame [s]."""
    false_alarm_time: Literal["disturbances", "non-events"]
    """Stretches in which false alarms are counted, per minute of them: the declared disturbances or the recording,
    both without events and their windows."""

    def __str__(self) -> str:
        return (
            f"hit from {self.window_before_s:g} s before to {self.window_after_s:g} s after an onset, one alarm to one "
            f"event; refractory {self.refractory_s:g} s, merged up to {self.merge_gap_s:g} s, "
            f"at least {self.minimum_length_s:g} s long; false alarms per minute of {self.false_alarm_time}"
        )


class SlipThresholds(Frozen):
    """Thresholds between stick, incipient slip and gross slip. No field has a default."""

    hold_s: Seconds = Field(gt=0)
    """Duration over which the displacements of a resting contact differ by `gross_displacement_m` at most [s]."""
    gross_displacement_m: float = Field(gt=0)
    """Displacement after such a rest above which slip is gross [m]."""
    incipient_slip_share: float = Field(gt=0, lt=1)
    """Value of ``1 - c/a`` above which slip is incipient [1]."""
    gross_stick_ratio: float = Field(gt=0, lt=1)
    """Value of c/a at or below which the whole contact slips, by its forces [1]."""
    contact_force_n: float = Field(gt=0)
    """Normal force below which there is no contact to label [N]."""

    @model_validator(mode="after")
    def _in_order(self) -> SlipThresholds:
        if 1.0 - self.incipient_slip_share <= self.gross_stick_ratio:
            raise ValueError("1 - incipient_slip_share must exceed gross_stick_ratio: incipient slip comes first")
        return self

    def scaled(self, factor: float) -> SlipThresholds:
        """Return thresholds with displacement, slip share and stick ratio multiplied by `factor`.

        `hold_s` and `contact_force_n` are not scaled: they decide where labels exist.
        """
        names = ("gross_displacement_m", "incipient_slip_share", "gross_stick_ratio")
        changed = {name: factor * getattr(self, name) for name in names}
        return SlipThresholds.model_validate({**self.model_dump(), **changed})


THRESHOLDS = SlipThresholds(
    hold_s=0.1, gross_displacement_m=1e-4, incipient_slip_share=0.1, gross_stick_ratio=0.1, contact_force_n=0.05
)
"""The thresholds of the published tasks. All five are assumed, as no source states them for a whole contact. They
detect slip faster than 1 mm/s, or by steps of more than 0.1 mm."""


class SlipTarget(Frozen):
    """The target of frames: whether the contact slips, by the reference.

    The reference has forces `normal` and `tangential` and a length `slip`, the displacement of surface and skin against
    each other, on one clock; the recording has the coefficient of friction as a label.
    """

    source: Literal["slip"] = "slip"
    hop_s: Seconds = Field(gt=0)
    """Time between the ends of two frames [s]."""
    window_s: Seconds = Field(gt=0)
    """Length of a frame [s]."""
    thresholds: SlipThresholds = THRESHOLDS
    friction: str = "friction_coefficient"
    """Label of a recording that holds the static coefficient of friction [1]."""
    disturbance: tuple[str, str] = ("event", "disturbance")
    """Label of a recording, and its value for a disturbance without slip."""

    def __str__(self) -> str:
        return f"frames of {self.window_s:g} s, one every {self.hop_s:g} s"
