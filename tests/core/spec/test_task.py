"""Published figures: the sensor's own comes first."""

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
