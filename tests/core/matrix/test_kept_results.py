"""Result folders of released versions are read for ever: tables, comparisons, merging."""

import json
import shutil

import pytest

from tactbench.core.leaderboard.records import JSON_KEYS
from tactbench.core.matrix.store import Store
from tactbench.core.plugins.registry import load_registry
from tactbench.core.report.results import open_results
from tests.conftest import ROOT

KEPT = sorted((ROOT / "tests" / "kept_results").glob("v*"))
# As they were printed when the folders were made.
SCORES = {"ols": 0.031238878184719734, "time-index": 0.457609656841192, "mean": 1.6562052968776255}


@pytest.fixture(params=KEPT, ids=lambda path: path.name)
def kept(request, tmp_path):
    """A copy of a kept folder: looking at results may write beside them."""
    shutil.copytree(request.param, tmp_path / "kept")
    return "kept"


def test_one_is_kept():
    assert [path.name for path in KEPT] == ["v1"]


def rows(done):
    return {row["estimator"]: row for row in json.loads(done.stdout)}


def test_its_table_is_read_whole(verbs, kept):
    done = verbs("leaderboard", kept, "--format", "json")
    found = rows(done)
    assert {name: row["score"] for name, row in found.items()} == SCORES
    assert {row["status"] for row in found.values()} == {"done"}
    assert found["ols"]["ci_low"] < SCORES["ols"] < found["ols"]["ci_high"]
    assert "left out" not in done.stderr


def test_its_answers_are_compared(verbs, kept):
    (found,) = json.loads(verbs("compare", "ols", "mean", "--out", kept, "--format", "json").stdout)
    assert (found["score_a"], found["score_b"]) == (SCORES["ols"], SCORES["mean"])


def test_it_merges(verbs, kept):
    verbs("merge", kept, kept, "--out", "all")
    assert {name: row["score"] for name, row in rows(verbs("leaderboard", "all", "--format", "json")).items()} == SCORES


def test_a_report_is_made_of_all_its_rows(kept, tmp_path):
    results = open_results(Store(tmp_path / kept), load_registry())
    assert len(results.rows) == len(SCORES)
    assert all(set(JSON_KEYS) <= set(row) for row in results.rows)
