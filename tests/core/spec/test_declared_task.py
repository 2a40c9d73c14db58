"""What a mapping says of a task, and what follows from it."""

import pytest
from pydantic import ValidationError

from tactbench.core.plugins.registry import load_registry
from tactbench.core.spec.declared_task import DeclaredTask

CHANNEL = {"source": "channel", "kind": "force", "name": "fz", "unit": "N"}
VECTOR = {"source": "vector", "names": ["x", "y"], "unit": "mm"}
LABEL = {"source": "label", "name": "depth", "unit": "mm"}
SUMMARY = {"answer_per": "recording", "summaries": [{"measure": "range"}]}


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


@pytest.mark.parametrize(
    ("target", "more"),
    [
        (CHANNEL, {"answer": "number"}),
        (CHANNEL, {"metric": "macro_f1"}),
        (LABEL, {"metric": "rmse"}),
        (CHANNEL, SUMMARY),
        ({**CHANNEL, "reduce": "max"}, {}),
        (CHANNEL, {"features_by": "os:system"}),
    ],
)
def test_a_declaration_that_makes_no_task_is_refused(target, more):
    with pytest.raises(ValidationError):
        declared(target, **more)
