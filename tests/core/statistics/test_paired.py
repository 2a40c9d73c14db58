"""Two cells compared over replicates, and several comparisons at once."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from tactbench.core.statistics.paired import difference, holm

from .made import mae_row, row

A = np.array([1.20, 1.35, 0.90, 1.10, 1.60, 1.05, 1.45])
B = np.array([1.00, 1.30, 0.95, 0.80, 1.30, 1.00, 1.10])


def test_equal_sessions_of_a_mean_give_students_paired_interval_and_the_p_value_of_all_exchanges():
    """Of a mean over sessions of equal size the jackknife is the textbook."""
    found = difference(mae_row("a", A), mae_row("b", B))
    known = stats.ttest_rel(A, B).confidence_interval(0.95)
    assert found.value == pytest.approx((A - B).mean(), rel=1e-12)
    assert (found.low, found.high) == pytest.approx((known.low, known.high), rel=1e-9)
    known = stats.permutation_test(
        (A, B), lambda a, b, axis: np.mean(a - b, axis=axis), permutation_type="samples", vectorized=True
    )
    assert found.p == pytest.approx(known.pvalue, abs=1e-12)
    assert found.smallest_p == 2 / 2**7


def test_other_replicates_are_not_paired():
    """Then the errors add up, and what sessions share does not cancel."""
    apart = difference(mae_row("a", A), mae_row("b", B, names=[f"t{place}" for place in range(7)]))
    together = difference(mae_row("a", A), mae_row("b", B))
    assert (together.paired, apart.paired, apart.smallest_p) == (True, False, 0.0)
    deviation = np.sqrt(A.var(ddof=1) / 7 + B.var(ddof=1) / 7)
    assert apart.high - apart.value == pytest.approx(stats.t.ppf(0.975, 6) * deviation, rel=1e-9)
    assert apart.p == pytest.approx(2 * stats.t.sf(apart.value / deviation, 6))


def scored(cell, scores, **more):
    """Return a row whose replicates have scores of their own."""
    made = mae_row(cell, scores, **more)
    made["replicates"]["scores"] = scores.tolist()
    return made


@pytest.mark.parametrize(
    ("shift", "same", "verdict"),
    [(0.00, None, "undecided"), (0.30, 0.5, "equivalent"), (0.30, 0.28, "better"), (-0.30, 0.1, "worse")],
)
def test_verdicts_follow_the_interval_and_the_region(shift, same, verdict):
    wobble = np.array([-0.05, 0.05, -0.04, 0.04, -0.03, 0.03, 0.0])
    found = difference(mae_row("a", B, equivalence=same), mae_row("b", B + shift + wobble, equivalence=same))
    assert found.verdict == verdict


def test_without_replicates_nothing_is_decided():
    found = difference(mae_row("a", A, replicates={}), mae_row("b", A + 5))
    assert (found.low, found.p, found.verdict, found.paired) == (None, None, "undecided", False)


def test_equal_answers_are_equivalent_only_where_a_region_is_stated():
    for same, verdict in ((None, "undecided"), (0.1, "equivalent")):
        found = difference(mae_row("a", B, equivalence=same), mae_row("b", B, equivalence=same))
        assert (found.value, found.low, found.high, found.verdict) == (0.0, 0.0, 0.0, verdict)
    exact = np.arange(8) / 8
    for shift in (0.5, -0.5):
        found = difference(scored("a", exact, equivalence=0.5), scored("b", exact + shift, equivalence=0.5))
        assert (found.value, found.verdict) == (-shift, "equivalent"), "its edge is within it"


def test_replicates_that_are_all_alike_have_no_spread_to_compare_with():
    found = difference(mae_row("a", [1.0] * 7), mae_row("b", [2.0] * 7, names="tuvwxyz"))
    assert (found.p, found.smallest_p, found.paired) == (None, None, False)


@pytest.mark.parametrize("n", [7, 30])
def test_scores_of_replicates_themselves_are_exchanged_too(n):
    """All ways of seven; of thirty 9,999 are drawn, and what was observed is counted among them."""
    rng = np.random.default_rng(n)
    a, b = rng.normal(1.0, 0.3, (2, n))
    for shift in (0.0, 10.0):
        found = difference(scored("a", a + shift), scored("b", b))
        known = stats.permutation_test(
            (a + shift, b), lambda x, y, axis: np.mean(x - y, axis=axis), permutation_type="samples", vectorized=True,
            n_resamples=9999, rng=0,
        )  # fmt: skip
        assert found.p == pytest.approx(known.pvalue, abs=1e-12 if n == 7 else 0.02)
        assert found.smallest_p == (2 / 2**7 if n == 7 else 1 / 10_000)
    assert found.p == found.smallest_p


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10_000), replicates=st.integers(5, 16))
def test_exchanging_the_two_turns_everything_round_and_the_order_of_sessions_is_nothing(seed, replicates):
    a, b = np.random.default_rng(seed).gamma(4, 1, (2, replicates))
    one, back = difference(mae_row("a", a), mae_row("b", b)), difference(mae_row("b", b), mae_row("a", a))
    turned = -back.value, -back.high, -back.low
    assert turned == pytest.approx((one.value, one.low, one.high), abs=1e-12)
    assert back.verdict == {"better": "worse", "worse": "better"}.get(one.verdict, one.verdict)
    other = difference(mae_row("a", a[::-1]), mae_row("b", b[::-1]))
    if replicates <= 12:  # beyond, exchanges are drawn, and others for another order
        assert one.p == back.p == other.p
    assert other.verdict == one.verdict
    assert (other.low, other.high) == pytest.approx((one.low, one.high), abs=1e-12)


def test_classes_in_sessions_of_their_own_are_compared_within_classes():
    """What a class is harder than another must not count as spread between sessions."""

    def answered(cell, right):
        sums = np.zeros((10, 4))
        for place, hits in enumerate(right):
            own = place // 5
            sums[place, own * 2 + own], sums[place, own * 2 + 1 - own] = hits, 100 - hits
        return row(cell, sums, metric="accuracy", classes=2, strata=[0] * 5 + [1] * 5)

    easy_and_hard = [90, 91, 92, 93, 94, 40, 41, 42, 43, 44]
    found = difference(answered("a", easy_and_hard), answered("b", [hits + 2 for hits in easy_and_hard]))
    assert found.value == pytest.approx(-0.02)
    assert found.verdict == "worse"
    assert "8 degrees of freedom" in found.method


def test_holms_own_steps():
    """Four at once: 0.01 x 4, 0.02 x 3, 0.03 x 2 raised to the one before, 0.2 x 1."""
    assert holm([0.03, 0.01, None, 0.2, 0.02]) == pytest.approx([0.06, 0.04, None, 0.2, 0.06])
    assert holm([]) == []
    assert holm([0.8, 0.9]) == [1.0, 1.0]
