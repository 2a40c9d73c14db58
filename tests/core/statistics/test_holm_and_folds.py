"""Several comparisons, and folds that overlap: worked examples and laws."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from tactbench.core.statistics.paired import corrected_t, holm, over_folds

from .made import mae_row

P = st.lists(st.floats(0, 1) | st.none(), max_size=12)


def test_holms_own_steps():
    """Four at once: 0.01 x 4, 0.02 x 3, 0.03 x 2 raised to the one before, 0.2 x 1."""
    assert holm([0.03, 0.01, None, 0.2, 0.02]) == pytest.approx([0.06, 0.04, None, 0.2, 0.06])
    assert holm([]) == []


@given(P)
def test_corrected_values_keep_their_order_and_are_never_smaller(p):
    corrected = holm(p)
    made = sorted((value, after) for value, after in zip(p, corrected, strict=True) if value is not None)
    assert [after is None for after in corrected] == [value is None for value in p]
    assert all(value <= after <= 1 for value, after in made)
    assert [after for _, after in made] == sorted(after for _, after in made)
    if made:
        assert made[0][1] == min(1.0, len(made) * made[0][0])  # the smallest as Bonferroni would


@given(P, st.randoms(use_true_random=False))
def test_the_order_in_which_they_are_declared_is_nothing(p, random):
    places = list(range(len(p)))
    random.shuffle(places)
    assert holm([p[place] for place in places]) == [holm(p)[place] for place in places]


D = [0.02, 0.05, -0.01, 0.04, 0.03, 0.06, 0.01, 0.02, 0.05, 0.03]


def test_the_corrected_test_by_hand():
    """Mean 0.03, variance 0.00045 + …: ten folds, one tenth tested, nine trained on."""
    found = corrected_t(D, 1 / 9)
    deviation = np.sqrt((1 / 10 + 1 / 9) * np.var(D, ddof=1))
    assert found.mean == pytest.approx(0.03)
    assert found.p == pytest.approx(2 * stats.t.sf(0.03 / deviation, 9), rel=1e-9)
    assert found.high - found.mean == pytest.approx(stats.t.ppf(0.975, 9) * deviation, rel=1e-9)
    assert "Nadeau and Bengio" in found.method
    repeated = corrected_t(D, 1, repeats=5)
    assert "Bouckaert and Frank" in repeated.method
    assert "2 folds of 5 repeats" in repeated.method


def test_without_overlap_it_is_students_test_and_with_it_always_more_careful():
    assert corrected_t(D, 0.0).p == pytest.approx(stats.ttest_1samp(D, 0).pvalue, rel=1e-9)
    assert corrected_t(D, 0.0).p < corrected_t(D, 1 / 9).p < corrected_t(D, 1 / 4).p


def test_folds_are_taken_by_name_and_one_fold_says_nothing():
    def folded(cell, scores, sizes=(80, 20)):
        named = {f"fold {name}": value for name, value in scores.items()}
        return mae_row(cell, [1.0] * 5, scores=named | {"mae": 9.0}, fold_sizes=dict.fromkeys(named, sizes))

    one, other = folded("a", {"x": 1.0, "y": 2.0, "z": 3.0}), folded("b", {"z": 2.5, "x": 0.4, "y": 1.9})
    found, by_hand = over_folds([(one, other)]), corrected_t([0.6, 0.1, 0.5], 0.25)
    assert (found.mean, found.p) == pytest.approx((by_hand.mean, by_hand.p))
    assert over_folds([(folded("a", {"x": 1.0}), folded("b", {"x": 2.0}))]) is None
    assert over_folds([(one, mae_row("old", [1.0] * 5))]) is None
    assert corrected_t([0.1], 0.25) is None
