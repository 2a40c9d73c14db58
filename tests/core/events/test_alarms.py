"""Alarms against a detector that sees one frame at a time, which cannot but be causal."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.core.errors import DataError
from tactbench.core.events.alarms import alarms
from tactbench.core.spec.events import nanoseconds
from tests.core.events.made import clocks, policies, policy, seconds


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


@given(frames(), policies, st.integers(-(10**17), 10**17))
def test_a_shift_of_the_clock_shifts_the_alarms(given_frames, rules, shift):
    clock, active = given_frames
    assert np.array_equal(alarms(clock + shift, active, rules), alarms(clock, active, rules) + shift)


def test_the_policy_by_an_example():
    clock = seconds(*(0.01 * np.arange(100)))
    active = np.zeros(100, dtype=np.bool_)
    active[[10, 11, 12, 15, 16, 50, 80, 81, 82, 83]] = True
    assert alarms(clock, active, policy()).tolist() == seconds(0.10, 0.15, 0.50, 0.80).tolist()
    assert alarms(clock, active, policy(merge=0.03)).tolist() == seconds(0.10, 0.50, 0.80).tolist()
    assert alarms(clock, active, policy(minimum=0.02)).tolist() == seconds(0.12, 0.82).tolist()
    assert alarms(clock, active, policy(merge=0.03, minimum=0.05)).tolist() == seconds(0.15).tolist()
    assert alarms(clock, active, policy(refractory=0.4)).tolist() == seconds(0.10, 0.50).tolist()


@pytest.mark.parametrize(
    ("clock", "says"),
    [(seconds(0.0, 0.2, 0.2), "rise"), (seconds(0.0, 0.1), "shape"), (np.array([0.0, 1.0, 2.0]), "int64")],
)
def test_times_that_are_none_are_refused(clock, says):
    with pytest.raises(DataError, match=says):
        alarms(clock, np.ones(3, dtype=np.bool_), policy())
