"""What is said before the results are known: comparisons, and what is practically the same."""

import pytest
from pydantic import ValidationError

from tactbench.core.cli.config import default_matrix
from tactbench.core.spec.matrix import ComparisonChoice


def test_what_is_declared_is_run():
    """A comparison of an estimator that the matrix does not have would never be made."""
    matrix = default_matrix()
    choices = {choice.name: {one.name for one in choice.estimators} for choice in matrix.tasks}
    for one in matrix.comparisons:
        assert set(one.sensors or ()) <= set(matrix.sensors)
        assert one.task in choices
        assert set(one.estimators or ()) <= choices[one.task]


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
