"""The cell server of a Dask worker: what it inherits, what it agrees in, and what it refuses."""

import os
import sys
from functools import partial
from pathlib import Path

import pytest

from tactbench.core.errors import EngineError
from tactbench.core.matrix.engines.cell_server import CellServer, ServerEndedError
from tactbench.core.matrix.engines.request import Request, Setting, pack, unpack_reply
from tactbench.core.matrix.pool.limits import Limits
from tests.core.matrix.engines.remote_work import process, read, what_is_loaded


@pytest.fixture
def server():
    server = CellServer(Setting("test", str(Path.cwd()), Limits(timeout_s=60)))
    yield server
    server.close()


def asked(server, work, item, **files):
    return unpack_reply(server.ask(pack(Request(work, item, **files)))).outcome


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


def test_a_server_that_cannot_start_says_why(monkeypatch):
    monkeypatch.setattr(sys, "executable", "/no/such/python")
    with pytest.raises(ServerEndedError, match="No such file"):
        CellServer(Setting("test", "/", Limits()))
