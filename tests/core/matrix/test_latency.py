"""Leaving out the latency of single rows: the row says nothing of it, and has a key of its own."""

import sys
from dataclasses import replace

import pytest

from tactbench.core.matrix.keys import Keys
from tactbench.core.matrix.plan import plan_cells
from tactbench.core.matrix.store import Store
from tactbench.core.plugins.registry import load_registry
from tactbench.core.spec.matrix import MatrixSpec, TaskChoice
from tests.conftest import ROOT, Shell


@pytest.fixture
def trivial(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    import trivial

    yield trivial
    del sys.modules["trivial"]


def test_a_row_without_latency_says_so_and_is_not_taken_for_one_with(tmp_path, trivial, monkeypatch):
    shelf = trivial.install(tmp_path / "plugin")
    asked = ("run", "--repeats", "1", "--task", "nothing-asked", "--estimator", "nothing", "--recordings", str(shelf))
    shell = Shell(tmp_path)
    plugin = (str(tmp_path / "plugin"),)
    shell(*asked, "--no-latency", plugins=plugin)
    (row,) = Store(tmp_path / "tactbench-results").rows()
    assert (row["status"], row["latency_ms_p50"], row["latency_ms_p95"], row["latency_n"]) == ("done", None, None, None)
    assert row["score"] is not None
    again = shell(*asked, plugins=plugin)
    assert "1 computed now" in again.stderr
    (timed,) = Store(tmp_path / "tactbench-results").rows()
    assert timed["latency_n"] >= 20
    assert timed["score"] == row["score"]


def test_only_a_cell_without_latency_has_another_key():
    registry = load_registry()
    matrix = MatrixSpec(repeats=1, tasks=(TaskChoice(name="force"),))
    cell = plan_cells(matrix, ["icub"], registry)[0]
    without = plan_cells(matrix.model_copy(update={"latency": False}), ["icub"], registry)[0]
    assert without == replace(cell, latency=False)
    keys = Keys(registry)
    found = [keys.of_cell(one, ["0" * 64]) for one in (cell, replace(cell, latency=True), without)]
    assert found[0] == found[1] != found[2]
