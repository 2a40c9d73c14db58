"""A Dask cluster of our own: two workers on the loopback, and what may happen to them."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tactbench.core.errors import Crashed, DataError, TimedOut, UsageError
from tactbench.core.matrix.engines.dask import DaskEngine, open_dask
from tactbench.core.matrix.pool.limits import Limits
from tests.core.matrix.engines.patience import gone, until
from tests.core.matrix.engines.remote_work import kill_once, misbehave, process, square, wait_for


@pytest.fixture(scope="module")
def engine():
    with open_dask(None, 2, Limits(timeout_s=60)) as engine:
        yield engine


def test_the_outcomes_are_those_of_computing_here(engine):
    outcomes = list(engine.each(square, range(30)))
    assert sorted(outcomes) == [(number, number * number) for number in range(30)]


def test_cells_are_children_of_servers_of_two_workers(engine):
    did = []
    outcomes = [outcome for _, outcome in engine.each(process, range(8), meanwhile=lambda: did.append("meanwhile"))]
    assert did == ["meanwhile"]
    assert len({cell for cell, _, _ in outcomes}) == 8
    servers, workers = {server for _, server, _ in outcomes}, {worker for _, _, worker in outcomes}
    assert len(servers) == len(workers) == 2
    assert os.getpid() not in workers
    engine.close()
    assert until(lambda: all(gone(server) for server in servers)), "nothing of a run stays on the workers"
    assert not any(gone(worker) for worker in workers)


def test_whatever_a_cell_does_is_its_own_outcome(engine):
    items = ["fine", "raise", "abort", "lambda", "kill-parent", "fine too"]
    outcomes = dict(engine.each(misbehave, items))
    assert set(outcomes) == set(items)
    assert outcomes["fine"] == "fine is well"
    assert outcomes["fine too"] == "fine too is well"
    assert isinstance(outcomes["raise"], DataError)
    assert isinstance(outcomes["abort"], Crashed)
    assert abs(outcomes["abort"].signal) == signal.SIGABRT
    assert isinstance(outcomes["kill-parent"], Crashed)
    assert isinstance(outcomes["lambda"], Exception)


def test_an_item_that_cannot_be_sent_has_its_error(engine):
    outcomes = dict(engine.each(square, [2, sys, 3]))
    assert (outcomes[2], outcomes[3]) == (4, 9)
    assert "cannot be sent" in str(outcomes[sys])


def test_a_cell_that_hangs_is_ended_in_time(engine):
    short = DaskEngine(engine._client, Limits(timeout_s=0.5))
    outcomes = dict(short.each(misbehave, ["hang", "fine"]))
    assert isinstance(outcomes["hang"], TimedOut)
    assert outcomes["fine"] == "fine is well"


def test_cells_of_a_worker_that_is_killed_are_computed_elsewhere(engine, tmp_path):
    items = [(number, tmp_path) for number in range(12)]
    outcomes = dict(engine.each(kill_once, items))
    assert (tmp_path / "killed").exists()
    assert outcomes == {item: item[0] * item[0] for item in items}


def test_a_cell_that_kills_worker_after_worker_has_crashed_and_the_others_are_right(engine):
    outcomes = dict(engine.each(misbehave, ["one", "kill-worker", "two", "three"]))
    killer = outcomes.pop("kill-worker")
    assert isinstance(killer, Crashed)
    assert "again and again" in killer.message
    assert outcomes == {name: f"{name} is well" for name in ("one", "two", "three")}


def test_a_run_that_stops_in_the_middle_ends_its_cells(engine, tmp_path):
    begun = tmp_path / "begun"
    outcomes = engine.each(wait_for, [(begun, tmp_path / "never"), (tmp_path / "free", Path(os.devnull))])
    assert next(outcomes)[1] == "went"
    assert until(lambda: begun.exists() and begun.read_text())
    outcomes.close()
    assert until(lambda: gone(int(begun.read_text())))


def test_without_the_library_the_error_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(UsageError, match=r"pip install 'tactbench\[dask\]'"), open_dask(None, 1, Limits()):
        pass


def test_nothing_is_imported_before_it_is_asked_for():
    asked = "import sys, tactbench.core.matrix.engines.dask; print([n in sys.modules for n in ('dask', 'distributed')])"
    done = subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["[False,", "False]"]
