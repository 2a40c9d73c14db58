"""Cells on a Dask cluster: the rows of a local run, and what may go wrong."""

import json

import pytest
from distributed import LocalCluster

from tactbench.core.errors import EngineError, UsageError
from tactbench.core.matrix import dask
from tactbench.core.matrix.solve import Job
from tactbench.core.matrix.store import Store
from tactbench.core.pool import UNLIMITED
from tests.conftest import Shell, Verbs
from tests.core.cost.test_knobs import presses
from tests.core.matrix.test_evil_cells import ASKED, HONEST, decided
from tests.core.pool.patience import processes_in, until


def test_a_worker_gives_the_rows_of_a_local_run_and_a_cell_costs_itself_only(tmp_path):
    presses(tmp_path / "shelf")
    Verbs(tmp_path, here=True)(*ASKED, "--estimator", "ols", "--out", "local")
    done = Shell(tmp_path)(*ASKED, "--estimator", "evil-abort", "--estimator", "ols", "--engine", "dask", "--jobs", "1",
                           "--out", "dask", "--format", "json", plugins=("evil",), code=1)  # fmt: skip
    ends = {row["estimator"]: (row["status"], row["signal"]) for row in json.loads(done.stdout)}
    assert ends == {"evil-abort": ("crashed", 6), **dict.fromkeys(HONEST, ("done", None))}
    assert "Traceback" not in done.stderr
    assert "distributed" not in done.stderr
    there = decided(tmp_path / "dask")
    assert {name: there[name] for name in HONEST} == decided(tmp_path / "local")
    assert all(row["latency_n"] is None for row in Store(tmp_path / "dask").rows()), "it is never alone on its machine"
    assert until(lambda: not processes_in(tmp_path)), processes_in(tmp_path)


def test_an_address_without_a_scheduler_is_refused(monkeypatch):
    monkeypatch.setattr(dask, "CONNECT_S", 0.5)
    with pytest.raises(UsageError, match=r"tcp://127.0.0.1:1.*dask scheduler"):
        dask.Dask(1, UNLIMITED, "tcp://127.0.0.1:1").__enter__()


def test_a_worker_that_differs_is_named(monkeypatch):
    """One in this process, whose versions are looked at before those of the run."""
    found = iter([{"scipy": "9.9"}, {"scipy": "0.1"}])
    monkeypatch.setattr(dask, "environment", lambda: next(found))
    with LocalCluster(n_workers=1, processes=False, dashboard_address=None) as cluster:
        engine = dask.Dask(1, UNLIMITED, cluster.scheduler_address)
        with pytest.raises(UsageError, match=r"scipy 0.1"):
            engine.__enter__()


def test_a_worker_that_sees_other_recordings_computes_nothing(tmp_path):
    (path, *_) = sorted(presses(tmp_path / "shelf").glob("*.h5"))
    job = Job(None, None, None, (path,), ("another digest",), "", {})
    outcome = dask.carry_out(decided, job, str(tmp_path), UNLIMITED)
    assert type(outcome) is EngineError
    assert str(path) in str(outcome)
