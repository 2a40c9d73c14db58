"""``tactbench compare`` as a person uses it, on a real run."""

import csv
import io
import json

import pytest

from tactbench.core.matrix.run import run_matrix
from tactbench.core.matrix.store import Store
from tactbench.core.spec.matrix import MatrixSpec
from tests.conftest import Verbs
from tests.here import make_here

MATRIX = {
    "repeats": 5, "latency": False,
    "tasks": [{"name": "force", "protocol": "deployable", "estimators": ["ols", "lasso"]}],
}  # fmt: skip
CHEAPEST = {"biotac": "default", "icub": "closed-form"}
"""Rungs of the simulation."""


@pytest.fixture(scope="module")
def verbs(tmp_path_factory):
    verbs = Verbs(tmp_path_factory.mktemp("compared"))
    for sensor, rung in CHEAPEST.items():
        matrix = MatrixSpec.model_validate({**MATRIX, "sensors": [sensor], "simulation": {"rung": rung}})
        with pytest.MonkeyPatch.context() as patch:
            make_here(patch)
            run_matrix(matrix, Store(verbs.folder / "here"))
    return verbs


def test_two_sensors_in_every_format(verbs):
    asked = ("compare", "biotac", "icub", "--out", "here")
    shown = verbs(*asked)
    assert "A = biotac, B = icub · force · RMSE [N] · deployable" in shown.stdout
    assert "paired over 5 replicates" in " ".join(shown.stdout.split())
    records = json.loads(verbs(*asked, "--format", "json").stdout)
    assert {record["of"] for record in records} == {"ols", "lasso"}
    assert all(record["declared"] and record["p_holm"] >= record["p"] for record in records), "by the default matrix"
    assert all(record["low"] <= record["difference"] <= record["high"] for record in records)
    lines = list(csv.DictReader(io.StringIO(verbs(*asked, "--format", "csv").stdout)))
    assert [float(line["difference"]) for line in lines] == [record["difference"] for record in records]
    first = f"{abs(records[0]['difference']):.4f}"
    for shape in ("table", "md", "latex"):
        assert first in verbs(*asked, "--format", shape).stdout
    assert r"\toprule" in verbs(*asked, "--format", "latex").stdout


def test_a_folder_against_itself_differs_nowhere_and_what_is_not_there_is_named(verbs):
    other = json.loads(verbs("compare", "ols", "lasso", "--out", "here", "--format", "json").stdout)
    assert not any(record["declared"] or record["p_holm"] for record in other)
    records = json.loads(verbs("compare", "here", "here", "--format", "json").stdout)
    assert len(records) == 4
    assert {(record["difference"], record["p"], record["paired"]) for record in records} == {(0.0, 1.0, True)}
    assert "biotac" in verbs("compare", "biotack", "icub", "--out", "here", code=2).stderr
    assert "force" in verbs("compare", "biotac", "icub", "--out", "here", "--task", "forse", code=2).stderr
