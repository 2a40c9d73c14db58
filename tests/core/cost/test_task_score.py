"""Which answer is quick."""

from __future__ import annotations

import pytest

from tactbench.core.cost.task_score import in_unit, quick_estimator, with_all_effects
from tactbench.core.plugins.registry import load_registry
from tactbench.core.spec.scene import Simulation


@pytest.mark.parametrize("task", ["force", "curvature"])
def test_the_quick_answer_is_linear_searches_nothing_and_is_no_trivial_one(task):
    registry = load_registry()
    chosen = registry.estimators[quick_estimator(registry, task)]
    assert registry.tasks[task].spec.kind in chosen.kinds
    assert chosen.linear
    assert not chosen.grid
    assert not chosen.baseline


def test_all_effects_are_asked_for_last_so_that_no_word_before_takes_one_out():
    assert with_all_effects(Simulation(effects=("-creep",), rung="fine")) == Simulation(
        effects=("-creep", "+all"), rung="fine"
    )
    assert with_all_effects(None).effects == ("+all",)


def test_a_number_without_unit_stands_alone():
    assert in_unit(0.25, "1") == "0.25"
    assert in_unit(0.25, "N") == "0.25 N"
