"""Whatever a file is, reading it ends in what was written or in one clear error: never a crash, never a guess."""

import h5py
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tactbench.core.errors import FormatError, MissingRecordingError, RecordingError
from tactbench.core.recording.partial import rescue
from tactbench.core.recording.reader import open_recording
from tactbench.core.recording.writer import RecordingWriter
from tactbench.core.samples import Block
from tests.core.recording.conftest import about

DATA = np.random.default_rng(0).integers(0, 4096, (3000, 3))


def read_all(path):
    with open_recording(path) as recording:
        recording.verify()
        for name in recording.stream_names:
            recording.read(name)


@pytest.fixture
def good(write):
    return write(DATA, force=np.arange(3000.0), notes={"object": np.repeat("ball", 3000)})


@pytest.mark.parametrize("read", [open_recording, lambda path: rescue(path, path.with_name("y.h5"))])
def test_a_file_that_is_not_there_or_no_recording(tmp_path, read):
    for path in (tmp_path / "nowhere.h5", tmp_path):
        with pytest.raises(MissingRecordingError, match=path.name):
            read(path)
    path = tmp_path / "x.h5"
    with h5py.File(path, "w") as file:
        file["data"] = np.arange(3)
    for content in (path.read_bytes(), b"t,x\n1,2\n", b"\x89HDF\r\n\x1a\n"):
        path.write_bytes(content)
        with pytest.raises(FormatError, match=r"x\.h5"):
            read(path)


def test_cut_short_anywhere(good):
    whole = good.read_bytes()
    for length in (0, 8, len(whole) - 1, *np.random.default_rng(1).integers(len(whole), size=15)):
        good.write_bytes(whole[:length])
        with pytest.raises(FormatError):
            read_all(good)


def _wider(file):
    del file["streams/taxels/data"]
    file["streams/taxels/data"] = np.zeros((3000, 4), dtype=np.uint16)


def _one_reading(file):
    file["streams/taxels/data"][100, 1] ^= 1


@pytest.mark.parametrize(
    ("tamper", "says"),
    [
        (lambda file: file.attrs.update({"format_version": 5}), "newer tactbench"),
        (lambda file: file.attrs.update({"meta": file.attrs["meta"][:-1] + ',"colour":"red"}'}), "colour"),
        (lambda file: file.pop("streams/taxels/data"), "uint16"),
        (_wider, r"\(3000, 3\)"),
        (_one_reading, "digest"),
    ],
)
def test_a_file_that_contradicts_itself(good, tamper, says):
    with h5py.File(good, "a") as file:
        tamper(file)
    with pytest.raises(FormatError, match=rf"press\.h5.*{says}") as caught:
        read_all(good)
    assert caught.value.hint


@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.floats(0, 1, exclude_max=True), st.integers(0, 255))
def test_a_journal_cut_or_damaged_anywhere_keeps_what_was_before(tmp_path, share, flip):
    journal, ends = tmp_path / "x.h5.partial", []
    for name in ("x.h5", "copy.h5"):
        (tmp_path / name).unlink(missing_ok=True)
    with RecordingWriter(tmp_path / "x.h5", about()) as writer:
        writer.revise(labels={"object": "ball"})
        for number in range(5):
            n = np.arange(10) + 10 * number
            data = n[:, None].repeat(3, 1)
            writer.append(Block("taxels", n, data, (data % 2).astype(np.uint8), device_ns=n * 7))
            ends.append(journal.stat().st_size)
        whole = journal.read_bytes()
    place = int(share * len(whole))
    rest = bytes([whole[place] ^ flip]) + whole[place + 1 :] if flip else b""
    (tmp_path / "copy.partial").write_bytes(whole[:place] + rest)
    n = np.arange(10 * sum(end <= place for end in ends))
    try:
        rescue(tmp_path / "copy.partial", tmp_path / "copy.h5")
        with open_recording(tmp_path / "copy.h5") as recording:
            meta, taxels = recording.meta, recording.read("taxels")
    except RecordingError:
        assert not len(n)
        return
    assert meta.labels == {"object": "ball"}
    assert np.array_equal(taxels.data[:, 0], n)
    assert np.array_equal(taxels.device_ns, n * 7)
    assert np.array_equal(taxels.quality[:, 0], n % 2)
