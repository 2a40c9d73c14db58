"""Recordings: read once, then remembered; a changed, missing or damaged one is noticed."""

import os
import subprocess
import sys
import time

import h5py
import numpy as np
import pytest

from tactbench.core.errors import FormatError, MissingRecordingError
from tactbench.core.matrix.recorded import Recorded, stat_signature
from tactbench.core.recording.reader import content_digest
from tests.core.evaluation.made import record


@pytest.fixture
def recording(tmp_path):
    return record(tmp_path / "press.h5", np.ones((20, 3)))


def rested(memory):
    """Ten seconds later: nobody sleeps here."""
    return Recorded(memory, lambda: time.time_ns() + 10**10)


def test_the_digest_is_the_recordings_own_and_stays_when_it_is_remembered(tmp_path, recording):
    first = rested(tmp_path / "memory")
    assert first.digest(recording) == content_digest(recording)
    assert first.sensor_and_scene(recording) == ("made", None)
    first.save()
    again = Recorded(tmp_path / "memory")
    assert (again.digest(recording), again.sensor_and_scene(recording)) == (content_digest(recording), ("made", None))


def test_what_is_remembered_opens_no_file(tmp_path, recording):
    first = rested(tmp_path / "memory")
    before = first.digest(recording), first.sensor_and_scene(recording)
    first.save()
    text = f"""
import sys
from pathlib import Path
from tactbench.core.matrix.recorded import Recorded
recorded = Recorded(Path({str(tmp_path / "memory")!r}))
path = Path({str(recording)!r})
print((recorded.digest(path), recorded.sensor_and_scene(path)))
assert not {{"h5py", "numpy"}} & set(sys.modules), "a library was loaded"
"""
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == str(before)


def test_a_recording_made_now_is_remembered_with_its_writers_digest(tmp_path, recording):
    first = rested(tmp_path / "memory")
    first.digests[recording], first.made[recording] = "as the writer says", stat_signature(recording)
    first.save()
    assert Recorded(tmp_path / "memory").digest(recording) == "as the writer says"


def test_one_made_now_and_replaced_before_the_run_ended_is_read_again(tmp_path, recording):
    first = rested(tmp_path / "memory")
    first.digests[recording], first.made[recording] = "as the writer said", stat_signature(recording)
    record(recording, np.zeros((20, 3)))
    first.save()
    assert Recorded(tmp_path / "memory").digest(recording) == content_digest(recording)


def test_other_bytes_are_noticed(tmp_path, recording):
    first = rested(tmp_path / "memory")
    before = first.digest(recording)
    first.save()
    stat = recording.stat()
    record(recording, np.zeros((20, 3)))
    os.utime(recording, ns=(stat.st_atime_ns, stat.st_mtime_ns))
    assert Recorded(tmp_path / "memory").digest(recording) not in ("", before)


def test_one_that_is_gone_or_damaged_says_so(tmp_path, recording):
    first = rested(tmp_path / "memory")
    first.digest(recording)
    first.save()
    recording.write_bytes(b"no recording")
    with pytest.raises(FormatError):
        Recorded(tmp_path / "memory").digest(recording)
    recording.unlink()
    with pytest.raises(MissingRecordingError):
        Recorded(tmp_path / "memory").digest(recording)
    with pytest.raises(MissingRecordingError):
        Recorded(tmp_path / "memory").sensor_and_scene(recording)


def test_one_that_was_altered_is_refused_and_not_remembered(tmp_path, recording):
    first = rested(tmp_path / "memory")
    first.digest(recording)
    first.save()
    with h5py.File(recording, "r+") as file:
        file["streams/taxels/data"][3, 1] += 0.5
    again = rested(tmp_path / "memory")
    for _ in range(2):
        with pytest.raises(FormatError, match="content digest differs"):
            again.digest(recording)
