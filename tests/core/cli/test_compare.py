"""``tactbench compare`` of a result folder."""

import csv
import io
import json

import numpy as np
import pytest

from tactbench.core.matrix.store import Store
from tests.conftest import Verbs
from tests.core.matrix import made


@pytest.fixture(scope="module")
def verbs(tmp_path_factory):
    """The verbs beside the results of two sensors, one worse than the other, and two estimators in five campaigns."""
    verbs, rng = Verbs(tmp_path_factory.mktemp("compared")), np.random.default_rng(0)
    with Store(verbs.folder / "here").hold() as store:
        for sensor, score in (("biotac", 0.7), ("icub", 0.5)):
            for estimator in ("ols", "lasso"):
                for seed, one in enumerate((score + 0.02 * rng.standard_normal(5)).tolist(), 1):
                    named = {"sensor": sensor, "estimator": estimator, "protocol": "deployable", "seed": seed}
                    cell = f"{sensor}/force/twin/deployable/{estimator}/{seed}"
                    made.kept(store, cell, score=one, repeat=seed, repeats=5, **named)
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


def test_a_folder_against_itself_differs_nowhere_and_what_is_not_there_is_named(verbs):
    other = json.loads(verbs("compare", "ols", "lasso", "--out", "here", "--format", "json").stdout)
    assert not any(record["declared"] or record["p_holm"] for record in other)
    records = json.loads(verbs("compare", "here", "here", "--format", "json").stdout)
    assert len(records) == 4
    assert {(record["difference"], record["p"], record["paired"]) for record in records} == {(0.0, 1.0, True)}
    for words, nearest in (("biotack", "icub"), "biotac"), (("biotac", "icub", "--task", "forse"), "force"):
        assert nearest in verbs("compare", *words, "--out", "here", code=2).stderr
