"""Random policies, recordings and alarms on a grid of a millisecond, so that times on a window's edge are common."""

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from tactbench.core.events.alarms import GroundTruth, ScoredRecording
from tactbench.core.spec.events import AlarmPolicy

MS = 1_000_000
"""Nanoseconds of a millisecond."""


def policy(before=0.05, after=0.2, refractory=0.0, merge=0.0, minimum=0.0, time="non-events"):
    return AlarmPolicy(
        window_before_s=before, window_after_s=after, refractory_s=refractory, merge_gap_s=merge,
        minimum_length_s=minimum, false_alarm_time=time,
    )  # fmt: skip


def seconds(*values):
    """Return times [ns] of seconds."""
    return np.round(np.asarray(values, dtype=np.float64) * 1e9).astype(np.int64)


def truth(events=(), disturbance=False, span=(0.0, 60.0)):
    """Return a ground truth stated in seconds."""
    begin, end = seconds(*span).tolist()
    return GroundTruth(seconds(events).reshape(-1, 2), disturbance, (begin, end))


milliseconds = st.integers(0, 8).map(lambda ms: ms / 1000)
policies = st.builds(
    policy, before=milliseconds, after=milliseconds, refractory=milliseconds, merge=milliseconds,
    minimum=milliseconds, time=st.sampled_from(["disturbances", "non-events"]),
)  # fmt: skip
clocks = st.lists(st.integers(1, 4), max_size=30).map(lambda steps: np.cumsum(np.asarray(steps, dtype=np.int64)) * MS)
stretches = st.lists(st.tuples(st.integers(0, 60), st.integers(0, 15)), max_size=3).map(
    lambda pairs: np.asarray([(begin, begin + length) for begin, length in pairs], dtype=np.int64).reshape(-1, 2) * MS
)
truths = st.builds(
    lambda events, disturbance, length: GroundTruth(events, disturbance, (0, length * MS)),
    stretches, st.booleans(), st.integers(0, 90),
)  # fmt: skip


@st.composite
def scored_recordings(draw):
    """Few distinct scores, so that ties are common, and some frames without an answer."""
    clock, few = draw(clocks), st.sampled_from([0.0, 1.0, 2.0, 2.5, 3.0, 7.0, np.nan])
    return ScoredRecording(clock, draw(arrays.arrays(np.float64, clock.size, elements=few)), draw(truths))
