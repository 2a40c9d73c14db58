"""A scheduler and workers that somebody has started: who may compute, and what happens when they go."""

import os
import signal
import sys
import threading
from pathlib import Path

import pytest

from tactbench.core.errors import EngineError, UsageError
from tactbench.core.matrix.engines import dask_cluster, dask_crew
from tactbench.core.matrix.engines.dask import open_dask
from tactbench.core.matrix.engines.sight import fingerprints
from tactbench.core.matrix.pool.limits import Limits
from tests.core.matrix.engines.patience import ending, gone, until
from tests.core.matrix.engines.remote_work import square, wait_for
from tests.core.matrix.engines.started import posing_as, started

LIMITS = Limits(timeout_s=60)


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    with started(tmp_path_factory.mktemp("cluster")) as cluster:
        yield cluster


def test_an_address_without_a_scheduler_is_refused(monkeypatch):
    monkeypatch.setattr(dask_cluster, "CONNECT_S", 1.0)
    with pytest.raises(UsageError, match=r"tcp://127\.0\.0\.1:1\b.*dask scheduler"):
        dask_cluster.check_scheduler("tcp://127.0.0.1:1")
    with pytest.raises(UsageError, match="dask scheduler"), open_dask("tcp://127.0.0.1:1", 1, LIMITS):
        pass
    with pytest.raises(UsageError, match="tcp://HOST"):
        dask_cluster.check_scheduler("nonsense://here")


def test_a_scheduler_without_workers_is_refused(cluster, monkeypatch):
    monkeypatch.setattr(dask_crew, "GATHER_S", 0.2)
    dask_cluster.check_scheduler(cluster.address)
    with open_dask(cluster.address, 1, LIMITS) as engine, pytest.raises(UsageError, match=r"no worker.*dask worker"):
        list(engine.each(square, [1]))


@pytest.fixture(scope="module")
def worker(cluster):
    return cluster.worker()


def test_a_worker_that_sees_other_files_is_refused(cluster, worker, tmp_path):
    seen = tmp_path / "seen"
    seen.write_text("here")
    with open_dask(cluster.address, 1, LIMITS) as engine:
        assert list(engine.each(Path.exists, [seen])) == [(seen, True)]
        with pytest.raises(UsageError, match=r"127\.0\.0\.1.*cannot read .*nowhere.* files of this run"):
            engine._crew.gather({**fingerprints(seen), str(tmp_path / "nowhere"): "0" * 16})


RUN = """
import sys
from pathlib import Path
from tactbench.core.matrix.engines.dask import open_dask
from tactbench.core.matrix.pool.limits import Limits
from tests.core.matrix.engines.remote_work import wait_for
with open_dask(sys.argv[1], 1, Limits()) as engine:
    list(engine.each(wait_for, [(Path(sys.argv[2]), Path("/no/such/file"))]))
"""


def test_a_cell_ends_when_the_run_that_wanted_it_is_killed(cluster, worker, tmp_path):
    begun = tmp_path / "begun"
    with ending([sys.executable, "-c", RUN, cluster.address, str(begun)], env={**os.environ, "TMPDIR": str(tmp_path)}):
        assert until(lambda: begun.exists() and begun.read_text())
    assert until(lambda: gone(int(begun.read_text())))


def test_workers_may_come_late_and_one_that_differs_gets_nothing(cluster, worker, tmp_path):
    begun, second, go = tmp_path / "begun", tmp_path / "second", tmp_path / "go"
    old = posing_as(tmp_path / "old", "scipy", "0.1")
    told = []

    def start_two():
        cluster.worker(old)
        cluster.worker()
        release.start()

    # Both cells wait to be let go, which happens once both have begun: on one worker that would never be.
    release = threading.Thread(
        target=lambda: until(lambda: begun.exists() and second.exists() and told, 60) and go.touch()
    )
    with open_dask(cluster.address, 1, LIMITS, told.append) as engine:
        outcomes = list(engine.each(wait_for, [(begun, go), (second, go)], meanwhile=start_two))
        release.join()
        assert [outcome for _, outcome in outcomes] == ["went", "went"]
        (sentence,) = told
        assert "version of scipy is 0.1 there" in sentence
        never = tmp_path / "never"
        with pytest.raises(UsageError, match=r"127\.0\.0\.1.*scipy is 0\.1 there.*environment"):
            list(engine.each(wait_for, [(never, go)]))
        assert not never.exists()


def test_when_the_scheduler_goes_the_cells_left_say_so(tmp_path, monkeypatch):
    monkeypatch.setattr(dask_cluster, "CONNECT_S", 2.0)
    with started(tmp_path) as own:
        own.worker()
        begun = tmp_path / "begun"
        with open_dask(own.address, 1, LIMITS) as engine:
            items = [(tmp_path / "free", tmp_path), (begun, tmp_path / "never"), (tmp_path / "unsent", tmp_path)]
            rounds = engine.each(wait_for, items)
            outcomes = [next(rounds)]
            assert until(lambda: begun.exists() and begun.read_text())
            own.scheduler.send_signal(signal.SIGKILL)
            outcomes += rounds
    assert [item for item, _ in outcomes] == items
    assert outcomes[0][1] == "went"
    for _, outcome in outcomes[1:]:
        assert isinstance(outcome, EngineError)
        assert own.address in outcome.message
        assert "what was finished is kept" in outcome.hint
    assert until(lambda: gone(int(begun.read_text()))), "a cell ends with its worker"
