"""Replayed recordings: a fixed order, nothing unfinished, and a next step for an empty one."""

import os
from pathlib import Path

import pytest

from tactbench.core.errors import MissingRecordingError, UsageError
from tactbench.core.plugins.declared import declared_in
from tactbench.core.plugins.registry import load_object
from tactbench.plugin import RigContext
from tactbench.rigs.replay import tactbench_rigs


def replay(folder: Path | None):
    (descriptor,) = tactbench_rigs()
    return load_object(descriptor.where)(RigContext(recordings=folder))


def test_all_recordings_below_the_folder_in_a_fixed_order(tmp_path):
    for name in ("b/2.h5", "b/10.h5", "a.h5", "b-c/1.h5", "b/3.h5.partial", ".trash/9.h5", "notes.txt"):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(b"")
    found = [path.relative_to(tmp_path).as_posix() for path in replay(tmp_path).recordings()]
    assert found == ["a.h5", "b/10.h5", "b/2.h5", "b-c/1.h5"]


@pytest.mark.parametrize("look", [lambda folder: replay(folder).recordings(), declared_in], ids=["files", "tasks"])
def test_a_folder_that_vanishes_while_it_is_looked_through_is_passed_over(tmp_path, monkeypatch, look):
    (tmp_path / "gone").mkdir()
    (tmp_path / "a.h5").write_bytes(b"")
    listed = os.scandir

    def scandir(folder):
        if Path(folder) == tmp_path / "gone":
            Path(folder).rmdir()
        return listed(folder)

    monkeypatch.setattr(os, "scandir", scandir)
    assert list(look(tmp_path)) in ([tmp_path / "a.h5"], [])
    assert not (tmp_path / "gone").exists()


def test_without_a_folder_the_option_is_named():
    with pytest.raises(UsageError, match="--recordings DIR"):
        replay(None)


def test_a_folder_that_is_not_there_or_empty(tmp_path):
    with pytest.raises(MissingRecordingError, match="nowhere"):
        replay(tmp_path / "nowhere").recordings()
    with pytest.raises(MissingRecordingError, match="tactbench import"):
        replay(tmp_path).recordings()


def test_only_unfinished_recordings_are_mentioned_but_not_replayed(tmp_path):
    (tmp_path / "press.h5.partial").write_bytes(b"")
    with pytest.raises(MissingRecordingError, match="1 unfinished"):
        replay(tmp_path).recordings()
