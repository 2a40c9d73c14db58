"""The notebook and the scripts of examples/, and the page on Python, do what they say."""

import json
import re
import runpy
import sys
from functools import partial

import numpy as np
import pytest
from sklearn.ensemble import ExtraTreesRegressor

import tactbench
from tactbench.plugin import Block, ChannelSpec, StreamSpec
from tests.conftest import ROOT
from tests.core.evaluation.made import ramp, sensor, sessions, write
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
    for name in ("eflesh-normal", "eflesh-shear"):
        tactbench.dataset(name, root=shared_data / "eflesh")
    names, shown = execute(NOTEBOOK), NOTEBOOK.read_text(encoding="utf-8")
    for text in (f'"{names["found"].score:.3f} N, by session', f'"{names["windows"].score:.3f} N; delay'):
        assert text in shown, "jupyter nbconvert --execute --inplace"


def test_the_notebook_runs(here, monkeypatch, tmp_path):
    sessions(tmp_path / "normal", "abcde", n=400)
    X, force = ramp(1, n=400)
    times_ns = np.arange(400) * 10_000_000
    shear = StreamSpec(name="shear", channels=(ChannelSpec(name="shear", kind="force", unit="N"),))
    blocks = Block("taxels", times_ns, X), Block("shear", times_ns, force[:, None])
    presses = {"press": np.arange(400) // 40}
    path = write(tmp_path / "shear.h5", sensor(), *blocks, annotations=presses, reference=(shear,), session="a")
    made = {"eflesh-normal": tmp_path / "normal", "eflesh-shear": path}
    monkeypatch.setattr(tactbench, "dataset", lambda name, root: tactbench.open_recordings(made[name]), raising=False)
    names = execute(NOTEBOOK)
    assert names["found"].score < names["found"].trivial["mean"]
    # Scaled by the protocol and once more by the pipeline, polynomials of readings differ in their last digits.
    assert -names["own_loop"] == pytest.approx(list(names["found"].fold_scores.values()), rel=1e-6)
    assert {"StandardScaler+PolynomialFeatures+Ridge", "ridge"} < {row["estimator"] for row in names["table"]}


def test_models_on_data_sets_are_a_short_script(here, monkeypatch, shared_data, capsys):
    monkeypatch.setattr(sys, "argv", ["side_by_side.py", str(shared_data)])
    few = partial(ExtraTreesRegressor, n_estimators=2)
    monkeypatch.setattr("sklearn.ensemble.ExtraTreesRegressor", lambda many, **more: few(**more))
    table = runpy.run_path(str(ROOT / "examples" / "side_by_side.py"), run_name="__main__")["table"]
    assert {row["status"] for row in table if not row["is_baseline"]} == {"done"}
    assert len({row["data"] for row in table}) == 5
    assert "A = trees, B = window" in capsys.readouterr().out


def test_the_page_as_it_is_written(here, monkeypatch, tmp_path):
    sessions(tmp_path / "recordings", "abcde", n=200)
    page = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    names = {}
    for block in re.findall(r"```python\n(.*?)```", page, re.DOTALL):
        exec(compile(block, "python.md", "exec"), names)
