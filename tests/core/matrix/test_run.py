"""A run: what is computed when, what rows say of their times, and that scores depend on neither jobs nor engine."""

import json

import pytest

from tactbench.core.errors import UsageError
from tactbench.core.leaderboard.formats import rendered
from tactbench.core.matrix.merge import SEED_DECIDES, merge
from tactbench.core.matrix.run import EngineChoice, run_matrix
from tactbench.core.matrix.store import Store
from tactbench.core.pool import Limits
from tactbench.core.progress import Progress
from tactbench.core.spec.matrix import EstimatorChoice, MatrixSpec, TaskChoice
from tactbench.core.study.files import shown_rows, table_of
from tests.core.cost.test_knobs import presses
from tests.here import IN_THIS_PROCESS

ASKED = ("forest-10", "ridge")


def matrix(*estimators, repeats=2, **more):
    choice = TaskChoice(name="force", protocol="deployable", split="session",
                        estimators=tuple(EstimatorChoice(name=name) for name in estimators or ASKED))  # fmt: skip
    return MatrixSpec(rig="replay", sensors=("made",), tasks=(choice,), repeats=repeats, **more)


class Heard(Progress):
    """Receives what a run tells."""

    def __init__(self):
        self.stages, self.steps = [], []

    def begin(self, stage, total):
        self.stages.append((stage, total))

    def advance(self, what, *, stopped=False):
        self.steps.append(what)


def decided(rows):
    return {row["cell"]: {name: row[name] for name in SEED_DECIDES} for row in rows}


@pytest.fixture(scope="module")
def shelf(tmp_path_factory):
    return presses(tmp_path_factory.mktemp("made") / "shelf")


@pytest.fixture(scope="module")
def ran(shelf, tmp_path_factory):
    """A run with two jobs, and what it told."""
    heard = Heard()
    folder = tmp_path_factory.mktemp("ran")
    outcome = run_matrix(matrix(), Store(folder), choice=EngineChoice(jobs=2, limits=Limits(timeout_s=100.0)),
                         recordings=shelf, progress=heard)  # fmt: skip
    return outcome, heard, folder


def test_every_planned_cell_has_a_row_in_the_order_of_the_plan(ran):
    outcome, heard, folder = ran
    names = [f"made/force/replay/deployable:session/{one}/{seed}"
             for seed in (1, 2) for one in ("forest-10", "ridge", "mean", "time-index")]  # fmt: skip
    assert [row["cell"] for row in outcome.rows] == names
    assert {row["status"] for row in outcome.rows} == {"done"}
    assert (outcome.computed, outcome.recorded, outcome.failures) == (8, 0, [])
    assert sorted(heard.steps) == sorted(names)
    assert heard.stages == [("evaluating, timed", 4), ("evaluating", 4)]
    assert decided(Store(folder).rows()) == decided(outcome.rows)
    assert all(len(row["recordings"]) == 3 for row in outcome.rows)


def test_times_are_taken_in_the_first_replicate_alone(ran):
    for row in ran[0].rows:
        times = [row[name] for name in ("fit_s", "predict_s", "latency_ms_p50", "latency_n")]
        if row["seed"] == 1:
            assert all(time is not None for time in times)
            assert (row["concurrency"], row["latency_n"] >= 20) == (1, True)
        else:
            assert times == [None] * 4
            assert row["concurrency"] == 2
        assert row["wall_s"] > 0


def test_jobs_engine_and_order_change_no_score(ran, shelf, tmp_path):
    outcome = run_matrix(matrix(*ASKED[::-1]), Store(tmp_path), choice=IN_THIS_PROCESS, recordings=shelf)
    assert decided(outcome.rows) == decided(ran[0].rows)


def test_a_second_run_computes_nothing_and_a_changed_number_of_repeats_is_no_change(ran, shelf):
    folder, heard = ran[-1], Heard()
    again = run_matrix(matrix(repeats=1), Store(folder), recordings=shelf, progress=heard)
    assert (again.computed, heard.stages) == (0, [])
    assert {row["seed"] for row in again.rows} == {1}
    assert {row["seed"] for row in Store(folder).rows()} == {1, 2}


def test_runs_of_other_seeds_merged_are_one_run(ran, shelf, tmp_path):
    """Of any seeds: a seed of both, which one of them timed, is taken once."""
    for name, seed, repeats in (("a", 1, 1), ("b", 2, 2)):
        run_matrix(matrix(seed=seed, repeats=repeats), Store(tmp_path / name), choice=IN_THIS_PROCESS, recordings=shelf)
    whole = merge([tmp_path / "a", tmp_path / "b", ran[-1]], tmp_path / "whole")
    assert {name: one for name, one in decided(whole.rows).items() if not name.endswith("3")} == decided(ran[0].rows)
    timed = {row["seed"]: row["latency_n"] is not None for row in whole.rows if row["estimator"] == "ridge"}
    assert timed == {1: True, 2: True, 3: False}
    store = Store(tmp_path / "whole")
    assert json.loads(rendered(table_of(store, shown_rows(store)), "json"))[0]["seeds"] == [1, 2, 3]


def test_choices_that_do_not_go_together_are_refused(tmp_path, monkeypatch):
    with pytest.raises(UsageError, match="--jobs 2"):
        run_matrix(matrix(), Store(tmp_path / "out"), choice=EngineChoice("in-process", jobs=2))
    assert not (tmp_path / "out").exists()
    EngineChoice("in-process", jobs=1).check()
    EngineChoice("isolated", jobs=2).check()
    recorders = [EngineChoice("isolated", jobs=2).recorder(computed=computed) for computed in (True, False)]
    assert [one.jobs for one in recorders] == [2, 1], "devices are recorded one at a time"
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    EngineChoice("isolated", jobs=2).check()
    with pytest.raises(UsageError, match="distributed"):
        EngineChoice("dask").check()
