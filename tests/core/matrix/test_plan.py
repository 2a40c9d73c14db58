"""The cells of a matrix, and those that ``--probe`` adds."""

from dataclasses import replace

import pytest

from tactbench.core.errors import UnknownNameError, UsageError
from tactbench.core.matrix.keys import Keys
from tactbench.core.matrix.plan import cell_of, plan_cells
from tactbench.core.matrix.plan_recordings import Part, _unanswerable, plan_parts, plan_run, request_key
from tactbench.core.matrix.solve import opening
from tactbench.core.matrix.store import Store
from tactbench.core.plugins.registry import installed, load_registry
from tactbench.core.pool import UNLIMITED
from tactbench.core.spec.matrix import MatrixSpec
from tactbench.core.spec.rig_file import RigFile


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


def test_all_estimators_of_a_kind_and_all_few_shot_splits_are_planned_by_one_name():
    registry = installed()
    cells = plan({"name": "force", "estimators": ("all", "ols"), "split": "few-shot", "protocol": "deployable"})
    assert {cell.split for cell in cells} == {f"few-shot-{n}" for n in (1, 2, 5, 10)}
    names = list(dict.fromkeys(cell.estimator for cell in cells))
    fit = {one.name: one.baseline for one in registry.estimators if "regression" in one.kinds}
    assert set(names) == set(fit)
    assert [fit[name] for name in names] == sorted(fit.values())
    assert names[names.index("mean") :][:2] == ["mean", "time-index"], "the task's own trivial answers come first"


def planned(tmp_path, *tasks, trouble=None, **matrix):
    registry = installed()
    part = Part(MatrixSpec.model_validate({"tasks": tasks, "repeats": 1, **matrix}), None, trouble)
    return plan_run(part, registry, Keys(registry), Store(tmp_path), UNLIMITED)


def test_a_split_is_one_that_the_recordings_of_the_scenes_can_serve(tmp_path):
    def asked(split):
        choice = {"name": "force", "protocol": "deployable", "split": split}
        return planned(tmp_path, choice, rig="twin", sensors=("ideal",))

    with pytest.raises(UnknownNameError, match="bogus"):
        asked("bogus")
    for split, campaign in (("session", 3), ("shuffled", 3), ("placement", 5), ("few-shot-2", 4)):
        cells, plan = asked(split)
        assert {cell.split for cell in cells} == {split}
        (source,) = plan.values()
        assert len(source.paths) == len(source.requests) >= campaign
    with pytest.raises(UsageError, match="--sensor"):
        planned(tmp_path, "force", rig="twin")


def test_a_folder_that_could_not_be_had_costs_its_own_cells(tmp_path):
    trouble = UsageError("no network")
    _, plan = planned(tmp_path, "force", trouble=trouble, rig="replay", sensors=("ideal",))
    assert [source.trouble for source in plan.values()] == [trouble]
    assert [source.paths for source in plan.values()] == [()]
    part = Part(MatrixSpec.model_validate({"tasks": ("force",), "sensors": ("ideal",)}), None, trouble)
    with pytest.raises(UsageError, match="two folders"):
        plan_parts([part, part], installed(), Keys(installed()), Store(tmp_path), UNLIMITED)


@pytest.mark.parametrize(
    ("rig", "task", "sensor", "without_force", "says"),
    [
        ("bench", "force", "icub", False, None), ("bench", "force", "icub", True, "needs force; the rig bench"),
        ("bench", "curvature", "icub", True, None), ("bench", "slip", "biotac", False, "needs position slip"),
        ("bench", "contact-location", "icub", False, "needs position"), ("twin", "slip", "icub", True, None),
        ("parallel-manipulator", "slip", "icub", False, "needs position slip"), ("replay", "slip", "icub", True, None),
        ("bench", "force", "none", False, "needs channels of kind taxel"),
    ],
)  # fmt: skip
def test_what_a_rig_and_a_sensor_cannot_answer_is_known_before_anything_is_pressed(
    monkeypatch, rig, task, sensor, without_force, says
):
    registry = load_registry()
    bare = registry.sensors["icub"].spec.model_copy(update={"name": "none", "streams": ()})
    bare = registry.sensors["icub"].model_copy(update={"name": "none", "spec": bare})
    known = {"none": bare, "icub": registry.sensors["icub"], "biotac": registry.sensors["biotac"]}
    monkeypatch.setattr(registry, "sensors", known)
    link = {"link": "/dev/ttyUSB0"}
    file = RigFile.model_validate({"version": 1, "rig": "bench", "sensors": {"icub": link}}) if without_force else None
    found = _unanswerable((sensor, task, None, 1), registry, registry.rigs[rig], file)
    assert (found is None) if says is None else (says in str(found))
