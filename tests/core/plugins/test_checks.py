"""A verdict: one number held against the range it must lie in."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from tactbench.core.plugins.checks import Verdict


@pytest.mark.parametrize(
    ("found", "low", "high", "met"),
    [
        (1.0, 1.0, 2.0, True), (2.0, 1.0, 2.0, True), (math.nextafter(2.0, 3.0), 1.0, 2.0, False),
        (math.nextafter(1.0, 0.0), 1.0, 2.0, False), (-1e300, -math.inf, 0.0, True), (1e300, 0.0, math.inf, True),
        (math.inf, 0.0, math.inf, False), (-math.inf, -math.inf, 0.0, False), (math.nan, -math.inf, math.inf, False),
        (0.0, 1.0, -1.0, False),
    ],
)  # fmt: skip
def test_it_is_met_by_a_finite_number_between_the_ends_both_included(found, low, high, met):
    assert Verdict("depth", found, low, high).met is met


def test_numbers_of_numpy_become_plain_ones():
    verdict = Verdict("depth", np.float32(0.5), np.int64(0), np.array(1.0))
    assert json.dumps([verdict.found, verdict.low, verdict.high]) == "[0.5, 0.0, 1.0]"
