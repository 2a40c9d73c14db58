import pytest

from tactbench.core.errors import UnknownNameError, UsageError
from tactbench.core.matrix.plan import plan_cells
from tactbench.core.matrix.plan_recordings import request_key
from tactbench.core.plugins.registry import load_registry
from tactbench.core.spec.matrix import EstimatorChoice, MatrixSpec, TaskChoice


@pytest.fixture(scope="module")
def registry():
    return load_registry()


def plan(registry, *tasks, sensors=("biotac",), repeats=1):
    return plan_cells(MatrixSpec(tasks=tasks, repeats=repeats), sensors, registry)


def test_every_sensor_meets_every_task_and_baselines_are_always_there(registry):
    cells = plan(registry, TaskChoice(name="force"), TaskChoice(name="curvature"), sensors=("biotac", "icub"))
    pairs = {(sensor, task) for sensor in ("biotac", "icub") for task in ("force", "curvature")}
    assert {(cell.sensor, cell.task) for cell in cells if not cell.baseline} == pairs
    assert {cell.estimator for cell in cells if cell.baseline} == {"mean", "time-index", "chance", "majority"}
    assert len({cell.name for cell in cells}) == len(cells)


def test_a_task_may_state_how_often_it_is_recorded_anew_and_the_matrix_overrules_it(registry):
    tasks = (TaskChoice(name="force"), TaskChoice(name="slip"))
    assert registry.tasks["slip"].spec.replicates == 1
    for asked, expected in ((None, {"force": 8, "slip": 1}), (3, {"force": 3, "slip": 3})):
        cells = plan(registry, *tasks, repeats=asked)
        seeds = {(cell.task, cell.name.rpartition("/")[2], cell.seed) for cell in cells}
        assert seeds == {(task, str(n), n) for task, repeats in expected.items() for n in range(1, repeats + 1)}


@pytest.mark.parametrize(
    ("choice", "says"),
    [
        (TaskChoice(name="force", estimators=(EstimatorChoice(name="forest", params={"trees": 5}),)), "n_estimators"),
        (TaskChoice(name="curvature", estimators=(EstimatorChoice(name="lasso"),)), "classification"),
    ],
)
def test_a_choice_that_is_not_there_is_answered_with_what_is(registry, choice, says):
    with pytest.raises((UnknownNameError, UsageError), match=says):
        plan(registry, choice)


def ways(cells):
    return [(cell.protocol, cell.split) for cell in cells if not cell.baseline]


def test_a_pair_that_does_not_go_together_is_refused_alone_and_planned_among_others(registry):
    with pytest.raises(UsageError, match="deployable"):
        plan(registry, TaskChoice(name="force", protocol="karl2016", split="unit"))
    both = plan(registry, TaskChoice(name="force", protocol=("karl2016", "deployable"), split="unit"))
    assert ways(both) == [("karl2016", "unit"), ("deployable", "unit")]
    recorded = {request_key(cell)[2] for cell in both if cell.protocol == "karl2016"}
    assert recorded == {None}, "nothing is recorded for it"
