"""Finished cells: what is kept comes back, the latest of each name, and nothing unreadable stops the rest."""

import json

import numpy as np
import pytest

from tactbench.core.matrix.store import Store
from tactbench.core.samples import Answers


def answers(n: int, seed: int = 0) -> Answers:
    rng = np.random.default_rng(seed)
    return Answers(
        y_true=rng.normal(size=n), y_pred=rng.normal(size=n), recording=np.arange(n) % 3, row=np.arange(n),
        fold=np.zeros(n, dtype=np.int64), time_s=np.arange(n) * 0.01, force_n=np.full(n, np.nan),
    )  # fmt: skip


def test_answers_come_back_by_role_bit_for_bit(tmp_path):
    kept = {"train": answers(50, 1), "test": answers(20, 2)}
    Store(tmp_path).keep("k1", {"cell": "a", "status": "done"}, kept)
    found = Store(tmp_path).answers("k1")
    assert set(found) == {"train", "test"}
    for role, one in kept.items():
        for name in ("y_true", "y_pred", "recording", "row", "fold", "time_s", "force_n"):
            assert np.array_equal(getattr(found[role], name), getattr(one, name), equal_nan=True), (role, name)


def test_the_latest_of_each_name_is_listed(tmp_path):
    store = Store(tmp_path)
    store.keep("k1", {"cell": "a", "status": "done", "score": 1.0}, {"test": answers(3)})
    store.keep("k2", {"cell": "b", "status": "done", "score": 2.0}, {"test": answers(3)})
    store.keep("k3", {"cell": "a", "status": "done", "score": 3.0}, {"test": answers(3)})
    assert [(row["cell"], row["score"]) for row in Store(tmp_path).rows()] == [("a", 3.0), ("b", 2.0)]


def test_an_unfinished_cell_is_listed_unless_it_was_finished(tmp_path):
    store = Store(tmp_path)
    store.keep("k1", {"cell": "a", "status": "done"}, {"test": answers(3)})
    unfinished = [{"cell": "a", "status": "failed"}, {"cell": "c", "status": "skipped"}]
    store.write("unfinished.json", json.dumps(unfinished))
    assert [(row["cell"], row["status"]) for row in store.rows()] == [("a", "done"), ("c", "skipped")]


@pytest.mark.parametrize("damage", [b"", b"not an HDF5 file", None])
def test_a_damaged_or_missing_shard_answers_nothing(tmp_path, damage):
    store = Store(tmp_path)
    store.keep("k1", {"cell": "a", "status": "done"}, {"test": answers(3)})
    shard = tmp_path / "cells" / "k1.h5"
    if damage is None:
        shard.unlink()
        assert store.rows() == []
    else:
        shard.write_bytes(damage)
    assert store.answers("k1") == {}


def test_an_index_line_cut_short_costs_that_line_only(tmp_path):
    store = Store(tmp_path)
    store.keep("k1", {"cell": "a", "status": "done"}, {"test": answers(3)})
    with (tmp_path / "index.jsonl").open("a") as index:
        index.write('{"key": "k2", "ro')
    assert [row["cell"] for row in Store(tmp_path).rows()] == ["a"]
