"""What is said before the results are known: comparisons, and what is practically the same."""

import pytest
from pydantic import ValidationError

from tactbench.core.spec.matrix import ComparisonChoice


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({}, "give one of them"),
        ({"sensors": ("a", "b"), "estimators": ("c", "d")}, "give one of them"),
        ({"sensors": ("a", "a")}, "compared with itself"),
        ({"sensors": ("a",)}, "at least 2|missing|length"),
        ({"sensor": ("a", "b")}, "sensor"),
    ],
)
def test_a_comparison_that_is_none_is_refused(given, says):
    with pytest.raises(ValidationError, match=says):
        ComparisonChoice(**given)
