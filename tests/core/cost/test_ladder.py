"""The ladder of real recordings: what is timed is what is scored, and its files say the same."""

import csv
import json
import time

import numpy as np
import pytest

from tactbench.core.cost.ladder import climb
from tactbench.core.cost.ladder_file import write_ladder
from tactbench.core.evaluation.delay import NO_LINK
from tactbench.core.matrix.store import Store
from tactbench.core.plugins.registry import load_registry
from tactbench.core.progress import Progress
from tactbench.core.spec.matrix import MatrixSpec
from tests.core.evaluation.made import record
from tests.here import IN_THIS_PROCESS

QUICK = ("ols", "ridge", "knn", "mean")


def presses(folder, sessions=3, n=120):
    """Recordings of a force on three taxels, one a session."""
    rng = np.random.default_rng(4)
    folder.mkdir()
    for number in range(sessions):
        force = np.linspace(0.0, 5.0, n) + rng.normal(0.0, 0.1, n)
        X = force[:, None] * np.array([40.0, -25.0, 10.0]) + rng.normal(0.0, 60.0, (n, 3)) + 100.0
        record(folder / f"press-{number}.h5", X, force, session=str(number))
    return folder


@pytest.fixture(scope="module")
def ladder(tmp_path_factory):
    root = tmp_path_factory.mktemp("ladder")
    task = {"name": "force", "protocol": "deployable", "split": "session", "estimators": QUICK}
    matrix = MatrixSpec.model_validate({"rig": "replay", "sensors": ["made"], "tasks": [task]})
    return climb(matrix, load_registry(), Store(root / "out"), rounds=2, clock=time.perf_counter, progress=Progress(),
                 recordings=presses(root / "shelf"), choice=IN_THIS_PROCESS)  # fmt: skip


def test_what_is_timed_is_what_was_scored_whatever_was_chosen_on_validation_data(ladder):
    assert {row["estimator"] for row in ladder.rows} == {*QUICK, "time-index"}
    for row in ladder.rows:
        assert row["status"] == "done", row["reason"]
        assert (row["ci_low"], row["ci_high"]) == (None, None), "three sessions carry no interval"
        assert (row["n_train"], row["n_test"]) == (240, 120)
    assert (ladder.about["fold"], ladder.about["split"]) == ("2", "session")
    by_name = {row["estimator"]: row for row in ladder.rows}
    assert max(value for key, value in by_name["ridge"]["chosen"].items() if key.startswith("k")) > 0
    assert by_name["mean"]["is_baseline"]
    assert set(by_name["mean"]["delay_parts_ms"]) == {"prediction"}
    # 100 Hz recordings of a sensor that states neither rate nor link.
    assert set(by_name["ridge"]["delay_parts_ms"]) == {"sampling", "window", "features", "prediction"}
    assert by_name["ridge"]["delay_parts_ms"]["sampling"] == pytest.approx(10.0)
    assert ladder.about["remarks"] == [NO_LINK]
    assert (by_name["knn"]["n_features"], by_name["time-index"]["n_features"]) == (3, 1)


def test_the_files_say_what_the_table_says(ladder, tmp_path):
    paths = write_ladder(ladder, tmp_path)
    assert [path.name for path in paths] == [f"made-force.{ending}" for ending in ("json", "csv", "png", "pdf")]
    assert json.loads(paths[0].read_text())["rows"] == json.loads(json.dumps(ladder.rows))
    with paths[1].open() as file:
        assert [float(row["fit_s"]) for row in csv.DictReader(file)] == [row["fit_s"] for row in ladder.rows]
