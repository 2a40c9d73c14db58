"""What a mapping says of a task, and what follows from it."""

import pytest

from tactbench.core.plugins.registry import load_registry
from tactbench.core.spec.task import DeclaredTask

CHANNEL = {"source": "channel", "kind": "force", "name": "fz", "unit": "N"}
VECTOR = {"source": "vector", "names": ["x", "y"], "unit": "mm"}
LABEL = {"source": "label", "name": "depth", "unit": "mm"}


def declared(target, **more):
    return DeclaredTask.model_validate({"name": "push", "target": target, "splits": ["session"], **more})


@pytest.mark.parametrize(
    ("target", "more", "kind", "metric", "unit"),
    [
        (CHANNEL, {}, "regression", "rmse", "N"),
        (CHANNEL, {"metric": "r2"}, "regression", "r2", "1"),
        (VECTOR, {}, "regression", "mean_euclidean_error", "mm"),
        (LABEL, {}, "classification", "macro_f1", "1"),
        (LABEL, {"answer": "number"}, "regression", "rmse", "mm"),
    ],
)
def test_what_is_left_out_follows_from_the_target(target, more, kind, metric, unit):
    spec = declared(target, **more).spec
    assert (spec.kind, spec.metric, spec.unit, spec.title) == (kind, metric, unit, "push")
    registry = load_registry()
    for name in (*spec.estimators, *spec.baselines):
        assert kind in registry.estimators[name].kinds
    assert all(registry.estimators[name].baseline for name in spec.baselines)
