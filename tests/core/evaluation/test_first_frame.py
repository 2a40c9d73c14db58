"""What the first row of a recording tells, asked of recordings that give their answer away and of some that do not."""

import numpy as np
import pytest

from tactbench.core.errors import NotApplicable
from tactbench.core.plugins.registry import load_registry
from tests.core.evaluation.made import evaluated, force_task, label_task, record, sessions

REGISTRY = load_registry()
TASK = label_task("object", splits=("recording", "shuffled"))


def grasps(folder, offset):
    """Three objects, twelve recordings of each: contact from row 5 on, and offsets before it that name the object."""
    rng = np.random.default_rng(3)
    paths = []
    for number in range(36):
        X = rng.normal(0.0, 0.1, (20, 3)) + offset * np.eye(3)[number % 3]
        X[5:] += 5.0 * np.eye(3)[number % 3]
        paths.append(record(folder / f"g{number:02d}.h5", X, labels={"object": f"o{number % 3}"}, trial=str(number)))
    return paths


def run(paths, protocol="first-frame", split=None, task=TASK):
    return evaluated(task, paths, "logistic", protocol, split)


def test_offsets_before_contact_name_the_object_and_contact_alone_does_not(tmp_path_factory):
    told = run(grasps(tmp_path_factory.mktemp("told"), 3.0))
    silent = grasps(tmp_path_factory.mktemp("silent"), 0.0)
    assert told.score > 0.95
    assert sorted(told.sets["test"].recording.tolist()) == list(range(36)), "one row a recording is tested"
    assert set(told.sets["test"].row.tolist()) == {0}
    assert told.split == "recording"
    # 36 first rows of noise, three classes: the standard error of guessing is 0.08; three of them.
    assert run(silent).score < 1 / 3 + 0.24
    assert run(silent, "deployable").score > 0.7, "contact, from row 5 of 20 on, does tell"


def test_an_answer_that_changes_within_a_recording_is_skipped_with_the_reason(tmp_path):
    with pytest.raises(NotApplicable, match="'a'"):
        run(sessions(tmp_path), task=force_task())


@pytest.mark.parametrize(
    ("n", "labels", "right"), [(1, "b", False), (2, "bb", True), (2, ["", "b"], False), (2, ["b", "c"], False)]
)
def test_first_rows_are_asked_where_more_rows_follow_and_all_have_one_answer(tmp_path, n, labels, right):
    for place in range(4):
        object_ = [one and f"{one}{place % 2}" for one in labels]
        record(tmp_path / f"{place}.h5", np.ones((n, 2)) * place, annotations={"object": object_}, trial=str(place))
    paths = sorted(tmp_path.glob("*.h5"))
    if right:
        assert run(paths, split="recording").n_test == 4
        return
    with pytest.raises(NotApplicable):
        run(paths, split="recording")
