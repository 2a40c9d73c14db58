"""Which alarm hits which event: a maximum one-to-one matching within the window."""

from __future__ import annotations

import numpy as np

from tactbench.core.samples import IntArray
from tactbench.core.spec.events import AlarmPolicy, nanoseconds


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
