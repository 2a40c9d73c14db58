"""Comparisons that are said before the results are known."""

import pytest
from pydantic import ValidationError

from tactbench.core.spec.matrix import ComparisonChoice


def test_a_comparison_that_is_none_is_refused():
    for given in ({}, {"sensors": ("a", "b"), "estimators": ("c", "d")}, {"sensors": ("a", "a")}, {"sensors": ("a",)}):
        with pytest.raises(ValidationError):
            ComparisonChoice(**given)
