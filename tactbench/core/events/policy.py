"""What counts as an alarm, a hit and a false alarm: every number stated, none assumed."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from tactbench.core.spec.quantity import Frozen

Seconds = Annotated[float, Field(ge=0, le=1e6, allow_inf_nan=False)]
"""A length of time that int64 nanoseconds hold many times over."""


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
