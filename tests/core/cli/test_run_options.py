"""What ``run`` is asked for: nuisances, protocols and splits, matrices by name, probes, and tasks of other kinds."""

import json

import pytest

from tactbench.core.matrix.plan import plan_cells
from tactbench.core.plugins.declared import with_declared
from tactbench.core.recording.datasets import datasets
from tactbench.core.study.files import matrix_called, packaged_matrices
from tactbench.plugin import load_registry
from tests.conftest import Verbs
from tests.core.cli.terminals import computed
from tests.core.evaluation.made_slip import campaign
from tests.core.report.unrendered import unrendered

CHEAPEST = ("--set", "rung=closed-form")
BY_UNIT = ("--protocol", "deployable", "--split", "unit")
RUN = ("run", "--sensor", "icub", "--task", "force", "--estimator", "ols", "--repeats", "1", *CHEAPEST)
FIGURES = ("false alarms per minute", "onset latency p50 ms", "compute s per s of signal")
SET = ("--set", "placement_scatter_mm=0.3", "--set", "taxel_white_count=2")


@pytest.fixture
def verbs(tmp_path):
    return Verbs(tmp_path, here=True)


def row_of(done, estimator):
    (row,) = [row for row in json.loads(done.stdout) if row["estimator"] == estimator and not row["params"]]
    return row


def test_what_is_set_is_in_row_recording_score_and_why_and_is_found_again(verbs):
    usual, row = (row_of(verbs(*RUN, *more, "--format", "json"), "ols") for more in ((), SET))
    assert row["assumptions"] == {**usual["assumptions"], "placement_scatter_mm": 0.3, "taxel_white_count": 2.0}
    assert usual["recordings"] != row["recordings"]
    assert usual["score"] != row["score"]
    assert computed(verbs(*RUN, *SET))[2:] == [0, 0]
    (damaged,) = verbs.folder.rglob(row["recordings"][0])
    damaged.write_bytes(damaged.read_bytes()[:-100])
    assert computed(verbs(*RUN, *SET))[2:] == [0, 1]
    facts = json.loads(verbs("why", "ols/1", "--format", "json").stdout)
    assert facts["simulation"]["nuisances"] == {"placement_scatter_mm": 0.3, "taxel_white_count": 2.0}
    (verbs.folder / "set.yaml").write_text(
        "{sensors: [icub], tasks: [{name: force, estimators: [ols]}], latency: false, repeats: 1, simulation: "
        "{rung: closed-form, nuisances: {placement_scatter_mm: 0.2, taxel_white_count: 2}}}"
    )
    done = verbs("run", "--config", "set.yaml", *SET[:2], "--format", "json")
    assert computed(done)[3] == 0  # the option goes over the file, whose other values stay
    assert row_of(done, "ols")["score"] == row["score"]


@pytest.mark.parametrize("name", sorted(packaged_matrices()))
def test_every_packaged_matrix_can_be_planned(name):
    matrix = matrix_called(name)
    declared = (task for one in datasets().values() for task in one.mapping.tasks)
    cells = plan_cells(matrix, matrix.sensors or ["any"], with_declared(load_registry(), declared))
    assert {cell.task for cell in cells if not cell.baseline} == {choice.name for choice in matrix.tasks}


def test_a_split_by_units_records_every_unit_and_is_the_same_on_the_recordings(verbs):
    row = row_of(verbs(*RUN, *BY_UNIT, "--format", "json"), "ols")
    assert (row["protocol"], row["split"], row["n_replicates"]) == ("deployable", "unit", 5)
    replay = ("run", "--recordings", "tactbench-results/recordings", "--task", "force", "--estimator", "ols")
    again = verbs(*replay, *BY_UNIT, "--format", "json", "--out", "again")
    assert row_of(again, "ols")["score"] == row["score"]


def test_events_in_time_go_from_the_row_to_tables_why_and_cost(verbs):
    (verbs.folder / "made").mkdir()
    campaign(verbs.folder / "made")
    asked = ("--recordings", "made", "--task", "slip", "--estimator", "pac-band", "--estimator", "frame-difference")
    rows = json.loads(verbs("run", *asked, "--format", "json").stdout)
    by = {(row["task"], row["estimator"]): row for row in rows}
    row = by["slip", "pac-band"]
    assert (row["metric"], row["score"], row["answer_per"]) == ("recall_area", 1.0, "frame")
    # A window of 100 ms that fills with vibration, 20 ms more as the policy asks, a frame of 10 ms; then it computes.
    alarms, latency_ms, computing = (row["events"][key] for key in FIGURES)
    assert (alarms, latency_ms < 130 + 10 * computing) == (0, True)
    assert by["slip", "slip-never"]["baseline"] == 0.0  # the oracle is no bar
    assert "Events" in verbs("leaderboard", "--wide").stdout
    assert f"{FIGURES[0]}: 0;" in verbs("why", "made/slip/replay/deployable/pac-band").stdout
    with unrendered():
        assert "pac-band" in verbs("cost", "--sensor", "made", *asked).stdout
    costs = json.loads((verbs.folder / "tactbench-results" / "cost" / "made-slip.json").read_text())["settings"]
    (parts,) = [one["delay_parts_ms"] for one in costs if (one["knob"], one["value"]) == ("estimator", "pac-band")]
    assert (parts["window"], parts["sampling"]) == pytest.approx((50.0, 10.0))
