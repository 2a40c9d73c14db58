"""Alarms against a detector that sees one frame at a time; their matching against mir_eval."""

import mir_eval
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tactbench.core.events.alarms import alarms, match
from tactbench.core.spec.events import nanoseconds
from tests.core.events.made import MS, clocks, policies, policy


@st.composite
def frames(draw):
    clock = draw(clocks)
    active = draw(st.lists(st.booleans(), min_size=clock.size, max_size=clock.size))
    return clock, np.asarray(active, dtype=np.bool_)


def one_by_one(clock, active, rules):
    """Return the alarms of a detector that decides at each frame and never looks back at more than its own state."""
    gap, length, refractory = (nanoseconds(s) for s in (rules.merge_gap_s, rules.minimum_length_s, rules.refractory_s))
    raised, begun, last, was_active, told = [], None, None, False, False
    for now, on in zip(clock.tolist(), active.tolist(), strict=True):
        if on:
            if not (was_active or (last is not None and now - last <= gap)):
                begun, told = now, False
            if not told and now - begun >= length:
                told = True
                if not raised or now - raised[-1] >= refractory:
                    raised.append(now)
            last = now
        was_active = on
    return raised


@given(frames(), policies)
def test_alarms_are_those_of_a_detector_that_sees_one_frame_at_a_time(given_frames, rules):
    assert alarms(*given_frames, rules).tolist() == one_by_one(*given_frames, rules)


GRID_S = 2.0**-9
"""A whole number of nanoseconds, and exact in floating point: both libraries see the same ties."""
GRID_NS = 1_953_125


def test_as_many_pairs_as_mir_eval_on_ten_thousand_random_cases():
    rng = np.random.default_rng(19)
    differences = 0
    for _ in range(10_000):
        # Onsets, alarms and the window's two sides, in steps of the grid; often crowded, with equal times.
        length = int(rng.integers(5, 400))
        onset, alarm = (np.sort(rng.integers(0, length, int(rng.integers(0, 25)))) for _ in range(2))
        before, after = (int(side) for side in rng.integers(0, 40, 2))

        # mir_eval's window is symmetric: the distance from the middle of ours, in half steps.
        def distance(a, b, middle=after - before):
            return np.abs(2 * np.subtract.outer(b, a).T - middle)

        theirs = mir_eval.util.match_events(onset, alarm, before + after, distance=distance)
        sides = policy(before=before * GRID_S, after=after * GRID_S)
        differences += len(match(onset * GRID_NS, alarm * GRID_NS, sides)[0]) != len(theirs)
    assert differences == 0


def test_of_two_alarms_on_one_event_the_first_is_the_hit():
    events, hits = match(np.array([100 * MS]), np.array([160 * MS, 120 * MS]), policy())
    assert (events.tolist(), hits.tolist()) == ([0], [1])
