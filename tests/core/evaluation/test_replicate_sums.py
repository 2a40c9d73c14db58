"""A row's replicates say its score again, and little else."""

import json

import numpy as np
import pytest

from tactbench.core.evaluation.metrics import METRICS
from tactbench.core.evaluation.replicate_sums import BLOCKS, tables_of

from .made import force_task, label_task, record
from .test_karl2016 import ramp
from .test_splits import grasps, run, sessions


def again(result):
    """Return the score that the kept sums give, after a round trip through text."""
    kept = json.loads(json.dumps(dict(result.replicates)))
    n_classes = len(result.classes)
    return float(METRICS[result.metric].score(tables_of([kept], result.metric, n_classes)[0].sum(axis=0), n_classes))


@pytest.mark.parametrize("metric", ["rmse", "mae", "r2"])
@pytest.mark.parametrize("names", [("a", "b", "c"), tuple("fedcba")])
def test_the_score_of_a_number_follows_from_the_sums(tmp_path, metric, names):
    result = run(sessions(tmp_path, names, n=90), "session", force_task(metric=metric))
    assert again(result) == pytest.approx(result.score, rel=1e-12)


@pytest.mark.parametrize("metric", ["accuracy", "balanced_accuracy", "macro_f1"])
def test_the_score_of_a_class_follows_from_the_sums_exactly(tmp_path, metric):
    """Counts are whole numbers: nothing is rounded."""
    result = run([grasps(tmp_path, seed=1), grasps(tmp_path, seed=2)], "object", label_task(metric=metric))
    assert again(result) == result.score
    assert result.replicates["unit"] == "object"
    assert result.replicates["names"] == sorted(f"thing {place}" for place in range(12))
    assert all(isinstance(value, int) for line in result.replicates["sums"] for value in line)


def test_replicates_are_named_in_order_of_their_names(tmp_path):
    kept = run(sessions(tmp_path, tuple("fbdace"), n=60), "session", estimator="mean", params={}).replicates
    assert (kept["unit"], kept["names"], kept["strata"], kept["run"]) == ("session", list("abcdef"), None, 1)
    assert [line[1] for line in kept["sums"]] == [60] * 6


def test_few_sessions_are_cut_into_blocks_of_time(tmp_path):
    kept = run(sessions(tmp_path, n=200), "session", estimator="mean", params={}).replicates
    assert kept["unit"] == "block of 5 rows in time"
    assert kept["names"] == [f"{name}/{number}" for name in "abc" for number in range(1, BLOCKS + 1)]
    assert kept["strata"] == [place for place in range(3) for _ in range(BLOCKS)]
    assert all(line[1] == 5 for line in kept["sums"])


def test_a_sensor_of_twice_the_rate_has_the_same_blocks(tmp_path):
    """So that two sensors pressed with the same scenes can be paired."""
    slow, quick = (
        run(
            [record(tmp_path / f"{n}" / f"{name}.h5", *ramp(0, n=n), session=name) for name in "ab"],
            "session", estimator="mean", params={},
        ).replicates
        for n in (100, 200) if (tmp_path / f"{n}").mkdir() is None
    )  # fmt: skip
    assert slow["names"] == quick["names"]


def test_an_error_that_stays_hangs_blocks_together(tmp_path):
    """The mean is wrong for a long while, then right for a long while."""
    kept = run(sessions(tmp_path, n=400), "session", estimator="mean", params={}).replicates
    assert kept["run"] > 1


def test_classes_that_live_in_recordings_of_their_own_are_strata(tmp_path):
    X, _ = ramp(0, n=60)
    paths = [
        record(tmp_path / f"{role}{cap}{number}.h5", X + cap, role=role, session=f"{role}{cap}{number}",
               labels={"kind": cap})
        for role in ("train", "test") for cap in range(2) for number in range(5)
    ]  # fmt: skip
    kept = run(paths, "roles", label_task(), "chance", params={}).replicates
    assert kept["names"] == [f"test{cap}{number}" for cap in range(2) for number in range(5)]
    assert kept["strata"] == [0] * 5 + [1] * 5


def test_recordings_of_one_name_are_told_apart(tmp_path):
    paths = []
    for session in "ab":
        (tmp_path / session).mkdir()
        paths.append(record(tmp_path / session / "press.h5", *ramp(0, n=100), session=session))
    names = run(paths, "session", estimator="mean", params={}).replicates["names"]
    assert names[0] == "a/press/1"
    assert len(set(names)) == len(names)


def test_sums_are_compact(tmp_path):
    """Thousands of rows are read at once: numbers that are counts carry no point, empty columns are not there."""
    kept = run([grasps(tmp_path, seed=1), grasps(tmp_path, seed=2)], "object", label_task()).replicates
    assert len(json.dumps(kept)) < 1000
    assert np.all([len(line) <= 8 for line in kept["sums"]])
