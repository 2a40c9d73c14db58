"""Labels of a made drag whose truth is known, and of the twin's own closed forms."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.core.errors import DataError
from tactbench.core.events.labels import GROSS, INCIPIENT, STICK, UNDECIDED, at_rest, slip_labels, stick_ratio
from tactbench.core.spec.events import THRESHOLDS
from tests.core.events.made import MS, clocks, seconds

MU, P = 0.8, 2.0
SPEED = 0.01
"""Of the drag [m/s]."""


def drag():
    """Return a press, a hold, a rising pull, a slip from 1.0 s to 1.5 s, a hold, and a lift at 2.0 s."""
    t = 0.001 * np.arange(2500)
    displacement = SPEED * np.clip(t - 1.0, 0.0, 0.5)
    normal = np.where(t < 2.0, P, 0.0)
    pull = np.interp(t, [0.0, 0.5, 1.0, 1.5, 1.55, 2.5], [0.0, 0.0, MU * P, MU * P, 0.0, 0.0])
    return t, displacement, pull, normal


def labelled(factor=1.0, keep=slice(None)):
    """Return times and labels of a part of the drag, with `factor` times the displacement of a slip."""
    t, displacement, pull, normal = (one[keep] for one in drag())
    rules = THRESHOLDS.model_copy(update={"gross_displacement_m": factor * THRESHOLDS.gross_displacement_m})
    return t, slip_labels(seconds(*t), displacement, pull, normal, MU, rules)


@pytest.mark.parametrize("factor", [0.5, 1.0, 2.0])
def test_a_drag_has_one_slip_whose_onset_is_the_threshold_over_the_speed_late(factor):
    t, labels = labelled(factor)
    late = factor * THRESHOLDS.gross_displacement_m / SPEED
    # Two samples: "more than" on a grid of 1 ms, and the rounding of a multiple of it.
    assert labels.gross_ns[:, 0] / 1e9 == pytest.approx([1.0 + late], abs=2.1e-3)
    assert labels.gross_ns[:, 1] / 1e9 == pytest.approx([1.5 - late], abs=2.1e-3)
    assert np.all(labels.state[t < 0.5] == STICK)
    assert np.all(labels.state[(t > 1.0 + late + 2e-3) & (t < 1.5 - late - 2e-3)] == GROSS)
    assert np.all(labels.state[t > 2.0] == UNDECIDED)


def test_incipient_slip_lies_between_its_two_stick_ratios():
    t, labels = labelled()
    begins = 1.0 - (1.0 - THRESHOLDS.incipient_slip_share) ** 3  # Q/(mu P) where c/a is that
    ends = 1.0 - THRESHOLDS.gross_stick_ratio**3
    share = np.interp(t, [0.5, 1.0], [0.0, 1.0])
    rising = (t > 0.5) & (t < 1.0)
    clear = rising & (np.abs(share - begins) > 1e-9) & (np.abs(share - ends) > 1e-9)
    expected = np.where(share <= begins, STICK, np.where(share < ends, INCIPIENT, UNDECIDED))
    assert np.array_equal(labels.state[clear], expected[clear])


def test_the_stick_ratio_by_hand():
    pull = np.array([0.0, 7 / 8 * MU * P, -7 / 8 * MU * P, MU * P, 2 * MU * P, 1.0])
    normal = np.array([P, P, P, P, P, 0.0])
    assert stick_ratio(pull, normal, MU) == pytest.approx([1.0, 0.5, 0.5, 0.0, 0.0, np.nan], nan_ok=True, abs=1e-5)


def test_motion_in_the_air_and_motion_from_the_first_sample_are_no_events():
    t, displacement, pull, normal = drag()
    aloft = slip_labels(seconds(*t), displacement, pull, np.zeros_like(normal), MU, THRESHOLDS)
    assert aloft.gross_ns.shape == (0, 2)
    assert np.all(aloft.state == UNDECIDED)
    _, moving = labelled(keep=t >= 1.2)
    assert moving.gross_ns.shape == (0, 2)
    assert np.any(moving.state == GROSS)


def holds_one_by_one(t, moved, hold, allowed):
    """Return which samples lie in a hold, as the definition says it, sample by sample."""

    def ahead(at):
        inside = [k for k in range(at, t.size) if k == at or t[k - 1] - t[at] < hold]
        return t[-1] - t[at] >= hold and np.ptp(moved[inside]) <= allowed

    def behind(at, begin):
        inside = [k for k in range(begin, at + 1) if k == at or t[at] - t[k + 1] < hold]
        return np.ptp(moved[inside]) <= allowed

    rest, begin, onset = np.zeros(t.size, dtype=np.bool_), None, None
    for at in range(t.size):
        if begin is not None and not behind(at, begin):
            begin, onset = None, at
        if begin is None and ahead(at):
            begin = at
        rest[at] = begin is not None and at != onset
    return rest


@given(clocks, st.data(), st.integers(1, 6), st.integers(1, 3))
def test_a_hold_is_what_its_definition_says(clock, data, hold_ms, allowed):
    """In whole metres, so that displacement is compared exactly."""
    steps = data.draw(st.lists(st.sampled_from([0, 0, 0, 1, -1, 3, 9]), min_size=clock.size, max_size=clock.size))
    moved = np.cumsum(np.asarray(steps, dtype=np.float64))
    rules = THRESHOLDS.model_copy(update={"hold_s": hold_ms / 1000, "gross_displacement_m": float(allowed)})
    assert np.array_equal(at_rest(clock, moved, rules), holds_one_by_one(clock, moved, hold_ms * MS, allowed))


@pytest.mark.parametrize("samples", [1, 2, 5])
def test_a_slip_as_short_as_a_sample_is_a_slip(samples):
    t = 0.001 * np.arange(1000)
    jump = 1.5 * THRESHOLDS.gross_displacement_m * np.clip((np.arange(1000) - 500) / samples, 0.0, 1.0)
    pull = np.full(1000, 0.5 * MU * P)
    labels = slip_labels(seconds(*t), jump, pull, np.full(1000, P), MU, THRESHOLDS)
    assert labels.gross_ns[:, 0].tolist() == seconds(t[500 + math.ceil(samples / 1.5)]).tolist()


def test_a_surface_that_never_rests_is_refused():
    with pytest.raises(DataError, match="never rests"):
        labelled(keep=slice(1101, 1400))


@pytest.mark.parametrize(("step_ns", "says"), [(0, "do not rise"), (1, "never rests")])
def test_times_rise_strictly(step_ns, says):
    with pytest.raises(DataError, match=says):
        slip_labels(np.arange(4) * step_ns, np.zeros(4), np.zeros(4), np.zeros(4), MU, THRESHOLDS)
