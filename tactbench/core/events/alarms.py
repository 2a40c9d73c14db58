"""From frames that say yes or no to alarms, causally."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import DataError
from tactbench.core.samples import IntArray
from tactbench.core.spec.events import AlarmPolicy, nanoseconds


def alarms(t_ns: IntArray, active: npt.NDArray[np.bool_], policy: AlarmPolicy) -> IntArray:
    """Return when alarms are known [ns], in order of time.

    Parameters
    ----------
    t_ns
        (n,) when each frame's answer is known, strictly rising: the end of its window. What the detector needs to
        compute it is added by the caller. Where samples are lost, the caller cuts: neighbours are taken as neighbours.
    active
        (n,) whether the frame says "event", such as ``score >= threshold``.
    policy
        Merging, minimum length and refractory time.

    Notes
    -----
    An alarm at t depends on frames up to t alone. Active frames belong to one segment if they are neighbours or at
    most `merge_gap_s` apart. A segment raises one alarm, at its first active frame at least `minimum_length_s` after
    its first frame; within a gap nobody knows yet whether it will be bridged. An alarm less than `refractory_s` after
    the last one that was kept is dropped.
    """
    check_times(t_ns, active.shape)
    on = np.flatnonzero(active)
    if on.size == 0:
        return np.zeros(0, dtype=np.int64)
    t = t_ns[on]
    apart = (np.diff(on) > 1) & (np.diff(t) > nanoseconds(policy.merge_gap_s))
    segment = np.concatenate([[0], np.cumsum(apart)])
    first = t[np.concatenate([[True], apart])][segment]
    long_enough = t - first >= nanoseconds(policy.minimum_length_s)
    _, places = np.unique(segment[long_enough], return_index=True)
    raised = t[long_enough][places]
    return np.asarray(raised[kept(raised, nanoseconds(policy.refractory_s))])


def kept(raised_ns: IntArray, refractory_ns: int) -> IntArray:
    """Return the places of the alarms that the refractory time leaves, of alarms in order of time."""
    if refractory_ns == 0 or raised_ns.size < 2:
        return np.arange(raised_ns.size)
    following = np.searchsorted(raised_ns, raised_ns + refractory_ns, side="left").tolist()
    places, place = [], 0
    while place < len(following):
        places.append(place)
        place = following[place]
    return np.asarray(places, dtype=np.int64)


def check_times(t_ns: IntArray, shape: tuple[int, ...]) -> None:
    """Raise DataError unless the times are integers, strictly rising, one a frame."""
    if t_ns.dtype != np.int64:
        raise DataError(f"Times of frames are {t_ns.dtype}, not int64.", hint="Give nanoseconds.")
    if t_ns.ndim != 1 or t_ns.shape != shape:
        raise DataError(f"There are times of shape {t_ns.shape} for frames of shape {shape}.", hint="Give one a frame.")
    if np.any(np.diff(t_ns) <= 0):
        raise DataError("Times of frames do not rise strictly.", hint="Sort them, or cut where the clock runs back.")
