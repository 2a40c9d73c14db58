"""Splits keep apart what they say, windows never cross, and a leak is stamped."""

from collections import Counter
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.core.errors import DataError, NotApplicable, UsageError
from tactbench.core.evaluation.dataset import load_dataset
from tactbench.core.evaluation.folds import load_task
from tactbench.core.evaluation.protocols import DEPLOYABLE
from tactbench.core.evaluation.sets import FeatureScale, apart, causal_mean, keep, part
from tactbench.core.evaluation.splits import Assignment, OwnSplit, choose_split, inner_splits, make_splits
from tactbench.plugin import Summary

from .made import evaluated, force_task, grasps, label_task, ramp, record, sessions


def run(paths, split=None):
    return evaluated(force_task(), paths, split=split)


@pytest.mark.parametrize("split", ["session", "in-session", "shuffled"])
def test_training_and_test_rows_are_disjoint_and_every_free_row_is_tested_once(tmp_path, split):
    data = load_dataset(force_task(), sessions(tmp_path))
    folds = make_splits(data, split, 0)
    train, test = (np.array([getattr(fold, name) for fold in folds]) for name in ("train", "test"))
    assert not (train & test).any()
    assert set(test.sum(axis=0)) == ({0, 1} if split == "in-session" else {1})


@pytest.mark.parametrize(("split", "groups"), [("session", "abc"), ("shuffled", "abc"), ("press", "12")])
def test_the_groups_of_rows_are_those_that_the_split_keeps_apart(tmp_path, split, groups):
    paths = sessions(tmp_path, n=20, annotations={"press": np.repeat(["1", "2"], 10)})
    made = load_task(force_task(splits=("press",)), paths, "deployable", split)
    assert set(made.groups) == set(groups)
    assert len(made.groups) == len(made.X) == 60


def test_folds_of_the_caller_are_indices_or_masks_and_name_a_leak(tmp_path):
    paths, mask = sessions(tmp_path, n=20), np.arange(60) < 20
    own = load_task(force_task(), paths, "deployable", OwnSplit([(~mask, np.arange(20)), ([50], [0, 1])], "session"))
    assert [(len(train), len(test)) for train, test in own.folds] == [(40, 20), (1, 2)]
    assert (own.unit, own.stamps, own.assignments[0].groups) == ("session", (), "session")
    mixed = load_task(force_task(), paths, "deployable", OwnSplit([(mask, ~mask), ([0, 30], [31])], None))
    assert (mixed.unit, len(mixed.stamps), mixed.assignments[1].groups) == (None, 1, "session")
    assert mixed.stamps[0].startswith("leaks: ")
    assert "recording b on both sides of fold 2" in mixed.stamps[0]
    for pairs in ([], [([0, 0], [1])], [([60], [1])], [(mask[1:], mask)]):
        with pytest.raises(UsageError):
            load_task(force_task(), paths, "deployable", OwnSplit(pairs, None))
    for groups in ("object", np.arange(59), np.full(60, np.nan)):
        with pytest.raises(UsageError, match="groups"):
            load_task(force_task(), paths, "deployable", OwnSplit([(mask, ~mask)], groups))


def test_two_groups_that_train_are_kept_apart_where_parameters_are_chosen_too(tmp_path):
    data = load_dataset(force_task(), sessions(tmp_path, n=20))
    inner = inner_splits(data, make_splits(data, "session", 0)[0])
    assert [[np.unique(data.recording[rows]).tolist() for rows in pair] for pair in inner] == [[[2], [1]], [[1], [2]]]


def filtered(data, fold, k):
    """The training rows of a fold behind the window, not scaled."""
    return part(keep(data, DEPLOYABLE, fold.train, "t", Counter()), FeatureScale(np.zeros(3), np.ones(3)), k)


@settings(max_examples=8, deadline=None)
@given(st.integers(0, 60), st.sampled_from(["in-session", "session"]))
def test_a_window_never_reaches_across_a_split(tmp_path_factory, k, split):
    """Changing every test row must leave every training row as it was."""
    data = load_dataset(force_task(), sessions(tmp_path_factory.mktemp("windows"), ("a", "b"), n=120))
    for fold in make_splits(data, split, 0):
        before = filtered(data, fold, k)
        for table, test in zip(data.tables, data.parted(fold.test), strict=True):
            table.X[test] += 1e6
        assert np.array_equal(before.X, filtered(data, fold, k).X)


@settings(max_examples=8, deadline=None)
@given(st.integers(0, 60))
def test_a_cut_in_time_leaves_a_gap_of_the_longest_window(tmp_path_factory, gap):
    data = load_dataset(force_task(), sessions(tmp_path_factory.mktemp("gap"), ("a", "b")))
    folds = make_splits(data, "in-session", 0, gap=gap)
    assert [fold.name for fold in folds] == ["a", "b"]
    for fold in folds:
        (inner,) = inner_splits(data, fold, gap)
        for before, after in ((fold.train, fold.test), inner):
            for a, b in zip(data.parted(before), data.parted(after), strict=True):
                if b.any():
                    assert np.flatnonzero(b)[0] - np.flatnonzero(a)[-1] == gap + 1  # the past trains
        assert fold.test.sum() == 0.2 * 200


@given(
    st.integers(0, 50), st.lists(st.integers(1, 30), min_size=1, max_size=5), st.sampled_from([0.0, 1e8]),
    st.integers(0, 2**32 - 1),
)  # fmt: skip
def test_the_causal_mean_is_that_of_a_naive_loop(k, lengths, offset, seed):
    segment = np.repeat(np.arange(len(lengths)), lengths)
    X = offset + np.random.default_rng(seed).normal(size=(len(segment), 2))
    naive = np.array([X[max(t - k, int(np.flatnonzero(segment == segment[t])[0])) : t + 1].mean(axis=0)
                      for t in range(len(X))])  # fmt: skip
    # At an offset of 1e8 a double has 1.5e-8 between neighbours; sums of centred values add a few of these.
    np.testing.assert_allclose(causal_mean(X, k, segment), naive, atol=1e-12 if offset == 0 else 1e-7)


@given(st.integers(1, 7), st.integers(1, 4), st.lists(st.booleans(), min_size=1, max_size=30))
def test_no_training_window_has_a_row_of_a_test_window_and_all_others_stay(window, step, tested):
    test = np.array(tested)
    data = SimpleNamespace(parted=lambda rows: [rows])
    found = apart(Assignment("x", ~test, test), data, window, step).train
    near = [any(abs(place - other) * step < window for other in np.flatnonzero(test)) for place in range(len(test))]
    assert found.tolist() == (~test & ~np.array(near)).tolist()


def test_a_shuffled_split_is_stamped_and_taken_unasked_only_where_nothing_else_fits(tmp_path):
    paths = sessions(tmp_path)
    shuffled_first = force_task(splits=("shuffled", "session"))
    by_session = evaluated(shuffled_first, paths)
    assert (by_session.split, set(by_session.sets)) == ("session", {"test"})
    assert evaluated(shuffled_first, paths[:1]).split == "shuffled"
    shuffled = run(paths, "shuffled")
    assert shuffled.stamps
    assert "leaks" in shuffled.stamps[0]
    assert not run(paths, "in-session").stamps
    whole = label_task("session", splits=("shuffled",), answer_per="recording", summaries=(Summary(measure="mean"),))
    one = [record(tmp_path / "one.h5", *ramp(0), labels={"session": "a"})]
    with pytest.raises(NotApplicable):
        choose_split(whole, DEPLOYABLE, load_dataset(whole, one), None)


@pytest.mark.parametrize(("label", "folds"), [("unit", 7), ("placement", 7), ("block", 5)])
def test_units_and_placements_are_left_out_one_by_one_whatever_the_task(tmp_path, label, folds):
    paths = [record(tmp_path / f"{place}.h5", *ramp(place, n=20), labels={label: place}) for place in range(7)]
    assert len(make_splits(load_dataset(force_task(), paths), label, 0)) == folds


def test_an_official_test_set_is_touched_by_split_roles_only(tmp_path):
    paths = [grasps(tmp_path, "train", seed=1), grasps(tmp_path, "test", seed=2)]
    for split, tested in (("object", 0), ("roles", 1)):
        result = evaluated(label_task(), paths, "logistic", split=split)
        assert set(result.sets["test"].recording.tolist()) == {tested}


def test_a_split_that_cannot_be_served_is_refused_with_those_that_can(tmp_path):
    paths = sessions(tmp_path)
    with pytest.raises(UsageError, match="in-session"):
        run(paths, "object")
    with pytest.raises(UsageError, match="shuffled"):
        run(paths[:1], "session")


def test_an_incomplete_recording_takes_no_part_unless_asked_for_and_the_row_says_so(tmp_path):
    why = "incomplete: force_torque: silent for 4 s from 2 s on"
    paths = sessions(tmp_path)
    for name, excluded in (("short", why), ("bad", "declared unreliable")):
        paths.append(record(tmp_path / f"{name}.h5", *ramp(7), session=name, excluded=excluded))
    out = run(paths)
    assert out.n_recordings == 3
    assert [n for text, n in out.counts.items() if "unreliable" in text] == [1]
    assert [text.startswith("1 of 5") and why in text for text in out.findings] == [True]
    taken = run(load_dataset(force_task(), paths, include_incomplete=True))
    assert taken.n_recordings == 4
    assert [text.startswith("1 of 5") and why in text for text in taken.findings] == [True]


@pytest.mark.parametrize(
    ("spoil", "error", "says"),
    [
        (lambda X, f: (X, np.full(len(f), 2.0)), DataError, "are 2.0"),
        (lambda X, f: (X, np.full(len(f), np.nan)), NotApplicable, "force sample"),
        (lambda X, f: (np.column_stack([X[:, :2], np.full(len(X), np.nan)]), f), DataError, "t2"),
    ],
)
def test_what_cannot_be_learned_from_is_refused_with_the_reason(tmp_path, spoil, error, says):
    with pytest.raises(error, match=says):
        run(sessions(tmp_path, make=lambda seed, n: spoil(*ramp(seed, n))))


def test_a_dropped_out_row_is_skipped_by_the_window_which_does_not_start_anew(tmp_path):
    X, force = ramp(0, n=100)
    X[50, 1] = np.nan
    data = load_dataset(force_task(), sessions(tmp_path, "ab", make=lambda *_, **__: (X, force)))
    one = filtered(data, make_splits(data, "session", 0)[0], 5)
    after = int(np.flatnonzero(one.row == 52)[0])
    np.testing.assert_allclose(one.X[after], X[[46, 47, 48, 49, 51, 52]].mean(axis=0), rtol=1e-12)
