"""The cells of a matrix, and those that ``--probe`` adds."""

from dataclasses import replace

import pytest

from tactbench.core.errors import UnknownNameError, UsageError
from tactbench.core.matrix.plan import cell_of, plan_cells
from tactbench.core.matrix.plan_recordings import request_key
from tactbench.core.matrix.solve import opening
from tactbench.core.plugins.registry import installed
from tactbench.core.spec.matrix import MatrixSpec


def plan(*tasks, sensors=("biotac",), **matrix):
    return plan_cells(MatrixSpec.model_validate({"tasks": tasks, "repeats": 1, **matrix}), sensors, installed())


def ways(cells, estimator=None):
    return [(cell.protocol, cell.split) for cell in cells if cell.estimator == (estimator or cells[0].estimator)]


def test_every_sensor_meets_every_task_and_baselines_are_always_there():
    cells = plan({"name": "force"}, {"name": "curvature"}, sensors=("biotac", "icub"))
    pairs = {(sensor, task) for sensor in ("biotac", "icub") for task in ("force", "curvature")}
    assert {(cell.sensor, cell.task) for cell in cells if not cell.baseline} == pairs
    assert {cell.estimator for cell in cells if cell.baseline} == {"mean", "time-index", "chance", "majority"}
    assert len({cell.name for cell in cells}) == len(cells)


def test_a_task_may_state_how_often_it_is_recorded_anew_and_the_matrix_overrules_it():
    assert installed().tasks["slip"].spec.replicates == 1
    for asked, expected in ((None, {"force": 8, "slip": 1}), (3, {"force": 3, "slip": 3})):
        cells = plan({"name": "force"}, {"name": "slip"}, repeats=asked)
        seeds = {(cell.task, cell.name.rpartition("/")[2], cell.seed) for cell in cells}
        assert seeds == {(task, str(n), n) for task, repeats in expected.items() for n in range(1, repeats + 1)}


@pytest.mark.parametrize(
    ("choice", "says"),
    [
        ({"name": "force", "estimators": [{"name": "forest", "params": {"trees": 5}}]}, "n_estimators"),
        ({"name": "curvature", "estimators": [{"name": "lasso"}]}, "classification"),
        ({"name": "force", "protocol": "karl2016", "split": "unit"}, "deployable"),  # it goes with roles only
    ],
)
def test_a_choice_that_is_not_there_is_answered_with_what_is(choice, says):
    with pytest.raises((UnknownNameError, UsageError), match=says):
        plan(choice)


def test_a_pair_that_does_not_go_together_is_planned_among_others():
    both = plan({"name": "force", "protocol": ("karl2016", "deployable"), "split": "unit"})
    assert ways(both) == [("karl2016", "unit"), ("deployable", "unit")]
    recorded = {request_key(cell)[2] for cell in both if cell.protocol == "karl2016"}
    assert recorded == {None}, "nothing is recorded for it"


def curvature(protocol=None, split=None, probe=True):
    choice = {name: value for name, value in (("protocol", protocol), ("split", split)) if value}
    return plan({"name": "curvature", **choice}, sensors=("icub",), probe=probe)


def test_three_more_ways_to_probe_after_those_asked_for():
    asked, probed = curvature(probe=False), curvature()
    assert probed[: len(asked)] == asked
    expected = [("karl2016", None), ("deployable", None), ("first-frame", None), ("deployable", "shuffled")]
    assert ways(probed) == ways(probed, "chance") == expected, "the trivial answers stand beside each"
    assert len({cell.name for cell in probed}) == len(probed)


@pytest.mark.parametrize(
    ("asked", "probes"),
    [
        (("deployable", "session"), [("first-frame", "session"), ("deployable", "shuffled")]),
        (("deployable", "shuffled"), [("deployable", None), ("first-frame", None)]),
        ((["deployable"], ["in-session", "shuffled"]), [("deployable", None), ("first-frame", None)]),
        ((["karl2016", "deployable"], None), [("first-frame", None), ("deployable", "shuffled")]),
    ],
)
def test_probes_keep_apart_what_the_cell_keeps_apart(asked, probes):
    assert ways(curvature(*asked)) == [*ways(curvature(*asked, probe=False)), *probes]


def test_a_split_in_time_cannot_be_probed_by_itself():
    with pytest.raises(UsageError, match="probe"):
        curvature("deployable", "in-session")


@pytest.mark.parametrize(("timed", "latency_n", "status"), [(True, 20, "done"), (False, None, "done"),
                                                            (True, None, "failed")])  # fmt: skip
@pytest.mark.parametrize("split", [None, "unit"])
def test_a_row_gives_its_cell_back(timed, latency_n, status, split):
    cell = replace(plan({"name": "force"})[0], timed=timed, split=split)
    row = opening(cell, installed().tasks["force"].spec)
    assert cell_of({**row, "split": split or "roles", "status": status, "latency_n": latency_n}) == cell
