"""What the pool promises: one outcome for each item, whatever an item does, and no process at the end."""

import os
import pickle
import subprocess
import sys
from pathlib import Path

import psutil
import pytest

from tactbench.core import pool
from tactbench.core.errors import Crashed, NotApplicable, OutOfMemory, Raised, TimedOut
from tactbench.core.pool import InProcess, Limits, Pool
from tactbench.core.pool.child import resident_mb
from tests.conftest import ROOT
from tests.core.pool.patience import ending, gone, until
from tests.core.pool.works import work

PATIENT = Limits(timeout_s=60.0, memory_mb=64)
"""For items that do not hang: a busy machine is no fault of theirs."""


@pytest.fixture(autouse=True)
def nobody_is_left():
    """Whatever a test does: no process and no descriptor stays."""
    list(Pool().each(work, ["fine"]))  # the fork server is there

    def descriptors():
        return len(list(Path("/proc/self/fd").iterdir()))

    before, opened = set(psutil.Process().children(recursive=True)), descriptors()
    yield
    assert until(lambda: not [one for one in psutil.Process().children(recursive=True) if one not in before])
    assert descriptors() <= opened


def apart(pool, items):
    """Yield outcomes of items that are a piece of work each."""
    with pool:
        for item in items:
            pool.submit(work, [item])
        yield from pool.outcomes()


def together(*whats, limits=PATIENT):
    """Return outcomes of items of one piece of work, in order."""
    found = list(Pool(1, limits).each(work, whats))
    assert [what for what, _ in found] == list(whats)
    return [outcome for _, outcome in found]


@pytest.mark.parametrize(
    ("what", "kind", "says", "number"),
    [
        ("raises", Raised, "ValueError", None),
        ("exits", Raised, "SystemExit", None),
        ("runs_out", OutOfMemory, "Memory ran out", None),
        ("refuses", NotApplicable, "another", None),
        ("aborts", Crashed, "SIGABRT", 6),
        ("terminates", Crashed, "SIGKILL", 9),
        ("vanishes", Crashed, "code 0", None),
        ("closes", Crashed, "no result", None),
        ("eats", OutOfMemory, "64 MB", None),
        ("feeds_a_child", OutOfMemory, "64 MB", None),
    ],
)
def test_an_item_costs_itself_only(what, kind, says, number):
    before, stopped, after = together("fine before", what, "fine after")
    assert (before, after) == ("fine before", "fine after")
    assert type(stopped) is kind
    assert says in str(stopped)
    assert getattr(stopped, "signal", None) == number
    if kind is not NotApplicable:
        assert stopped.status == {Raised: "failed", Crashed: "crashed", OutOfMemory: "out-of-memory"}[kind]
        assert 0 <= stopped.spent_s < 30.0
    if what in ("raises", "aborts"):
        assert f"in {what}" in stopped.traceback_text


def test_what_hangs_is_ended_and_says_where_it_was_and_what_it_printed():
    late, flooding, after = together("hangs", "floods", "fine", limits=Limits(timeout_s=1.0))
    assert type(late) is TimedOut
    assert "in hangs" in late.traceback_text
    assert late.log.startswith("hanging")
    assert 1.0 <= late.spent_s < 30.0
    assert type(flooding) is TimedOut
    assert len(flooding.log) <= 2**16
    assert after == "fine"


def test_what_an_item_prints_is_kept_of_it_alone(capfd):
    printed, raised = together("prints", "raises")
    assert printed.log.splitlines() == ["Python", "below", "child"]
    assert raised.log == ""
    assert capfd.readouterr() == ("", "")


def test_a_process_that_does_not_begin_is_given_up(monkeypatch):
    monkeypatch.setattr(pool, "POLL_S", 0.0)
    monkeypatch.setattr(pool, "START_S", -1.0)
    assert "did not start" in str(*together("fine"))


def test_memory_is_that_of_a_process_and_of_those_below_it():
    code = "import subprocess, sys; subprocess.run([sys.executable, '-c', 'print(1, flush=True); input()'])"
    with ending([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        process.stdout.readline()
        each = [psutil.Process(process.pid), *psutil.Process(process.pid).children()]
        assert len(each) == 2
        assert resident_mb(process.pid) == pytest.approx(sum(one.memory_info().rss for one in each) / 2**20, rel=0.2)
    assert resident_mb(process.pid) == 0


def test_pieces_share_no_process():
    pids = [pid for _, pid in apart(Pool(2), ["whoami 1", "whoami 2", "whoami 3"])]
    assert len({*pids, os.getpid()}) == 4


def test_no_more_pieces_than_jobs_are_at_work(tmp_path):
    found = dict(apart(Pool(2), [f"neighbours {tmp_path} {number}" for number in range(6)]))
    assert len(found) == 6
    assert max(found.values()) <= 2


def test_pieces_begin_in_order(tmp_path):
    list(apart(Pool(1), [f"neighbours {tmp_path} {number}" for number in range(3)]))
    begun = sorted(tmp_path.glob("begun-*"), key=lambda path: path.stat().st_mtime_ns)
    assert [path.name for path in begun] == ["begun-0", "begun-1", "begun-2"]


def test_who_forks_is_heard_once_and_what_is_left_in_its_group_ends_with_it():
    forked, left, after = together("forks", "leaves", "fine")
    assert (forked, after) == ("one", "fine")
    assert until(lambda: gone(left))


def test_what_cannot_be_sent_has_its_error():
    found = dict(apart(Pool(1), ["fine", "unspeakable", sys]))
    assert found.pop("fine") == "fine"
    assert all("pickle" in str(error) for error in found.values())


def test_an_exception_of_a_plugin_needs_none_of_its_classes_here(tmp_path, monkeypatch):
    (tmp_path / "strange_plugin.py").write_text(
        "class Own(Exception):\n    pass\n\ndef fail():\n    raise Own('the pad came off')\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    (error,) = together("imports_and_fails strange_plugin")
    assert type(pickle.loads(pickle.dumps(error))) is Raised
    assert str(error).startswith("Own:")
    assert "strange_plugin.py" in error.traceback_text
    assert "strange_plugin" not in sys.modules


def test_a_device_has_time_to_be_closed(tmp_path):
    path = tmp_path / "device"
    (late,) = together(f"holds {path}", limits=Limits(timeout_s=0.3, grace_s=20.0))
    assert type(late) is TimedOut
    assert path.read_text() == "closed"


def test_an_iteration_given_up_ends_everybody(tmp_path):
    begun = tmp_path / "begun"
    running = apart(Pool(2, Limits(grace_s=20.0)), [f"hangs {begun}", "fine", "leaves", "hangs"])
    assert next(running) == ("fine", "fine")
    _, left = next(running)
    assert until(begun.exists)
    running.close()
    assert until(lambda: gone(left) and gone(int(begun.read_text())))


OWNER = """
import multiprocessing, sys
from tactbench.core.pool import Pool, _context
from tests.core.pool.works import work
if sys.argv[1] != "default":
    multiprocessing.set_start_method(sys.argv[1])
with Pool(2) as pool:
    for item in ("fine", "aborts", "raises"):
        pool.submit(work, [item])
    for item, outcome in pool.outcomes():
        print(f"{item}: {type(outcome).__name__}", flush=True)
print(_context().get_start_method())
"""
"""A script that guards nothing by ``if __name__ == "__main__"``."""


@pytest.mark.parametrize("method", ["default", "spawn"])
def test_a_script_that_guards_nothing_may_use_any_start_method(tmp_path, method):
    script = tmp_path / "script.py"
    script.write_text(OWNER)
    done = subprocess.run([sys.executable, str(script), method], env={**os.environ, "PYTHONPATH": str(ROOT)},
                          cwd=tmp_path, capture_output=True, text=True, timeout=100)  # fmt: skip
    started = {"default": "forkserver"}.get(method, method)
    assert {*done.stdout.splitlines()} == {"aborts: Crashed", "fine: str", "raises: Raised", started}, done.stderr


def test_in_this_process_what_stops_an_item_is_its_outcome_and_items_may_be_added():
    engine, found = InProcess(), {}
    engine.submit(work, ["fine", "raises"])
    for item, outcome in engine.outcomes():
        found[item] = outcome
        if item == "fine":
            engine.submit(work, ["whoami"])
    assert type(found["raises"]) is Raised
    assert (found["fine"], found["whoami"]) == ("fine", os.getpid())
    with pytest.raises(KeyboardInterrupt):
        list(InProcess().each(work, ["interrupts"]))
