"""One run at a time in a folder, and nothing left of a killed one."""

import json
import os
import signal
import subprocess
import sys
import threading
from contextlib import contextmanager

import pytest

from tactbench.core.errors import FolderError
from tactbench.core.matrix.store import Store
from tactbench.core.recording.partial import Partial
from tests.core.pool.patience import ending

from .made import ended, kept, key

HOLDER = """
import os, sys
from pathlib import Path
if sys.argv[2] == "slow fork":  # before the lock's own: so long takes the system to let the child run
    os.register_at_fork(after_in_child=sys.stdin.readline)
from tactbench.core.matrix.store import Store
with Store(Path(sys.argv[1])).hold():
    child = os.fork() if "fork" in sys.argv[2] else None
    if child == 0:
        sys.stdin.read()  # an orphan that outlives its run
        os._exit(0)
    print("held", child, flush=True)
    sys.stdin.readline()
"""


@contextmanager
def holder(folder, how="alone"):
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    with ending([sys.executable, "-c", HOLDER, str(folder), how], **pipes) as process:
        assert process.stdout.readline().startswith("held")
        yield process


def test_a_second_run_is_refused_at_once_and_told_who_is_there(tmp_path):
    with holder(tmp_path) as process, pytest.raises(FolderError) as error, Store(tmp_path).hold():
        pass
    assert f"process {process.pid} on" in str(error.value)
    assert "since 20" in str(error.value)
    assert "--out DIR" in str(error.value)
    assert error.value.exit_code == 2


def test_the_command_line_refuses_too_and_reading_needs_no_lock(shell):
    folder = shell.folder / "tactbench-results"
    shell("run", "--repeats", "1", "--sensor", "icub", "--task", "grasp-stability")
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    with holder(folder):
        refused = shell("run", "--repeats", "1", "--sensor", "icub", "--task", "grasp-stability", code=2)
        assert "Another run is at work in tactbench-results: process" in refused.stderr
        assert "Traceback" not in refused.stderr
        assert "icub" in shell("leaderboard").stdout
    assert before == {path: path.read_bytes() for path in before}


@pytest.mark.parametrize("how", ["alone", "fork"])
def test_kill_9_lets_go_also_where_a_worker_lives_on(tmp_path, how):
    with holder(tmp_path, how) as process:
        process.send_signal(signal.SIGKILL)
        process.wait()
        with Store(tmp_path).hold() as store:
            kept(store, "a")
    assert not (tmp_path / "cache" / "held.json").exists()


def test_a_process_that_was_being_forked_when_its_run_was_killed_lets_go_before_anybody_is_refused(tmp_path):
    with holder(tmp_path, "slow fork") as process:
        process.send_signal(signal.SIGKILL)
        process.wait()
        wakes = threading.Timer(0.3, process.stdin.close)
        wakes.start()
        try:
            with Store(tmp_path).hold() as store:
                kept(store, "a")
        finally:
            wakes.join()
    assert [row["cell"] for row in Store(tmp_path).rows()] == ["a"]


def test_who_holds_it_may_enter_again_and_lets_go_at_the_end(tmp_path):
    store = Store(tmp_path)
    with store.hold(), store.hold(), pytest.raises(FolderError), Store(tmp_path).hold():
        pass
    with Store(tmp_path).hold():
        pass


def test_a_note_of_who_holds_it_that_makes_no_sense_does_no_harm(tmp_path):
    for nonsense in ("", "[]", json.dumps({"pid": "x"}), "[" * 5000):
        with Store(tmp_path).hold():
            (tmp_path / "cache" / "held.json").write_text(nonsense)
            with pytest.raises(FolderError, match="has not said which"), Store(tmp_path).hold():
                pass


def test_what_killed_runs_left_is_swept_and_nothing_else(tmp_path):
    dead = subprocess.run([sys.executable, "-c", "import os; print(os.getpid())"], capture_output=True, text=True)
    gone, alive = int(dead.stdout), os.getppid()
    with Store(tmp_path).hold() as store:
        kept(store, "a")
    made = tmp_path / "recordings" / "made"
    made.mkdir()
    swept = [
        tmp_path / "cells" / f".{key('b')}.h5.{gone}.partial",
        tmp_path / f".scores.json.{gone}.partial",
        made / "whole.h5.partial",
        made / "broken.h5.completing",
    ]
    left = [
        tmp_path / "cells" / f".{key('c')}.h5.{alive}.partial",
        tmp_path / "notes.partial",
        tmp_path / f".notes.{gone}.txt",
        made / "whole.h5",
        made / "broken.h5.partial",  # for `inspect --salvage`
        made / "growing.h5",
        made / "growing.h5.completing",
    ]
    for path in (*swept, *left):
        path.write_bytes(b"x")
    growing = Partial(made / "growing.h5.partial", "{}")
    with Store(tmp_path).hold():
        pass
    assert [path for path in swept if path.exists()] == []
    assert [path for path in left if not path.exists()] == []
    assert growing.path.exists()
    growing.close()
    with Store(tmp_path).hold():
        pass
    assert not growing.path.exists()


def test_a_folder_removed_or_moved_in_between_is_told_and_not_made_again(tmp_path):
    store = Store(tmp_path / "out")
    with store.hold():
        kept(store, "a")
        (tmp_path / "out").rename(tmp_path / "moved")
        for write in (lambda: kept(store, "b"), lambda: store.note(ended("c")), lambda: store.write("x", "")):
            with pytest.raises(FolderError, match="was removed or moved") as error:
                write()
            assert str(tmp_path / "out") in str(error.value)
    assert not (tmp_path / "out").exists()
    assert [row["cell"] for row in Store(tmp_path / "moved").rows()] == ["a"]
