"""Which answer is quick."""

from __future__ import annotations

import pytest

from tactbench.core.cost.task_score import quick_estimator
from tactbench.core.plugins.registry import load_registry


@pytest.mark.parametrize("task", ["force", "curvature"])
def test_the_quick_answer_is_linear_searches_nothing_and_is_no_trivial_one(task):
    registry = load_registry()
    chosen = registry.estimators[quick_estimator(registry, task)]
    assert registry.tasks[task].spec.kind in chosen.kinds
    assert chosen.linear
    assert not chosen.grid
    assert not chosen.baseline
