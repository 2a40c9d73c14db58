"""Published figures stand beside rows they are comparable with, and no others."""

import pytest

from tactbench.core.plugins.registry import load_registry
from tactbench.core.spec.task import Published


@pytest.fixture(scope="module")
def force():
    return load_registry().tasks["force"].spec


def test_the_sensors_own_figure_comes_first(force):
    both = force.model_copy(update={"published": (
        Published(score=1.0, reference="any", protocol="karl2016", estimator="lasso"),
        Published(score=2.0, reference="own", protocol="karl2016", estimator="lasso", sensor="icub"),
    )})  # fmt: skip
    assert both.published_for("icub", "karl2016", "lasso", None).score == 2.0
    assert both.published_for("biotac", "karl2016", "lasso", None).score == 1.0


@pytest.mark.parametrize(
    ("protocol", "estimator", "split", "score"),
    [
        ("karl2016", "lasso", "roles", 0.5),
        ("deployable", "lasso", "roles", None),
        ("karl2016", "ridge", "roles", None),
        ("karl2016", "lasso", "session", None),
        ("karl2016", "lasso", None, 0.5),
    ],
)
def test_protocol_estimator_and_split_must_fit(force, protocol, estimator, split, score):
    one = Published(score=0.5, reference="r", protocol="karl2016", estimator="lasso", split="roles")
    found = force.model_copy(update={"published": (one,)}).published_for("icub", protocol, estimator, split)
    assert (found.score if found else None) == score
