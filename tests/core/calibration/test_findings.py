"""Findings by frequency, with Wilson's interval."""

import math

import pytest

from tactbench.core.calibration.draw import Draw
from tactbench.core.calibration.findings import findings, holds, share
from tactbench.core.spec.calibration import Finding
from tests.core.calibration.toy import SOURCE, draws, procedure


@pytest.mark.parametrize(
    ("hits", "n", "low", "high"),
    # Newcombe 1998, Two-sided confidence intervals for the single proportion, table I, method 3.
    [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611), (1, 29, 0.0061, 0.1718)],
)
def test_the_interval_of_a_share_is_wilsons(hits, n, low, high):
    found = share(hits, n)
    assert (found.low, found.high) == (pytest.approx(low, abs=5e-5), pytest.approx(high, abs=5e-5))
    assert found.share == hits / n


def test_no_draw_says_nothing():
    assert share(0, 0) == (0, 0, 0.0, 1.0)
    assert share(0, 0).share is None


def _finding(*comparisons):
    all_of = [{"above": a, "below": b, "margin": margin} for a, b, margin in comparisons]
    return Finding.model_validate(
        {"name": "f", "statement": "s", "all_of": all_of, "reason": "r", "source": SOURCE}
    )  # fmt: skip


def test_a_finding_needs_all_of_its_comparisons_and_their_margins():
    outputs = {"a": 1.0, "b": 0.8, "c": 0.95}
    assert holds(_finding(("a", "b", 0.1)), outputs)
    assert not holds(_finding(("a", "b", 0.3)), outputs)
    assert not holds(_finding(("a", "b", 0.1), ("a", "c", 0.1)), outputs)
    assert holds(_finding(("c", "a", -0.1)), outputs)  # no worse by a margin
    assert not holds(_finding(("c", "a", 0.0)), outputs)
    assert holds(_finding(("a", "d", 0.0)), outputs) is None
    assert holds(_finding(("a", "b", 0.0)), {**outputs, "b": math.nan}) is None


def test_frequencies_are_counted_over_the_prior_and_over_the_accepted():
    spec = procedure()
    some = draws(500)
    (found,) = findings(spec, some)
    by_hand = [draw.outputs["tall"] - draw.outputs["both"] > 3 for draw in some]
    assert (found.prior.hits, found.prior.n) == (sum(by_hand), 500)
    # Near the truth tall is 6 and both 0.6: always.
    assert found.accepted.share == 1
    assert 0 < found.accepted.n < 500
    lacking = Draw(500, 1, some[0].parameters, {"tall": 1.0})
    assert findings(spec, [*some, lacking])[0].prior.n == 500
