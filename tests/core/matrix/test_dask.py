"""Cells on a Dask cluster of two workers: the rows of a local run, and what may go wrong."""

import json

import pytest

from tactbench.core.errors import EngineError, UsageError
from tactbench.core.matrix import dask
from tactbench.core.matrix.solve import Job
from tactbench.core.matrix.store import Store
from tactbench.core.pool import UNLIMITED
from tests.conftest import Shell, Verbs
from tests.core.cost.test_ladder import presses
from tests.core.matrix.test_evil_cells import ASKED, ENDS, HONEST, decided, processes_in
from tests.core.pool.patience import until

STOPPED = ("evil-raise", "evil-abort", "evil-kill", "evil-import")


def test_two_workers_give_the_rows_of_a_local_run_and_a_cell_costs_itself_only(tmp_path):
    presses(tmp_path / "shelf")
    Verbs(tmp_path, here=True)(*ASKED, "--estimator", "ols", "--repeats", "2", "--out", "local")
    asked = [word for name in (*STOPPED, "ols") for word in ("--estimator", name)]
    done = Shell(tmp_path)(*ASKED, *asked, "--repeats", "2", "--engine", "dask", "--jobs", "2", "--out", "dask",
                           "--format", "json", plugins=("evil",), code=1)  # fmt: skip
    assert {row["estimator"] for row in json.loads(done.stdout)} == {*HONEST, *STOPPED}
    assert "Traceback" not in done.stderr
    assert "distributed" not in done.stderr
    local, there = decided(tmp_path / "local"), decided(tmp_path / "dask")
    assert {name: row for name, row in there.items() if name in HONEST} == local
    for row in Store(tmp_path / "dask").rows():
        if row["estimator"] in STOPPED:
            status, signal, says = ENDS[row["estimator"]]
            assert (row["status"], row["signal"]) == (status, signal)
            assert says in row["reason"]
        else:
            assert (row["latency_n"], row["fit_s"]) == (None, None), "it is never alone on its machine"
    assert until(lambda: not processes_in(tmp_path)), processes_in(tmp_path)


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:1", "nonsense://here"])
def test_an_address_without_a_scheduler_is_refused(monkeypatch, address):
    monkeypatch.setattr(dask, "CONNECT_S", 1.0)
    with pytest.raises(UsageError, match=rf"{address}.*dask scheduler"), dask.Dask(1, UNLIMITED, address):
        pass


def test_a_worker_that_differs_is_named(monkeypatch):
    monkeypatch.setattr(dask, "environment", lambda: {"python": "3.11", "scipy": "0.1"})
    monkeypatch.setattr(dask.Client, "run", lambda self, *_: {"tcp://there": {"python": "3.11", "scipy": "9.9"}})
    with (
        pytest.raises(UsageError, match=r"tcp://there cannot be used: here and there scipy 0.1 -> 9.9"),
        dask.Dask(1, UNLIMITED),
    ):
        pass


def test_a_worker_that_sees_other_recordings_computes_nothing(tmp_path):
    (path, *_) = sorted(presses(tmp_path / "shelf").glob("*.h5"))
    job = Job(None, None, None, (path,), ("another digest",), "", {})
    outcome = dask.carry_out(decided, job, str(tmp_path), UNLIMITED)
    assert type(outcome) is EngineError
    assert str(path) in str(outcome)
