"""Whatever a campaign records, no group that its split keeps apart is on both sides."""

import numpy as np
import pytest

from tactbench.core.errors import UsageError
from tactbench.core.evaluation.dataset import load_dataset
from tactbench.core.evaluation.protocols import DEPLOYABLE
from tactbench.core.evaluation.splits import choose_split, inner_splits, make_splits, shots, training_sessions
from tactbench.plugin import load_registry

from .made import force_task, record, sessions

TASKS = {task.spec.name: task.spec for task in load_registry().tasks}
CAMPAIGNS = {split: name for name, task in TASKS.items() for split in task.campaigns if shots(split) not in (2, 5)}
"""By split, a task with a campaign for it: those of other tasks are of the same recordings, or of some of them."""
ROWS = 10


def recorded(folder, name, split):
    """Return what a rig would record of a campaign, in few rows: labels, sessions and roles are what counts."""
    rng = np.random.default_rng(0)
    paths = [
        record(folder / f"{item.scene.name}.h5", rng.normal(size=(ROWS, 2)), np.linspace(0, 5, ROWS), role=item.role,
               scene=item.scene, session=item.scene.session, labels=item.scene.labels)
        for item in TASKS[name].campaigns[split]
    ]  # fmt: skip
    return load_dataset(TASKS[name], paths)


def values(data, group, rows=None):
    return set(data.column(lambda table: table.groups[group], rows).tolist())


@pytest.mark.parametrize(("split", "name"), CAMPAIGNS.items())
def test_no_group_of_the_test_rows_is_in_training_nor_where_parameters_are_chosen(tmp_path, split, name):
    data = recorded(tmp_path, name, split)
    assert choose_split(TASKS[name], DEPLOYABLE, data, split) == split
    group = "session" if shots(split) else split
    folds = make_splits(data, split, 0, one_by_one=True)
    tested = []
    for fold in folds:
        test = values(data, group, fold.test)
        assert test
        assert not test & values(data, group, fold.train)
        tested += sorted(test)
        inner = inner_splits(data, fold)
        assert 1 <= len(inner) <= 5
        for learn, check in inner:
            learned, checked = values(data, group, learn), values(data, group, check)
            assert checked
            assert not test & (learned | checked)
            assert len(inner) == 1 or not learned & checked
            assert not (learn & check).any()
            np.testing.assert_array_equal(learn | check, fold.train, "all training rows are used, and no others")
    assert len(tested) == len(set(tested)), "every group is tested once"
    if not shots(split):
        assert len(folds) == len(tested), "each group is left out alone"
        assert set(tested) == values(data, group)


def test_sessions_are_taken_in_order_of_their_numbers(tmp_path):
    paths = sessions(tmp_path, ("day-10", "day-9", "day-2", "both"), ROWS, role="train")
    data = load_dataset(force_task(), paths + sessions(tmp_path / "test", ("both", "last"), ROWS, role="test"))
    assert training_sessions(data) == ["day-2", "day-9", "day-10"], "a session with a test recording never trains"
    assert choose_split(force_task(), DEPLOYABLE, data, "few-shot-3") == "few-shot-3"
    for some, split in ((data, "few-shot-4"), (load_dataset(force_task(), paths), "few-shot-1")):
        with pytest.raises(UsageError):
            choose_split(force_task(), DEPLOYABLE, some, split)
