"""An interval resamples what was repeated, the coarsest of which there is enough."""

import numpy as np

from tactbench.core.evaluation.dataset import load_dataset
from tactbench.core.evaluation.replicate_sums import replicates

from .made import force_task, label_task, record
from .test_karl2016 import ramp
from .test_splits import grasps, run, sessions


def test_objects_of_the_official_test_stand_in_for_each_other(tmp_path):
    """One test file is one session; the task names objects, and there are twelve."""
    paths = [grasps(tmp_path, "train", seed=1), grasps(tmp_path, "test", seed=2)]
    assert run(paths, "roles", label_task()).interval.method.startswith("jackknife over 12 objects ")


def test_trials_of_one_session_stand_in_for_each_other(tmp_path):
    paths = [
        record(tmp_path / f"{place}.h5", *ramp(place, n=40), session="one", role="train" if place < 2 else "test")
        for place in range(9)
    ]
    task = force_task(protocols=("deployable",))
    method = run(paths, "roles", task, "mean", params={}).interval.method
    assert method.startswith("jackknife over 7 recordings ")
    assert method.endswith("): spread between sessions is not in it")


def test_a_group_that_some_classes_do_not_have_is_said_not_to_be_in_the_interval(tmp_path):
    """Recordings stand in for objects where the recordings of one class have none."""
    rng = np.random.default_rng(4)
    paths = [
        record(
            tmp_path / f"{number}.h5", rng.normal(size=(20, 2)), role="train" if number < 4 else "test", session="one",
            labels={"kind": number % 2, **({"object": number // 4} if number % 2 else {})},
        )
        for number in range(16)
    ]  # fmt: skip
    method = run(paths, "roles", label_task()).interval.method
    assert method.startswith("jackknife over 12 recordings ")
    assert method.endswith(": spread between sessions and objects is not in it; some test rows have no object")


def test_sessions_come_before_recordings(tmp_path):
    paths = sessions(tmp_path, tuple("abcdef"), n=40)
    method = run(paths, "session", estimator="mean", params={}).interval.method
    assert method.startswith("jackknife over 6 sessions ")
    assert "not in it" not in method


def test_five_caps_of_one_session_each_recorded_once_are_not_replicates(tmp_path):
    """Resampling the caps would lose classes: time is resampled instead, and the row says so."""
    X, _ = ramp(0, n=60)
    paths = [
        record(tmp_path / f"{role}{cap}.h5", X + cap, role=role, session=role, labels={"kind": cap})
        for role in ("train", "validation", "test") for cap in range(5)
    ]  # fmt: skip
    result = run(paths, "roles", label_task(), "chance", params={})
    assert "within 5 recordings" in result.interval.method


def test_a_unit_is_found_for_each_row_by_its_number(tmp_path):
    """Rows that were left out must not shift the groups of those that follow."""
    X, force = ramp(0, n=60)
    X[5:15, 0] = np.nan
    notes = {"press": np.repeat(np.arange(6), 10)}
    data = load_dataset(force_task(), [record(tmp_path / "a.h5", X, force, annotations=notes)])
    table = data.tables[0]
    unit = replicates(data, force_task(splits=("press",)), "press", table.y, np.zeros(50, dtype=np.int64), table.row)
    assert unit.name == "press"
    assert unit.codes.tolist() == (table.row // 10).tolist()
    assert unit.labels == tuple(f"1/{number}" for number in range(6))
