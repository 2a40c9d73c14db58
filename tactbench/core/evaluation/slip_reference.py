"""Slip of a recording as measured by its reference sensors of force and position."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import DataError, NotApplicable
from tactbench.core.evaluation.channels import channel_on, channels_for, require_forward
from tactbench.core.events.alarms import GroundTruth
from tactbench.core.events.labels import UNDECIDED, SlipLabels, slip_labels
from tactbench.core.recording.reader import Recording
from tactbench.core.samples import FloatArray, IntArray
from tactbench.core.spec.events import SlipTarget
from tactbench.core.spec.task import ChannelTarget

_CHANNELS = (
    ChannelTarget(kind="force", name="normal", unit="N"),
    ChannelTarget(kind="force", name="tangential", unit="N"),
    ChannelTarget(kind="position", name="slip", unit="m"),
)


@dataclass(frozen=True)
class SlipReference:
    """Samples of the slip reference of one recording, and their slip labels."""

    t_ns: IntArray
    """(n,) times [ns] since the first row of the sensor's clock"""
    force_share: FloatArray
    """(n,) ratio of tangential force to friction coefficient times normal force; 0 without contact"""
    normal_n: FloatArray
    """(n,) normal force [N]"""
    labels: SlipLabels
    disturbance: bool
    """True if the whole recording is a disturbance without slip"""

    def at(self, ends_ns: IntArray, values: npt.NDArray[Any], missing: float = np.nan) -> npt.NDArray[Any]:
        """Return (k,) values of the last sample at or before each of (k,) times [ns], from (n,) `values` of samples.

        The value is `missing` before the first sample, and later than one interval after the last sample.
        """
        place = np.searchsorted(self.t_ns, ends_ns, side="right") - 1
        step = int(np.median(np.diff(self.t_ns))) if self.t_ns.size > 1 else 0
        there = (place >= 0) & (ends_ns <= self.t_ns[-1] + step)
        return np.where(there, values[np.maximum(place, 0)], missing)

    def state(self, ends_ns: IntArray) -> IntArray:
        """Return the (k,) slip states at (k,) times [ns]; ``UNDECIDED`` where the reference has no sample."""
        return self.at(ends_ns, self.labels.state, UNDECIDED)

    def truth(self, ends_ns: IntArray) -> GroundTruth:
        """Return the events from the first frame on, for frames that end at (n,) times [ns]."""
        begin, close = int(ends_ns[0]), int(ends_ns[-1]) + 1
        onset = self.labels.gross_ns[:, 0]
        events = self.labels.gross_ns[(onset >= begin) & (onset < close)]
        return GroundTruth(events, self.disturbance, (begin, close))


def slip_reference(recording: Recording, target: SlipTarget, first_ns: int, counts: Counter[str]) -> SlipReference:
    """Read the slip reference of a recording and label its samples; times are counted from `first_ns`.

    Samples left out are counted in `counts`. Raises NotApplicable if a channel or the coefficient of friction is
    missing, DataError if the coefficient is not a positive number or the surface is never at rest.
    """
    name = recording.meta.name
    found = {str(one.name): channels_for(recording, one) for one in _CHANNELS}
    missing = [called for called, there in found.items() if not there]
    if target.friction not in recording.meta.labels:
        missing.append(f"label {target.friction}")
    if missing:
        raise NotApplicable(
            f"Slip labels need the reference channels normal, tangential and slip, and the label {target.friction}; "
            f"recording {name!r} has no {', '.join(missing)}.",
            hint="State what is missing in the mapping, or choose another task.",
        )
    clock = recording.read(found["slip"][0][0])
    require_forward(clock, name)
    if clock.t_ns is None:
        raise NotApplicable(f"The reference of recording {name!r} has no clock.", hint="State a clock in the mapping.")
    columns = np.array([channel_on(recording, one, clock) for one in _CHANNELS])
    whole = ~np.isnan(columns).any(axis=0)
    if not whole.all():
        counts["samples of the reference left out because a channel has none"] += int((~whole).sum())
    normal, tangential, slip = columns[:, whole]
    t_ns = clock.t_ns[whole] - first_ns
    try:
        friction = float(recording.meta.labels[target.friction])
    except ValueError:
        friction = np.nan
    if not 0 < friction < np.inf:
        raise DataError(
            f"Label {target.friction} of recording {name!r} is {recording.meta.labels[target.friction]!r}.",
            hint="State the coefficient of friction, a number above 0.",
        )
    try:
        labels = slip_labels(t_ns, slip, tangential, normal, friction, target.thresholds)
    except DataError as error:
        raise DataError(f"Recording {name!r}: {error.message}", hint=error.hint) from error
    contact = normal >= target.thresholds.contact_force_n
    share = np.divide(np.abs(tangential), friction * normal, out=np.zeros_like(normal), where=contact)
    label, value = target.disturbance
    return SlipReference(t_ns, share, normal, labels, str(recording.meta.labels.get(label)) == value)
