"""Averages over tasks: between the trivial answer and a reference."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from tactbench.core.statistics.aggregate import aggregate, interquartile_mean, normalised

from .made import mae_row


@given(st.lists(st.floats(-5, 5), min_size=1, max_size=6))
def test_the_middle_half_of_equal_weights_is_the_trimmed_mean(values):
    values = np.repeat(values, 4)  # a number that four divides: scipy cuts whole entries only
    found = interquartile_mean(values[None, :], np.ones(len(values)))[0]
    assert found == pytest.approx(stats.trim_mean(values, 0.25), abs=1e-9)


def test_scores_stand_between_the_trivial_answer_and_the_reference_and_nothing_is_clipped():
    error = mae_row("a", [1.0] * 5, baseline=4.0)
    assert [normalised(error, value) for value in (4.0, 1.0, 0.0, 5.0)] == [0.0, 0.75, 1.0, -0.25]
    assert normalised(error | {"reference_score": 2.0}, 1.0) == 1.5
    share = error | {"metric": "accuracy", "baseline": 0.2}
    assert normalised(share, 0.6) == pytest.approx(0.5)


def test_tasks_weigh_the_same_however_many_sessions_they_have():
    few = mae_row("few", [1.0] * 5, task="few", baseline=2.0)
    many = mae_row("many", [0.0] * 50, task="many", baseline=2.0)
    found = aggregate([few, many])
    assert (found.value, found.tasks, found.entries) == (pytest.approx(0.75), 2, 55)
    # Two estimators in one task share its weight: the other task still counts for half.
    assert aggregate([few, few, many]).value == pytest.approx(0.75)


def test_replicates_in_strata_enter_with_the_one_score():
    found = aggregate([mae_row("a", np.linspace(0.5, 1.5, 40), baseline=2.0, strata=[0] * 20 + [1] * 20)])
    assert (found.value, found.entries) == (pytest.approx(0.5), 1)
    assert found.low < 0.5 < found.high


def test_what_cannot_be_put_between_0_and_1_is_named():
    good = mae_row("a", [1.0] * 5, baseline=2.0)
    found = aggregate([good, good | {"task": "b", "baseline": None}, good | {"task": "c", "baseline": 0.0},
                       good | {"task": "d", "replicates": {}}])  # fmt: skip
    assert found.tasks == 1
    assert [one.split(":")[0] for one in found.left_out] == ["b", "c", "d"]
    assert aggregate([good | {"baseline": None}]) is None
