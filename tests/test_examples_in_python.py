"""The notebook and the scripts of examples/, and the page on Python, do what they say."""

import json
import re
import runpy
import sys

import pytest

import tactbench
from tactbench.core.recording.mapping import import_tables
from tests.conftest import ROOT
from tests.core.evaluation.made import sessions
from tests.here import make_here


@pytest.fixture
def here(monkeypatch, tmp_path):
    """Runs carry out cells in this process, in a folder of their own; figures need no screen."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    make_here(monkeypatch)


def execute(path):
    """Execute the code cells of a notebook in one namespace and return it."""
    names = {"__name__": "__main__"}
    for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
        if cell["cell_type"] == "code":
            exec(compile("".join(cell["source"]), str(path), "exec"), names)
    return names


NOTEBOOK = ROOT / "examples" / "first_look.ipynb"


def test_the_notebook_shows_the_score_of_its_data_set(here, monkeypatch, shared_data, tmp_path):
    monkeypatch.setenv("TACTBENCH_CACHE", str(tmp_path / "cache"))
    tactbench.dataset("eflesh-normal", root=shared_data / "eflesh")
    score = execute(NOTEBOOK)["found"].score
    assert f'"{score:.3f} N, by session' in NOTEBOOK.read_text(encoding="utf-8"), (
        "jupyter nbconvert --execute --inplace"
    )


def test_the_notebook_runs(here, monkeypatch, tmp_path):
    sessions(tmp_path, "abcde", n=400)
    found = tactbench.open_recordings(tmp_path)
    monkeypatch.setattr(tactbench, "dataset", lambda name, root: found, raising=False)
    names = execute(NOTEBOOK)
    assert names["found"].score < names["found"].trivial["mean"]
    # Scaled by the protocol and once more by the pipeline, polynomials of readings differ in their last digits.
    assert -names["own_loop"] == pytest.approx(list(names["found"].fold_scores.values()), rel=1e-6)
    assert {"StandardScaler+PolynomialFeatures+Ridge", "ridge"} < {row["estimator"] for row in names["table"]}


def test_a_forest_on_data_sets_is_a_short_script(here, monkeypatch, shared_data, tmp_path, capsys):
    pytest.importorskip("pandas")
    path = ROOT / "examples" / "extra_trees.py"
    import_tables(ROOT / "examples" / "mappings" / "eflesh-normal.yaml", root=shared_data / "eflesh", out=tmp_path)
    monkeypatch.setattr(tactbench, "dataset", lambda name: tactbench.open_recordings(tmp_path), raising=False)
    monkeypatch.setattr(sys, "argv", [str(path), "eflesh-normal:force"])
    frame = runpy.run_path(str(path))["lines"]
    assert [line["data set"] for line in frame] == ["eflesh-normal"]
    assert all(line["score"] < line["baseline"] for line in frame)
    assert "ci_low" in capsys.readouterr().out


def test_the_page_as_it_is_written(here, monkeypatch, tmp_path):
    sessions(tmp_path / "recordings", "abcde", n=200)
    page = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    names = {}
    for block in re.findall(r"```python\n(.*?)```", page, re.DOTALL):
        exec(compile(block, "python.md", "exec"), names)
