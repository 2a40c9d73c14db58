"""Several protocols and splits at once, and matrices by name, as a person asks for them."""

import json
from pathlib import Path

import pytest

from tactbench.core.cli.config import matrix_called, packaged_matrices
from tactbench.core.errors import ConfigError, UnknownNameError
from tactbench.core.matrix.plan import plan_cells
from tactbench.plugin import load_registry
from tests.conftest import Verbs

ROOT = Path(__file__).parents[3]


@pytest.mark.parametrize("name", sorted(packaged_matrices()))
def test_every_packaged_matrix_can_be_planned(name):
    matrix = matrix_called(name)
    cells = plan_cells(matrix, matrix.sensors or ["any"], load_registry())
    assert {cell.task for cell in cells if not cell.baseline} == {choice.name for choice in matrix.tasks}


def test_the_packaged_matrices_are_those_of_the_examples_and_travel_in_the_wheel():
    assert {"beyond", "protocols"} <= set(packaged_matrices())
    assert '"examples/matrices" = "tactbench/matrices"' in (ROOT / "pyproject.toml").read_text()


def test_a_file_is_taken_before_a_name_and_a_missing_one_is_named(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "beyond").write_text("version: 1\nsensors: [icub]\ntasks: [force]\n")
    assert matrix_called("beyond").sensors == ("icub",)
    with pytest.raises(UnknownNameError, match=r"beyond.*protocols"):
        matrix_called("beyound")
    with pytest.raises(ConfigError, match=r"nowhere\.yaml"):
        matrix_called("nowhere.yaml")


def test_protocols_and_splits_side_by_side(tmp_path):
    verbs = Verbs(tmp_path, here=True)
    asked = ("run", "--repeats", "1", "--sensor", "icub", "--task", "force", "--estimator", "ols", "--out", "out")
    asked += ("--protocol", "karl2016", "--protocol", "deployable", "--split", "roles", "--split", "unit")
    verbs(*asked, "--set", "rung=closed-form")  # the cheapest
    rows = json.loads((verbs.folder / "out" / "leaderboard.json").read_text())
    by_way = {(row["protocol"], row["split"]): row for row in rows if row["estimator"] == "ols"}
    assert {way: row["status"] for way, row in by_way.items()} == {
        ("karl2016", "roles"): "done", ("karl2016", "unit"): "skipped",
        ("deployable", "roles"): "done", ("deployable", "unit"): "done",
    }  # fmt: skip
    assert "by roles only" in by_way["karl2016", "unit"]["reason"]
    unit = by_way["deployable", "unit"]
    assert sum(key.startswith("fold unit") for key in unit["scores"]) == 5
    assert "5 units" in unit["ci_method"]
    assert any("assumed" in remark for remark in unit["remarks"])
    # The paper's scenes are sampled alike for both sensors; the campaigns beyond it more slowly.
    rate = "taxels sampled at {} Hz; its own rate is 50 Hz"
    assert by_way["deployable", "roles"]["remarks"][0] == rate.format("83.33")
    assert rate.format("16.67") in unit["remarks"]
    assert len(list((verbs.folder / "out" / "recordings" / "icub").glob("*.h5"))) == 3 + 5

    records = json.loads(verbs("compare", "unit", "roles", "--out", "out", "--format", "json").stdout)
    (found,) = [record for record in records if record["difference"] is not None]
    assert found["difference"] == unit["score"] - by_way["deployable", "roles"]["score"]

    replayed = verbs("run", "--rig", "replay", "--recordings", "out/recordings", "--task", "force", "--split", "unit",
                     "--estimator", "ols", "--format", "json", "--out", "again")  # fmt: skip
    again = [row for row in json.loads(replayed.stdout) if row["estimator"] == "ols"]
    assert [row["score"] for row in again] == [unit["score"]]


def test_a_protocol_that_cannot_keep_a_split_is_refused_before_anything_is_recorded(verbs):
    done = verbs("run", "--sensor", "icub", "--task", "force", "--protocol", "karl2016", "--split", "unit", code=2)
    assert "by roles only" in done.stderr
    assert not list(verbs.folder.rglob("*.h5"))


def test_an_unknown_matrix_lists_what_there_is(verbs):
    done = verbs("run", "--config", "beyong", code=2)
    assert "beyond" in done.stderr
    assert "protocols" in done.stderr
