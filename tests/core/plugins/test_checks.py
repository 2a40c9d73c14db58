"""A verdict: one number held against the range it must lie in."""

import json
import math

import numpy as np
import pytest

from tactbench.core.plugins.checks import Verdict


@pytest.mark.parametrize(
    ("found", "low", "high", "met"),
    [(1.0, 1.0, 2.0, True), (2.0, 1.0, 2.0, True), (2.5, 1.0, 2.0, False), (0.5, 1.0, 2.0, False),
     (math.inf, 0.0, math.inf, False), (math.nan, -math.inf, math.inf, False)],
)  # fmt: skip
def test_it_is_met_by_a_finite_number_between_the_ends_both_included(found, low, high, met):
    assert Verdict("depth", found, low, high).met is met
    json.dumps(Verdict("depth", np.asarray(found), low, high).found)  # a plain number
