"""Cells on a Dask cluster: two workers on the loopback, and what may happen to them and to the scheduler."""

import os
import signal
import sys
import threading

import pytest
from dask import config

from tactbench.core.errors import Crashed, DataError, EngineError, TimedOut, UsageError
from tactbench.core.matrix import dask
from tactbench.core.matrix.dask import Dask, client_of
from tactbench.core.matrix.engine import EngineChoice
from tactbench.core.pool.limits import Limits
from tests.core.matrix.started import LIGHT, posing_as, started
from tests.core.pool.patience import ending, gone, until
from tests.core.pool.remote_work import is_imported, kill_once, misbehave, parent_of, process, square, wait_for, where

LIMITS = Limits(timeout_s=60)


@pytest.fixture(scope="module")
def address():
    with config.set({"distributed.worker.preload": [LIGHT]}), client_of(None, 2) as client:
        yield client.scheduler.address


@pytest.fixture(scope="module")
def engine(address):
    return Dask(2, LIMITS, address)


def test_the_outcomes_are_those_of_computing_here(engine):
    assert sorted(engine.each(square, range(12))) == [(number, number * number) for number in range(12)]
    assert list(engine.each(square, [])) == []


def test_a_cell_is_a_process_below_one_of_two_workers_and_knows_how_many_are_beside_it(engine):
    outcomes = [outcome for _, outcome in engine.each(process, range(8))]
    assert len({cell for cell, _, _, _ in outcomes}) == 8
    assert len({worker for _, _, worker, _ in outcomes}) == 2
    assert os.getpid() not in {worker for _, _, worker, _ in outcomes}
    assert {concurrency for _, _, _, concurrency in outcomes} == {2}
    assert until(lambda: all(gone(cell) for cell, _, _, _ in outcomes))
    assert not any(gone(worker) for _, _, worker, _ in outcomes)


def test_a_cell_imports_nothing_of_what_its_worker_needs(engine):
    outcomes = dict(engine.each(is_imported, ["tests.core.pool.remote_work", "distributed", "dask"]))
    assert outcomes == {"tests.core.pool.remote_work": True, "distributed": False, "dask": False}


def test_paths_count_from_the_folder_of_the_run(engine, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert dict(engine.each(where, [0])) == {0: str(tmp_path)}


def test_whatever_a_cell_does_is_its_own_outcome(engine):
    items = ["fine", "raise", "abort", "lambda", "kill-parent", "fine too"]
    outcomes = dict(engine.each(misbehave, items))
    assert set(outcomes) == set(items)
    assert outcomes["fine"] == "fine is well"
    assert outcomes["fine too"] == "fine too is well"
    assert isinstance(outcomes["raise"], DataError)
    assert outcomes["raise"].hint == "Try again."
    assert isinstance(outcomes["abort"], Crashed)
    assert outcomes["abort"].signal == signal.SIGABRT
    assert outcomes["abort"].spent_s >= 0
    assert isinstance(outcomes["kill-parent"], Crashed)
    assert "cannot be sent as JSON" in str(outcomes["lambda"])


def test_an_item_that_cannot_be_sent_has_its_error(engine):
    outcomes = dict(engine.each(square, [2, sys, 3]))
    assert (outcomes[2], outcomes[3]) == (4, 9)
    assert "cannot be sent" in str(outcomes[sys])


def test_a_cell_that_hangs_is_ended_in_time(address):
    outcomes = dict(Dask(2, Limits(timeout_s=0.5), address).each(misbehave, ["hang", "fine"]))
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


# A scheduler and workers that somebody has started


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    with started(tmp_path_factory.mktemp("cluster")) as cluster:
        yield cluster


def test_an_address_without_a_scheduler_is_refused(monkeypatch):
    monkeypatch.setattr(dask, "CONNECT_S", 1.0)
    with pytest.raises(UsageError, match=r"tcp://127\.0\.0\.1:1\b.*dask scheduler"):
        EngineChoice("dask", scheduler="tcp://127.0.0.1:1").check()
    with pytest.raises(UsageError, match="dask scheduler"):
        list(Dask(1, LIMITS, "tcp://127.0.0.1:1").each(square, [1]))
    with pytest.raises(UsageError, match="tcp://HOST"):
        EngineChoice("dask", scheduler="nonsense://here").check()


def test_a_scheduler_without_workers_is_refused(cluster, monkeypatch):
    monkeypatch.setattr(dask, "GATHER_S", 0.2)
    EngineChoice("dask", scheduler=cluster.address).check()
    with pytest.raises(UsageError, match=r"no worker.*dask worker"):
        list(Dask(1, LIMITS, cluster.address).each(square, [1]))


@pytest.fixture(scope="module")
def worker(cluster):
    return cluster.worker(light=True)


RUN = """
import sys
from pathlib import Path
from tactbench.core.matrix.dask import Dask
from tactbench.core.pool.limits import Limits
from tests.core.pool.remote_work import wait_for
list(Dask(1, Limits(), sys.argv[1]).each(wait_for, [(Path(sys.argv[2]), Path("/no/such/file"))]))
"""


def test_a_cell_ends_when_the_run_that_wanted_it_is_killed(cluster, worker, tmp_path):
    begun = tmp_path / "begun"
    with ending([sys.executable, "-c", RUN, cluster.address, str(begun)], env={**os.environ, "TMPDIR": str(tmp_path)}):
        assert until(lambda: begun.exists() and begun.read_text())
    assert until(lambda: gone(int(begun.read_text())))


def test_workers_may_come_late_and_one_that_differs_gets_nothing(cluster, worker, tmp_path):
    begun, second, go = tmp_path / "begun", tmp_path / "second", tmp_path / "go"
    old = posing_as(tmp_path / "old", "scipy", "0.1")
    on_refused = []

    def two_come():
        assert until(begun.exists, 60)
        refused = cluster.worker(old)
        log = cluster.folder / "dask_worker.log"
        assert until(lambda: "version of scipy is 0.1 there" in log.read_text(), 60)
        cluster.worker(light=True)
        assert until(second.exists, 60)  # both cells wait to be let go: on one worker that would never be
        for cell in (begun, second):
            assert until(cell.read_text)
            on_refused.append(parent_of(parent_of(int(cell.read_text()))) == refused.pid)
        go.touch()

    coming = threading.Thread(target=two_come)
    coming.start()
    outcomes = list(Dask(1, LIMITS, cluster.address).each(wait_for, [(begun, go), (second, go)]))
    coming.join()
    assert [outcome for _, outcome in outcomes] == ["went", "went"]
    assert on_refused == [False, False]


def test_a_worker_of_another_environment_is_named_and_nothing_is_computed(tmp_path):
    never = tmp_path / "never"
    with started(tmp_path / "own") as own:
        own.worker(posing_as(tmp_path / "old", "scipy", "0.1"))
        with pytest.raises(UsageError, match=r"127\.0\.0\.1.*scipy is 0\.1 there.*environment"):
            list(Dask(1, LIMITS, own.address).each(wait_for, [(never, tmp_path)]))
    assert not never.exists()


def test_when_the_scheduler_goes_the_cells_left_say_so(tmp_path, monkeypatch):
    monkeypatch.setattr(dask, "CONNECT_S", 2.0)
    with started(tmp_path) as own:
        own.worker(light=True)
        begun = tmp_path / "begun"
        items = [(tmp_path / "free", tmp_path), (begun, tmp_path / "never"), (tmp_path / "unsent", tmp_path)]
        outcomes = []
        for item, outcome in Dask(1, LIMITS, own.address, alone_s=2.0).each(wait_for, items):
            outcomes.append((item, outcome))
            if len(outcomes) == 1:
                assert until(lambda: begun.exists() and begun.read_text())
                own.scheduler.send_signal(signal.SIGKILL)
        assert {item for item, _ in outcomes} == set(items)
        ends = dict(outcomes)
        assert ends[items[0]] == "went"
        lost = ends[items[1]]
        assert isinstance(lost, EngineError)
        assert own.address in lost.message
        assert "what was finished is kept" in lost.hint
        assert until(lambda: gone(int(begun.read_text()))), "a cell ends with its worker"
