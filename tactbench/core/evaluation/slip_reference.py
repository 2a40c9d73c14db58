"""Slip of a recording by its reference."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import DataError, NotApplicable
from tactbench.core.evaluation.channels import channel_on, channels_for, require_forward
from tactbench.core.events.labels import UNDECIDED, SlipLabels, slip_labels
from tactbench.core.recording.reader import Recording
from tactbench.core.samples import FloatArray, IntArray
from tactbench.core.spec.events import SlipTarget
from tactbench.core.spec.task import ChannelTarget

SCALES = (1.0, 0.5, 2.0)
"""Of the label thresholds: as stated, halved and doubled."""
_CHANNELS = (
    ChannelTarget(kind="force", name="normal", unit="N"),
    ChannelTarget(kind="force", name="tangential", unit="N"),
    ChannelTarget(kind="position", name="slip", unit="m"),
)


@dataclass(frozen=True)
class SlipReference:
    """The reference's samples, and their labels."""

    t_ns: IntArray
    """(n,) nanoseconds since the first row of the sensor's clock"""
    displacement_m: FloatArray
    """(n,) of surface and skin against each other"""
    force_share: FloatArray
    """(n,) tangential force over friction times normal force; 0 without contact"""
    normal_n: FloatArray
    """(n,)"""
    labels: Mapping[float, SlipLabels]
    """By scale of the thresholds; one under which nothing rests is not there"""
    disturbance: bool
    """Whether the recording as a whole is a disturbance that is no slip"""

    def at(self, ends_ns: IntArray, values: npt.NDArray[Any], missing: float = np.nan) -> npt.NDArray[Any]:
        """Return (k,) the value of the last sample at or before each time, from (n,) values of samples.

        It is `missing` before the first sample and after the last one's interval.
        """
        place = np.searchsorted(self.t_ns, ends_ns, side="right") - 1
        step = int(np.median(np.diff(self.t_ns))) if self.t_ns.size > 1 else 0
        there = (place >= 0) & (ends_ns <= self.t_ns[-1] + step)
        return np.where(there, values[np.maximum(place, 0)], missing)

    def state(self, ends_ns: IntArray, scale: float = 1.0) -> IntArray:
        """Return (k,) states at some times; undecided where the reference has no sample."""
        return self.at(ends_ns, self.labels[scale].state, UNDECIDED)


def slip_reference(recording: Recording, target: SlipTarget, first_ns: int, counts: Counter[str]) -> SlipReference:
    """Read and label the reference of a recording, times counted from `first_ns`.

    `counts` gets the number of samples left out. Raises NotApplicable if a channel or the coefficient of
    friction is missing, DataError if the coefficient is no number or the surface never rests.
    """
    name = recording.meta.name
    found = {str(one.name): channels_for(recording, one) for one in _CHANNELS}
    missing = [called for called, there in found.items() if not there]
    if target.friction not in recording.meta.labels:
        missing.append(f"label {target.friction}")
    if missing:
        raise NotApplicable(
            f"Slip is labelled by the reference's normal, tangential and slip and by the label {target.friction}; "
            f"recording {name!r} has no {', '.join(missing)}.",
            hint="State them in the mapping, or choose another task.",
        )
    clock = recording.read(found["slip"][0][0])
    require_forward(clock, name)
    if clock.t_ns is None:
        raise NotApplicable(f"The reference of recording {name!r} has no clock.", hint="State it in the mapping.")
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
            f"The label {target.friction} of recording {name!r} is {recording.meta.labels[target.friction]!r}.",
            hint="Give a number above 0.",
        )
    labels = {}
    for scale in SCALES:
        try:
            labels[scale] = slip_labels(t_ns, slip, tangential, normal, friction, target.thresholds.scaled(scale))
        except DataError as error:
            if scale == 1.0:
                raise DataError(f"Recording {name!r}: {error.message}", hint=error.hint) from error
    contact = normal >= target.thresholds.contact_force_n
    share = np.divide(np.abs(tangential), friction * normal, out=np.zeros_like(normal), where=contact)
    label, value = target.disturbance
    return SlipReference(t_ns, slip, share, normal, labels, str(recording.meta.labels.get(label)) == value)
