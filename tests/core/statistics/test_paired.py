"""Two cells compared: cross-checked with scipy where it knows the answer, and laws where nobody does."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from tactbench.core.statistics.paired import difference

from .made import mae_row, row

A = np.array([1.20, 1.35, 0.90, 1.10, 1.60, 1.05, 1.45])
B = np.array([1.00, 1.30, 0.95, 0.80, 1.30, 1.00, 1.10])


def test_equal_sessions_of_a_mean_give_students_paired_interval():
    """Of a mean over sessions of equal size the jackknife is the textbook."""
    found = difference(mae_row("a", A), mae_row("b", B))
    known = stats.ttest_rel(A, B).confidence_interval(0.95)
    assert found.value == pytest.approx((A - B).mean(), rel=1e-12)
    assert (found.low, found.high) == pytest.approx((known.low, known.high), rel=1e-9)
    assert found.effect == pytest.approx((A - B).mean() / (A - B).std(ddof=1), rel=1e-9)
    assert found.improved == pytest.approx(1 / 7)  # errors: the first is better in one session of seven
    assert (found.verdict, found.replicates, found.unit, found.paired) == ("worse", 7, "session", True)


def test_the_p_value_is_that_of_all_exchanges():
    found = difference(mae_row("a", A), mae_row("b", B))
    known = stats.permutation_test(
        (A, B), lambda a, b, axis: np.mean(a - b, axis=axis), permutation_type="samples", vectorized=True
    )
    assert found.p == pytest.approx(known.pvalue, abs=1e-12)
    assert found.smallest_p == 2 / 2**7


def test_the_p_value_of_a_square_root_is_that_of_exchanging_sessions_by_hand():
    sums = [np.column_stack([one**2 * 50, np.full(5, 50)]) for one in (A[:5], B[:5])]
    found = difference(row("a", sums[0]), row("b", sums[1]))

    def apart(ways):
        one = np.where(np.array(ways)[:, None], sums[1], sums[0]).sum(axis=0)
        other = np.where(np.array(ways)[:, None], sums[0], sums[1]).sum(axis=0)
        return abs(np.sqrt(one[0] / one[1]) - np.sqrt(other[0] / other[1]))

    every = [apart(ways) for ways in itertools.product((False, True), repeat=5)]
    assert found.p == pytest.approx(np.mean(np.array(every) >= every[0] - 1e-12))
    assert found.smallest_p == 0.0625


def test_many_sessions_draw_their_exchanges_the_same_way_each_time():
    rng = np.random.default_rng(0)
    a, b = rng.normal(5, 1, 30), rng.normal(5.3, 1, 30)
    found = difference(mae_row("a", a), mae_row("b", b))
    assert found == difference(mae_row("a", a), mae_row("b", b))
    known = stats.permutation_test(
        (a, b), lambda x, y, axis: np.mean(x - y, axis=axis), permutation_type="samples", vectorized=True,
        n_resamples=20_000, rng=np.random.default_rng(1),
    )  # fmt: skip
    # Both are estimates: of p = 0.3, 9,999 draws scatter by 0.5 %, 20,000 by 0.3 %; four of their joint deviation.
    assert found.p == pytest.approx(known.pvalue, abs=0.024)
    assert found.smallest_p == 1e-4


def test_other_replicates_are_not_paired():
    """Then the errors add up, and what sessions share does not cancel."""
    apart = difference(mae_row("a", A), mae_row("b", B, names=[f"t{place}" for place in range(7)]))
    together = difference(mae_row("a", A), mae_row("b", B))
    assert not apart.paired
    assert "not paired (they have other replicates)" in apart.method
    assert apart.high - apart.low > together.high - together.low
    deviation = np.sqrt(A.var(ddof=1) / 7 + B.var(ddof=1) / 7)
    assert apart.high - apart.value == pytest.approx(stats.t.ppf(0.975, 6) * deviation, rel=1e-9)


def test_blocks_of_time_say_what_is_not_in_them():
    kept = {"unit": "block of 10 rows in time", "strata": [0] * 40}
    rng = np.random.default_rng(0)
    found = difference(*(mae_row(name, 1 + 0.1 * rng.random(40), **kept) for name in "ab"))
    assert found.method.startswith("paired over 40 blocks of 10 rows in time")
    assert "spread between sessions is not in it" in found.method


def test_neighbouring_blocks_that_hang_together_are_exchanged_together():
    slow = np.repeat([1.0, -1.0, 1.0, 1.0, -1.0], 8)
    kept = {"unit": "block of 10 rows in time", "strata": [0] * 40}
    found = difference(mae_row("a", 5 + slow, run=8, **kept), mae_row("b", np.full(40, 5.0), run=1, **kept))
    assert found.smallest_p == 2 / 2**5
    assert found.p == pytest.approx(1.0)  # three runs up, two down: no split of five is less apart


@pytest.mark.parametrize(
    ("shift", "same", "verdict", "beyond"),
    [
        (0.00, None, "undecided", False), (0.00, 0.5, "equivalent", False), (0.30, 0.5, "equivalent", False),
        (0.30, None, "better", True), (0.30, 0.28, "better", False), (0.30, 0.1, "better", True),
        (-0.30, 0.1, "worse", True),
    ],
)  # fmt: skip
def test_verdicts_follow_the_interval_and_the_region(shift, same, verdict, beyond):
    wobble = np.array([-0.05, 0.05, -0.04, 0.04, -0.03, 0.03, 0.0])
    found = difference(mae_row("a", B, equivalence=same), mae_row("b", B + shift + wobble, equivalence=same))
    assert (found.verdict, found.beyond) == (verdict, beyond)


def test_without_replicates_their_own_intervals_stand_in():
    near = mae_row("a", A, replicates={}, ci_low=0.9, ci_high=1.1)
    far = mae_row("b", A + 5, replicates={}, ci_low=5.9, ci_high=6.1)
    found = difference(near, far)
    assert (found.verdict, found.replicates, found.effect) == ("better", 0, None)
    # Infinite degrees of freedom are taken as 10^9, where t still differs from normal in the ninth digit.
    assert found.high - found.value == pytest.approx(0.1 * np.sqrt(2), rel=1e-8)
    nothing = difference(near, far | {"ci_low": None, "ci_high": None})
    assert (nothing.low, nothing.p, nothing.verdict) == (None, None, "undecided")


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10_000), replicates=st.integers(5, 16), order=st.randoms(use_true_random=False))
def test_exchanging_the_two_turns_everything_round_and_the_order_of_sessions_is_nothing(seed, replicates, order):
    rng = np.random.default_rng(seed)
    a, b = rng.gamma(4, 1, replicates), rng.gamma(4, 1, replicates)
    one, back = difference(mae_row("a", a), mae_row("b", b)), difference(mae_row("b", b), mae_row("a", a))
    assert (back.value, back.low, back.high) == pytest.approx((-one.value, -one.high, -one.low), abs=1e-12)
    assert back.effect == pytest.approx(-one.effect, abs=1e-12)
    assert back.improved == pytest.approx(1 - one.improved)
    turned = {"better": "worse", "worse": "better"}
    assert back.verdict == turned.get(one.verdict, one.verdict)
    if replicates <= 12:  # beyond, exchanges are drawn, and others for another order
        assert back.p == one.p
        places = list(range(replicates))
        order.shuffle(places)
        other = difference(mae_row("a", a[places]), mae_row("b", b[places]))
        assert replace(other, value=0, low=0, high=0, effect=0) == replace(one, value=0, low=0, high=0, effect=0)
        assert other.low == pytest.approx(one.low, abs=1e-12)


def test_classes_in_sessions_of_their_own_are_compared_within_classes():
    """What a class is harder than another must not count as spread between sessions."""

    def answered(cell, right):
        sums = np.zeros((10, 4))
        for place, hits in enumerate(right):
            own = place // 5
            sums[place, own * 2 + own], sums[place, own * 2 + 1 - own] = hits, 100 - hits
        return row(cell, sums, metric="accuracy", classes=2, strata=[0] * 5 + [1] * 5)

    easy_and_hard = [90, 91, 92, 93, 94, 40, 41, 42, 43, 44]
    found = difference(answered("a", easy_and_hard), answered("b", [hits + 2 for hits in easy_and_hard[::-1]][::-1]))
    assert found.value == pytest.approx(-0.02)
    assert found.verdict == "worse"
    assert "8 degrees of freedom" in found.method
