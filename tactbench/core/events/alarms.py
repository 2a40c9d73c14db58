"""From frames that say yes or no to alarms, causally; and which alarm hits which event."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

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
    on = np.flatnonzero(active)
    if on.size == 0:
        return np.zeros(0, dtype=np.int64)
    t = t_ns[on]
    apart = (np.diff(on) > 1) & (np.diff(t) > nanoseconds(policy.merge_gap_s))
    segment = np.concatenate([[0], np.cumsum(apart)])
    first = t[np.concatenate([[True], apart])][segment]
    long_enough = t - first >= nanoseconds(policy.minimum_length_s)
    raised = t[long_enough][np.flatnonzero(np.diff(segment[long_enough], prepend=-1))]
    return np.asarray(raised[_kept(raised, nanoseconds(policy.refractory_s))])


def _kept(raised_ns: IntArray, refractory_ns: int) -> IntArray:
    """Return the places of the alarms that the refractory time leaves, of alarms in order of time."""
    if refractory_ns == 0:
        return np.arange(raised_ns.size)
    following = np.searchsorted(raised_ns, raised_ns + refractory_ns, side="left").tolist()
    places, place = [], 0
    while place < len(following):
        places.append(place)
        place = following[place]
    return np.asarray(places, dtype=np.int64)


def match(onset_ns: IntArray, alarm_ns: IntArray, policy: AlarmPolicy) -> tuple[IntArray, IntArray]:
    """Return the places of matched onsets and those of their alarms, as many pairs as there can be.

    Parameters
    ----------
    onset_ns, alarm_ns
        (n,) and (m,) times [ns], in any order.
    policy
        Its window: an alarm may hit an onset from `window_before_s` before to `window_after_s` after it, both ends
        included.

    Notes
    -----
    In order of time each event takes the earliest alarm that is left in its window. All windows are equally long, so
    that their beginnings and ends come in the same order: an alarm passed over is too early for all later events, and
    to take the earliest leaves every later event at least as much choice. The number of pairs is therefore the largest
    possible [1]_ (a convex bipartite graph whose intervals do not nest). It takes O(n log n + m log m).

    Of all largest matchings this is the one of first alarms: an event that is announced twice within its window has the
    latency of the first announcement, and the second is a false positive.

    References
    ----------
    .. [1] Glover 1967, Maximum matching in a convex bipartite graph, Naval Research Logistics Quarterly 14, 313-316.
    """
    before, after = nanoseconds(policy.window_before_s), nanoseconds(policy.window_after_s)
    event_order, alarm_order = np.argsort(onset_ns, kind="stable"), np.argsort(alarm_ns, kind="stable")
    alarms = alarm_ns[alarm_order].tolist()
    events, hits, place = [], [], 0
    for event, onset in enumerate(onset_ns[event_order].tolist()):
        while place < len(alarms) and alarms[place] < onset - before:
            place += 1
        if place == len(alarms):
            break
        if alarms[place] <= onset + after:
            events.append(event)
            hits.append(place)
            place += 1
    return event_order[events].astype(np.int64), alarm_order[hits].astype(np.int64)
