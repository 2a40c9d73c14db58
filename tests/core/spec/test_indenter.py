"""What is pressed: how a scene says it, and that caps and flat surfaces are stored as they were before shapes."""

import pytest

from tactbench.core.errors import UsageError
from tactbench.core.plugins.registry import installed
from tactbench.core.spec.quantity import assumed


def _q(value, unit="mm"):
    return assumed(value, unit, "a test")


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"length": _q(2)}, "'length'"),
        ({"radius": _q(2, "s")}, "radius: .*'mm'"),
        ({"radius": _q(float("nan"))}, "radius .* nan mm"),
    ],
)
def test_a_dimension_that_cannot_be_is_named_with_what_is_expected(given, says):
    with pytest.raises(UsageError, match=f"'cylinder': {says}"):
        installed().indenters["cylinder"].sizes(given)


def test_dimensions_come_in_the_unit_of_the_shape_and_others_by_default():
    assert installed().indenters["pin"].sizes({"radius": _q(0.003, "m")}) == {"radius": 3.0, "fillet": 0.0}
