"""Hyper-parameters are chosen without what the outer split keeps apart."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.core.evaluation.dataset import load_dataset
from tactbench.core.evaluation.splits import inner_splits, make_splits

from .made import force_task, label_task
from .test_splits import grasps, sessions


def values(data, group, masks):
    return {
        value for table, mask in zip(data.tables, masks, strict=True) for value in table.groups[group][mask].tolist()
    }


@pytest.mark.parametrize(("split", "group"), [("object", "object"), ("session", "session")])
def test_inner_folds_keep_apart_what_the_outer_split_keeps_apart(tmp_path, split, group):
    if split == "object":
        data = load_dataset(label_task(), [grasps(tmp_path, seed=1), grasps(tmp_path, seed=2)])
    else:
        data = load_dataset(force_task(), sessions(tmp_path, tuple("abcdefgh")))
    for outer in make_splits(data, split, 0):
        inner = inner_splits(data, outer)
        assert len(inner) <= 5
        tested = values(data, group, outer.test)
        for learn, check in inner:
            assert not values(data, group, learn) & values(data, group, check)
            assert not (values(data, group, learn) | values(data, group, check)) & tested
            for a, b, c in zip(learn, check, outer.train, strict=True):
                assert not (a & b).any()
                np.testing.assert_array_equal(a | b, c, "all training rows are used, and no others")
            assert any(mask.any() for mask in check)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 60))
def test_a_cut_in_time_leaves_a_gap_of_the_longest_window(tmp_path_factory, gap):
    data = load_dataset(force_task(), sessions(tmp_path_factory.mktemp("gap"), ("a", "b")))
    folds = make_splits(data, "in-session", 0, gap=gap)
    assert [fold.name for fold in folds] == ["a", "b"]
    for fold in folds:
        inner = inner_splits(data, fold, gap)
        assert len(inner) == 1
        for before, after in ((fold.train, fold.test), inner[0]):
            for a, b in zip(before, after, strict=True):
                if b.any():
                    assert np.flatnonzero(b)[0] - np.flatnonzero(a)[-1] == gap + 1
