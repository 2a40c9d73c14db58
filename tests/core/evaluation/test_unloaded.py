"""Taring on the unloaded hold: offsets of a recording do not matter, and nothing after the hold changes a reading."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from tactbench.core.errors import NotApplicable
from tactbench.core.evaluation.dataset import load_dataset
from tactbench.core.evaluation.protocols import DEPLOYABLE
from tactbench.core.evaluation.sets import prepared
from tactbench.core.evaluation.splits import make_splits
from tactbench.core.spec.quantity import assumed

from .made import evaluated, force_task, held, record, roles

TASK = force_task(protocols=("deployable", "deployable-untared"), splits=("roles",))
HOLD, ROWS = 40, 200


def three(folder, offsets=(0.0, 0.0, 0.0), hold=0.4, start=0.0, **more):
    """A ramp after a hold, in three roles, each with an offset of its own."""
    force = np.concatenate([np.zeros(HOLD), np.linspace(0, 5, ROWS - HOLD)])

    def make(place):
        noise = 0.1 * np.random.default_rng(place).standard_normal((ROWS, 3))
        return force[:, None] * [1.0, 2.0, -1.0] + noise + np.multiply(offsets[place], [1, -2, 3]), force

    start, duration = assumed(start, "N", "a test"), assumed(2.0, "s", "a test")
    return roles(folder, make, scene=held("held", hold, start=start, duration=duration, samples=ROWS), **more)


def answered(paths, protocol):
    return evaluated(TASK, paths, protocol=protocol, split="roles")


def test_constant_offsets_of_recordings_change_nothing_where_they_are_tared(tmp_path):
    plain, shifted = three(tmp_path / "a"), three(tmp_path / "b", (100.0, -50.0, 7.0))
    same = [answered(paths, "deployable") for paths in (plain, shifted)]
    np.testing.assert_allclose(same[1].sets["test"].y_pred, same[0].sets["test"].y_pred, atol=1e-9)
    untared = [answered(paths, "deployable-untared").score for paths in (plain, shifted)]
    assert untared[1] > 10 * untared[0]
    assert [one.tare_s for one in same] == [0.4, 0.4]


@pytest.mark.parametrize("first_changed", [HOLD, 120, ROWS - 1])
def test_later_rows_change_no_earlier_reading(tmp_path, first_changed):
    """The readings of the fold under `deployable`, its window included, before the first row that was altered."""
    data = load_dataset(TASK, three(tmp_path / "a"))
    *others, table = data.tables
    altered = replace(table, X=table.X + 1000.0 * (np.arange(ROWS) >= first_changed)[:, None])

    def readings(source):
        (roles,) = make_splits(source, "roles", 1)
        fold = prepared(roles, source, DEPLOYABLE, 7, Counter())
        return fold.test.X[fold.test.row < first_changed]

    # The filter sums up about the set's mean, so that rounding knows of later rows; what was altered is 1000.
    changed = readings(replace(data, tables=(*others, altered)))
    np.testing.assert_allclose(changed, readings(data), rtol=0, atol=1e-10)


def test_recordings_without_a_hold_are_as_they_are_and_the_row_says_so(tmp_path):
    for name, how in {"no hold": {"hold": 0.0}, "loaded": {"start": 1.0}, "no clock": {"t_ns": None}}.items():
        paths = three(tmp_path / name, (5.0, 5.0, 5.0), **how)
        result = answered(paths, "deployable")
        assert result.tare_s is None
        assert any("not tared" in one for one in result.remarks)
        assert result.score == answered(paths, "deployable-untared").score


def test_recordings_of_which_some_cannot_be_tared_are_refused(tmp_path):
    paths = three(tmp_path / "a")
    bare = record(tmp_path / "bare.h5", np.ones((ROWS, 3)), np.ones(ROWS), role="train", session="bare")
    with pytest.raises(NotApplicable, match=r"3 of.*'bare'"):
        answered([*paths, bare], "deployable")
    assert answered([*paths, bare], "deployable-untared").score > 0
