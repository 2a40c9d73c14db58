"""The cell server: the same guards for a process that has threads."""

import os
import signal
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest
from tactbench.core.matrix.engines.served import Served

from tactbench.core.errors import Crashed, DataError, EngineError, TimedOut
from tactbench.core.matrix.engines.cell_server import CellServer, ServerEndedError
from tactbench.core.matrix.engines.request import Request, Setting, pack, unpack_reply
from tactbench.core.matrix.pool.limits import Limits
from tests.core.matrix.engines.patience import ending, gone, until
from tests.core.matrix.engines.remote_work import misbehave, process, read, square, what_is_loaded


@pytest.fixture
def server():
    server = CellServer(Setting("test", str(Path.cwd()), Limits(timeout_s=60)))
    yield server
    server.close()


def asked(server, work, item, **files):
    return unpack_reply(server.ask(pack(Request(work, item, **files)))).outcome


def test_every_item_has_one_outcome_whatever_it_does():
    items = ["fine", "raise", "abort", "lambda", "fine too"]
    outcomes = dict(Served(2, Limits(timeout_s=60)).each(misbehave, items))
    assert outcomes["fine"] == "fine is well"
    assert outcomes["fine too"] == "fine too is well"
    assert isinstance(outcomes["raise"], DataError)
    assert "Try again." in str(outcomes["raise"])
    assert isinstance(outcomes["abort"], Crashed)
    assert abs(outcomes["abort"].signal) == signal.SIGABRT
    assert isinstance(outcomes["lambda"], Exception)


def test_a_cell_that_hangs_is_ended_and_the_server_goes_on():
    outcomes = dict(Served(1, Limits(timeout_s=0.5)).each(misbehave, ["hang", "fine"]))
    assert isinstance(outcomes["hang"], TimedOut)
    assert outcomes["fine"] == "fine is well"


def test_a_cell_that_ends_its_server_has_crashed_and_the_others_are_right():
    outcomes = dict(Served(1, Limits()).each(misbehave, ["kill-parent", "fine"]))
    assert isinstance(outcomes["kill-parent"], Crashed)
    assert outcomes["kill-parent"].signal == signal.SIGKILL
    assert "twice" in outcomes["kill-parent"].message
    assert outcomes["fine"] == "fine is well"


def test_each_item_has_a_process_of_its_own_and_the_server_stays(server):
    first, second = asked(server, process, None), asked(server, process, None)
    assert first[0] != second[0]
    assert first[1:] == second[1:] == (server._process.pid, os.getpid())


def test_what_a_child_survives_the_server_loads_once_for_all(server):
    inherited = [asked(server, partial(what_is_loaded), item) for item in ("a", "a", "bomb", "trusted", "bomb", "b")]
    assert inherited == [["a"], ["a"], ["a"], ["a", "trusted"], ["a", "trusted"], ["a", "trusted", "b"]]


def test_a_server_that_sees_other_files_does_not_compute(server, tmp_path):
    there = tmp_path / "there"
    there.write_text("one")
    from tactbench.core.matrix.engines.sight import fingerprints

    files = fingerprints((there, tmp_path / "never was"))
    assert list(files) == [str(there)]
    assert asked(server, read, there, files=files) == "one"
    there.write_text("two")
    other = asked(server, read, there, files=files)
    assert isinstance(other, EngineError)
    assert "another file" in other.message
    there.unlink()
    assert "cannot read" in asked(server, read, there, files=files).message


def test_a_server_says_what_it_computes_with_otherwise():
    setting = Setting("test", "/no/such/folder", Limits(), {"the version of numpy": "0.1", "the source of acme": "1"})
    server = CellServer(setting)
    try:
        folder, numpy, acme = sorted(server.against, key=len, reverse=True)
    finally:
        server.close()
    assert "/no/such/folder" in folder
    assert "0.1 here" in numpy
    assert acme == "source of acme is missing there"


OWNER = """
import os, sys, threading
from pathlib import Path
from tactbench.core.matrix.pool.limits import Limits
from tactbench.core.matrix.engines.served import Served
from tests.core.matrix.engines.patience import gone, until
from tests.core.matrix.engines.remote_work import wait_for
for _ in Served(1, Limits()).each(wait_for, [(Path(sys.argv[1]), Path("/no/such/file"))], lambda: print(flush=True)):
    pass
"""


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT])
def test_server_and_cell_end_with_the_process_that_started_them(tmp_path, number):
    begun = tmp_path / "begun"
    with ending([sys.executable, "-c", OWNER, str(begun)], stderr=subprocess.PIPE) as owner:
        assert until(lambda: begun.exists() and begun.read_text())
        cell = int(begun.read_text())
        server = int(Path(f"/proc/{cell}/stat").read_text().rpartition(")")[2].split()[1])
        owner.send_signal(number)
        owner.communicate(timeout=30)
        assert until(lambda: gone(cell) and gone(server))


def test_a_server_that_cannot_start_says_why(monkeypatch):
    monkeypatch.setattr(sys, "executable", "/no/such/python")
    with pytest.raises(ServerEndedError, match="No such file"):
        CellServer(Setting("test", "/", Limits()))


def test_order_and_number_do_not_matter():
    outcomes = list(Served(3, Limits()).each(square, range(20)))
    assert sorted(outcomes) == [(number, number * number) for number in range(20)]
