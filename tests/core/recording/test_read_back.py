"""A recording holds what was handed in, or there is none: interrupted at any write, or on a disk that drops some."""

import gc
import shutil
import sys
from functools import partial

import numpy as np
import pytest

from tactbench.core.errors import MissingRecordingError, RecordingError
from tactbench.core.files import try_lock
from tactbench.core.recording import image
from tactbench.core.recording.mapping.importing import import_tables
from tactbench.core.recording.partial import rescue
from tactbench.core.recording.reader import open_recording
from tactbench.core.recording.writer import RecordingWriter
from tactbench.core.samples import Block, Quality
from tactbench.rigs.replay import RecordingFolder
from tests.core.recording.conftest import about

ROWS = np.arange(1200)
WRITES = {"write", "flush", "truncate", "fsync", "replace", "close", "__setitem__", "resize", "create_dataset"}
DATA = ROWS[:, None] % 4093 + np.arange(3)
MAPPING = """
version: 1
title: rows of counts
sensor: {name: pad, title: a pad, principle: capacitive, principle_source: {tag: assumed, reference: a test}}
clock: none
tables: {t: {files: "*.csv", read: {format: csv, header: false}}}
recording: {name: press, session: a}
streams:
  taxels:
    table: t
    channels: [{columns: [0, 1, 2], name: "t{column}", kind: taxel, unit: count}]
    annotations: {object: {column: 0}}
"""


def record(folder):
    with RecordingWriter(folder / "press.h5", about()) as writer:
        for first in range(0, len(ROWS), 600):
            rows = slice(first, first + 600)
            flags = np.full((600, 3), Quality.SUSPECT, dtype=np.uint8) if first else None
            writer.append(Block("taxels", ROWS[rows] * 1000, DATA[rows], flags))


def rescued(folder):
    shutil.copyfile(folder.parent / "kept.partial", folder / "press.h5.partial")
    rescue(folder / "press.h5.partial", folder / "press.h5")


def imported(folder):
    import_tables(folder.parent / "map.yaml", root=folder.parent, out=folder)


@pytest.fixture
def scene(tmp_path):
    """A folder beside which lie a journal to rescue and a table to import."""
    (tmp_path / "map.yaml").write_text(MAPPING)
    np.savetxt(tmp_path / "x.csv", DATA, fmt="%d", delimiter=",")
    with RecordingWriter(tmp_path / "whole.h5", about()) as writer:
        writer.append(Block("taxels", ROWS * 1000, DATA))
        shutil.copyfile(tmp_path / "whole.h5.partial", tmp_path / "kept.partial")
    (tmp_path / "out").mkdir()
    return tmp_path / "out"


def interrupt_at(place, write):
    """Carry out `write`, and raise KeyboardInterrupt at a call of a function that writes; return the places of all."""
    calls = []

    def count(frame, event, called):
        name = frame.f_code.co_name if event == "call" else called.__name__ if event == "c_call" else ""
        if name in WRITES and not frame.f_code.co_filename.endswith("weakref.py"):
            calls.append((name, frame.f_code, frame.f_lineno))
            if len(calls) == place:
                sys.setprofile(None)
                raise KeyboardInterrupt

    sys.setprofile(count)
    try:
        write()
    finally:
        sys.setprofile(None)
    return calls


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # in a destructor it is only printed
@pytest.mark.parametrize("write", [record, rescued, imported])
def test_an_interrupt_at_any_write_leaves_the_right_file_or_none(scene, write):
    """Each line that writes is interrupted when it runs first and when it runs last."""
    calls = list(enumerate(interrupt_at(-1, partial(write, scene)), 1))
    places = {*{call: place for place, call in calls}.values(), *{call: place for place, call in calls[::-1]}.values()}
    assert len(places) > 10
    for place in sorted(places):
        shutil.rmtree(scene)
        scene.mkdir()
        try:
            interrupt_at(place, partial(write, scene))
        except KeyboardInterrupt:
            gc.collect()
        if (scene / "press.h5").exists():
            with open_recording(scene / "press.h5") as recording:
                recording.verify()
                assert np.array_equal(recording.read("taxels").data, DATA)
        elif write is record:
            for journal in scene.glob("*.partial"):
                rescue(journal, scene / "left.h5")
                with open_recording(scene / "left.h5") as recording:
                    data = recording.read("taxels").data if recording.stream_names else DATA[:0]
                    assert np.array_equal(data, DATA[: len(data)])


@pytest.mark.parametrize(
    ("write", "name", "column"),
    [
        *((write, "_extend", "data") for write in (record, rescued, imported)),
        (record, "_extend", "quality"),
        (imported, "_annotate", "annotations/object"),
    ],
)
def test_rows_that_are_not_written_are_found_when_they_are_read_back(scene, monkeypatch, write, name, column):
    written = getattr(image, name)

    def drop(group, *given):
        """Write all rows but the last ones."""
        written(group, *given)
        if column in group:
            group[column][-5:] = "" if name == "_annotate" else 0
        return group.get(given[0])

    monkeypatch.setattr(image, name, drop)
    with pytest.raises(RecordingError, match="read back"):
        write(scene)
    assert not (scene / "press.h5").exists()


def test_the_next_import_ends_what_an_import_that_was_killed_has_begun(scene):
    imported(scene)
    replay = RecordingFolder(scene)
    for name in (".importing-a", ".placing-b"):
        (scene / name).mkdir()
        shutil.copyfile(scene / "press.h5", scene / name / f"{name[1:-2]}.h5")
    with pytest.raises(MissingRecordingError, match="interrupted"):
        replay.recordings()
    with (scene / ".importing-a" / ".lock").open("w") as lock:
        assert try_lock(lock.fileno())
        imported(scene)
        assert sorted(path.name for path in scene.iterdir()) == [".importing-a", "placing.h5", "press.h5"]
    imported(scene)
    assert sorted(path.name for path in scene.iterdir()) == ["placing.h5", "press.h5"]
    assert len(replay.recordings()) == 2
