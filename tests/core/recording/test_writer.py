"""A recording is whole or not there; what a crash leaves can be read."""

import os
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from tactbench.core.errors import RecordingError, RigError, UnwritableError
from tactbench.core.recording.partial import REMARK, rescue
from tactbench.core.recording.reader import open_recording
from tactbench.core.recording.writer import RecordingWriter
from tactbench.core.samples import Block
from tests.core.pool.patience import files_up_to
from tests.core.recording.conftest import about

ROWS = 50


def block(first=0, rows=ROWS, **change):
    n = np.arange(first, first + rows)
    return Block(**{"stream": "taxels", "t_ns": n * 1000, "data": n[:, None] * 7 + np.arange(3) * 13, **change})


def record(path, meta, *steps):
    """Write a recording step by step."""
    with RecordingWriter(path, meta) as writer:
        for step in steps:
            step(writer)


def appending(*place, **change):
    return partial(RecordingWriter.append, block=block(*place, **change))


def failing(_):
    raise RigError("the motor stalled")


def interrupted(_):
    raise KeyboardInterrupt


def revising(**change):
    return partial(RecordingWriter.revise, **change)


def losing_rows(writer):
    """Cut the journal, as a disk that loses what was written."""
    journal = Path(f"{writer.path}.partial")
    os.truncate(journal, journal.stat().st_size - 10)


@pytest.mark.parametrize(("fail", "simulated"), [(failing, False), (interrupted, False), (failing, True)])
def test_an_exception_leaves_no_file_but_the_journal_of_a_real_device(tmp_path, fail, simulated):
    path, journal = tmp_path / "press.h5", tmp_path / "press.h5.partial"
    kept = not simulated
    steps = (appending(0, 3), revising(session="late", remarks=("late",)), fail)
    with pytest.raises((RigError, KeyboardInterrupt)) as caught:
        record(path, about(simulated=simulated), *steps)
    assert [*tmp_path.iterdir()] == [journal] * kept
    if kept:
        assert "--rescue" in " ".join([str(caught.value), *getattr(caught.value, "__notes__", ())])
        rescue(journal, tmp_path / "rescued.h5")
        with open_recording(tmp_path / "rescued.h5") as recording:
            assert (recording.meta.remarks, recording.meta.session) == (("late", REMARK), "late")
            assert recording.meta.excluded.startswith("interrupted")  # as what Ctrl-C leaves: no evaluation takes it
            assert len(recording.stream("taxels")) == 3


def test_each_attempt_has_its_own_journal_and_no_recording_is_overwritten_unasked(tmp_path):
    """A crash left a journal; a second attempt succeeds; a third one ends while a recording is there."""
    path = tmp_path / "x.h5"
    with pytest.raises(RigError):
        record(path, about(), appending(0, 3), failing)
    kept = (tmp_path / "x.h5.partial").read_bytes()
    with pytest.raises(UnwritableError, match="exists already"):
        record(path, about(), appending(0, 5), lambda _: record(path, about(), appending()))
    assert [one.name for one in sorted(tmp_path.iterdir())] == ["x.h5", "x.h5.2.partial", "x.h5.partial"]
    assert (tmp_path / "x.h5.partial").read_bytes() == kept
    rescue(tmp_path / "x.h5.2.partial", tmp_path / "late.h5")
    with open_recording(path) as recording, open_recording(tmp_path / "late.h5") as late:
        assert (len(recording.stream("taxels")), len(late.stream("taxels"))) == (ROWS, 5)
    with pytest.raises(UnwritableError, match="exists already"):
        rescue(tmp_path / "x.h5.2.partial", path)
    with pytest.raises(UnwritableError, match="exists already"):
        record(path, about())


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"stream": "taxel"}, "'taxel'"),
        ({"data": np.zeros((ROWS, 4))}, "data"),
        ({"t_ns": None}, "'device'"),
        ({"t_ns": np.arange(ROWS) + 0.5}, "t_ns .float64"),
        ({"sequence": np.arange(ROWS - 1)}, "sequence"),
        ({"quality": np.ones((ROWS, 2))}, "quality"),
        ({"data": np.full((ROWS, 3), 0.5)}, "uint16"),
        ({"data": np.full((ROWS, 3), -1)}, "uint16"),
        ({"data": np.full((ROWS, 3), 65536)}, "uint16"),
        ({"stream": "force_torque", "data": np.full((ROWS, 1), np.nan)}, "MISSING"),
    ],
)
def test_a_block_that_does_not_fit_is_refused(tmp_path, wrong, says):
    with pytest.raises(RigError, match=says):
        record(tmp_path / "x.h5", about(), appending(**wrong))
    assert list(tmp_path.iterdir()) == []  # no row had come


@pytest.mark.parametrize(
    ("steps", "left"),
    [
        *(([revising(**change)], 0) for change in ({"plan": "none"}, {"drawn": {"x": np.nan}})),
        ([appending(), appending(ROWS), losing_rows], 1),
    ],
)  # fmt: skip
def test_what_cannot_be_said_or_has_lost_rows_is_refused(tmp_path, steps, left):
    with pytest.raises((RecordingError, RigError)):
        record(tmp_path / "x.h5", about(), *steps)
    assert len(list(tmp_path.iterdir())) == left, "only rows are kept"


@pytest.mark.parametrize(("blocks", "kept"), [(100, 16), (15, 15)], ids=["made", "completed"])
def test_a_disk_that_is_full(tmp_path, blocks, kept):
    """The size limit of a process stands for the disk: what came before it was full can be read."""
    data = np.random.default_rng(0).normal(size=(blocks, 1000, 1))
    steps = [partial(RecordingWriter.append, block=Block("force_torque", np.arange(1000), one)) for one in data]
    with files_up_to(2**18) as limit, pytest.raises(RecordingError, match=r"x\.h5") as caught:
        record(tmp_path / "x.h5", about(), *steps, lambda _: limit(2**16))
    assert "free space" in str(caught.value)
    assert "x.h5.partial --rescue" in " ".join([str(caught.value), *getattr(caught.value, "__notes__", ())])
    assert [one.name for one in tmp_path.iterdir()] == ["x.h5.partial"]
    rescue(tmp_path / "x.h5.partial", tmp_path / "y.h5")
    with open_recording(tmp_path / "y.h5") as recording:
        assert np.array_equal(recording.read("force_torque").data, np.concatenate(data[:kept]))


def test_a_mat_of_many_channels_is_read_in_bounded_memory(write):
    """1,100 rows of 64 x 64 eight-bit taxels, most of them at rest: 4.5 MB that compress to almost nothing."""
    data = np.zeros((1100, 4096), dtype=np.uint8)
    data[:, 105] = np.arange(1100) % 250
    with open_recording(write(data, dtype="uint8")) as recording:
        blocks = [block.data for block in recording.stream("taxels").blocks()]
    assert max(block.nbytes for block in blocks) <= 2**22
    assert np.array_equal(np.concatenate(blocks), data)
