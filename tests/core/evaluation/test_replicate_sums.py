"""What an interval resamples, and what a row keeps of it."""

import json

import numpy as np
import pytest

from tactbench.core.evaluation.interval import tables_of
from tactbench.core.evaluation.metrics import METRICS

from .made import evaluated, force_task, grasps, label_task, ramp, record


def again(result):
    """Return the score that the kept sums give, after a round trip through text."""
    kept = json.loads(json.dumps(dict(result.replicates)))
    n_classes = len(result.classes)
    return float(METRICS[result.metric].score(tables_of([kept], result.metric, n_classes)[0].sum(axis=0), n_classes))


@pytest.mark.parametrize("metric", ["accuracy", "balanced_accuracy", "macro_f1"])
def test_the_score_of_a_class_follows_from_the_sums_exactly(tmp_path, metric):
    """Counts are whole numbers: nothing is rounded."""
    paths = [grasps(tmp_path, seed=1), grasps(tmp_path, seed=2)]
    result = evaluated(label_task(metric=metric), paths, "logistic", split="object")
    assert again(result) == result.score
    assert result.replicates["unit"] == "object"
    assert result.replicates["names"] == sorted(f"thing {place}" for place in range(12))
    assert all(isinstance(value, int) for line in result.replicates["sums"] for value in line)


def test_classes_that_live_in_recordings_of_their_own_are_strata(tmp_path):
    X, _ = ramp(0, n=60)
    paths = [
        record(tmp_path / f"{role}{cap}{number}.h5", X + cap, role=role, session=f"{role}{cap}{number}",
               labels={"kind": cap})
        for role in ("train", "test") for cap in range(2) for number in range(5)
    ]  # fmt: skip
    kept = evaluated(label_task(), paths, "chance", split="roles").replicates
    assert kept["names"] == [f"test{cap}{number}" for cap in range(2) for number in range(5)]
    assert kept["strata"] == [0] * 5 + [1] * 5


def test_a_unit_is_found_for_each_row_by_its_number(tmp_path):
    """Rows that were left out must not shift the groups of those that follow."""
    X, force = ramp(0, n=60)
    X[5:15, 0] = np.nan
    path = record(tmp_path / "a.h5", X, force, annotations={"press": np.repeat(np.arange(6), 10)})
    kept = evaluated(force_task(splits=("press",)), [path], split="press").replicates
    assert (kept["unit"], kept["names"]) == ("press", [f"1/{number}" for number in range(6)])
    assert [rows for _, rows in kept["sums"]] == [5, 5, 10, 10, 10, 10]
