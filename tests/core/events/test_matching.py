"""The matching against mir_eval, against all matchings there are, and against its symmetries."""

from itertools import permutations

import mir_eval
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.core.events.matching import match
from tactbench.core.events.metrics import GroundTruth, score_events
from tests.core.events.made import MS, milliseconds, policies, policy, times

GRID_S = 2.0**-9
"""A whole number of nanoseconds, and exact in floating point: both libraries see the same ties."""
GRID_NS = 1_953_125


def random_case(rng):
    """Return onsets, alarms and the window's two sides, in steps of the grid; often crowded, with equal times."""
    length = int(rng.integers(5, 400))
    onset, alarm = (np.sort(rng.integers(0, length, int(rng.integers(0, 25)))) for _ in range(2))
    before, after = (int(side) for side in rng.integers(0, 40, 2))
    return onset, alarm, before, after


def pairs(onset, alarm, before, after):
    sides = policy(before=before * GRID_S, after=after * GRID_S)
    return len(match(onset * GRID_NS, alarm * GRID_NS, sides)[0])


def test_as_many_pairs_as_mir_eval_on_ten_thousand_random_cases():
    rng = np.random.default_rng(19)
    differences = 0
    for _ in range(10_000):
        onset, alarm, before, after = random_case(rng)
        # mir_eval's window is symmetric: the distance from the middle of ours, in half steps.
        theirs = mir_eval.util.match_events(
            onset,
            alarm,
            before + after,
            distance=lambda a, b, middle=after - before: np.abs(2 * np.subtract.outer(b, a).T - middle),
        )
        differences += pairs(onset, alarm, before, after) != len(theirs)
    assert differences == 0


def test_onset_scores_are_those_of_mir_eval():
    rng = np.random.default_rng(20)
    for _ in range(500):
        onset, alarm, window, _ = random_case(rng)
        if onset.size == 0 or alarm.size == 0:
            continue  # mir_eval warns, and says 0 where we say that it cannot be said
        f1, precision, recall = mir_eval.onset.f_measure(onset * GRID_S, alarm * GRID_S, window=window * GRID_S)
        rules = policy(before=window * GRID_S, after=window * GRID_S)
        events = np.column_stack([onset, onset]) * GRID_NS
        ours = score_events([GroundTruth(events, events[:0], (0, 10**10))], [alarm * GRID_NS], rules)
        found = [float(value) for value in (ours.f1, ours.precision, ours.recall)]
        assert found == pytest.approx([f1, precision, recall], rel=1e-12)  # their F1 is a mean of rounded ratios


def largest(onset, alarm, before, after):
    """Return the most pairs over all assignments of the fewer to the more."""
    few, many, sign = (onset, alarm, 1) if onset.size <= alarm.size else (alarm, onset, -1)
    return max(
        sum(-before <= sign * (other - one) <= after for one, other in zip(few, chosen, strict=True))
        for chosen in permutations(many.tolist(), few.size)
    )


few_times = st.lists(st.integers(0, 12), max_size=5).map(lambda ms: np.asarray(ms, dtype=np.int64) * MS)


@given(few_times, few_times, milliseconds, milliseconds)
def test_as_many_pairs_as_any_matching_has(onset, alarm, before, after):
    found = match(onset, alarm, policy(before=before, after=after))[0].size
    assert found == largest(onset, alarm, round(before * 1e9), round(after * 1e9))


@given(times, times, policies)
def test_each_pair_lies_within_the_window_and_nothing_is_used_twice(onset, alarm, sides):
    events, hits = match(onset, alarm, sides)
    late = alarm[hits] - onset[events]
    assert np.all((late >= -round(sides.window_before_s * 1e9)) & (late <= round(sides.window_after_s * 1e9)))
    assert len(set(events.tolist())) == len(set(hits.tolist())) == events.size == hits.size


@given(times, times, policies, st.randoms())
def test_the_order_in_which_events_and_alarms_are_given_does_not_matter(onset, alarm, sides, random):
    shuffled = [np.asarray(random.sample(given.tolist(), given.size), dtype=np.int64) for given in (onset, alarm)]
    found = [
        sorted(zip(a[events].tolist(), b[hits].tolist(), strict=True))
        for a, b in ((onset, alarm), shuffled)
        for events, hits in [match(a, b, sides)]
    ]
    assert found[0] == found[1]


@given(times, times, policies, st.integers(-(10**17), 10**17))
def test_a_shift_of_the_clock_changes_no_pair(onset, alarm, sides, shift):
    moved = match(onset + shift, alarm + shift, sides)
    assert all(np.array_equal(a, b) for a, b in zip(match(onset, alarm, sides), moved, strict=True))


@given(times, times, policies)
def test_events_and_alarms_may_change_places(onset, alarm, sides):
    mirrored = sides.model_copy(
        update={"window_before_s": sides.window_after_s, "window_after_s": sides.window_before_s}
    )
    assert match(onset, alarm, sides)[0].size == match(alarm, onset, mirrored)[0].size


@given(times, times, policies, milliseconds, milliseconds)
def test_a_wider_window_never_has_fewer_pairs(onset, alarm, sides, earlier, later):
    wider = sides.model_copy(
        update={"window_before_s": sides.window_before_s + earlier, "window_after_s": sides.window_after_s + later}
    )
    assert match(onset, alarm, wider)[0].size >= match(onset, alarm, sides)[0].size


def test_of_two_alarms_on_one_event_the_first_is_the_hit():
    events, hits = match(np.array([100 * MS]), np.array([160 * MS, 120 * MS]), policy())
    assert (events.tolist(), hits.tolist()) == ([0], [1])
