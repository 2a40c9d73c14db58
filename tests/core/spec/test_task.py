"""Published figures stand beside rows they are comparable with, and no others."""

import pytest

from tactbench.core.plugins.registry import load_registry
from tactbench.core.spec.task import Published

FORCE = load_registry().tasks["force"].spec
KARL = {"protocol": "karl2016", "estimator": "lasso"}


def test_the_sensors_own_figure_comes_first():
    both = FORCE.model_copy(update={"published": (
        Published(score=1.0, reference="any", **KARL), Published(score=2.0, reference="own", sensor="icub", **KARL),
    )})  # fmt: skip
    assert both.published_for("icub", "karl2016", "lasso", None).score == 2.0
    assert both.published_for("biotac", "karl2016", "lasso", None).score == 1.0


@pytest.mark.parametrize(
    ("asked", "fits"),
    [
        (("karl2016", "lasso", "roles"), True),
        (("deployable", "lasso", "roles"), False),
        (("karl2016", "ridge", "roles"), False),
        (("karl2016", "lasso", "session"), False),
        (("karl2016", "lasso", None), True),
    ],
)
def test_protocol_estimator_and_split_must_fit(asked, fits):
    one = Published(score=0.5, reference="r", split="roles", **KARL)
    found = FORCE.model_copy(update={"published": (one,)}).published_for("icub", *asked)
    assert found == (one if fits else None)
