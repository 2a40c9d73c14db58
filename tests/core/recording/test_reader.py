"""Whatever a file is, reading it ends in what was written or in one clear error: never a crash, never a guess."""

import json
import random

import h5py
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tactbench.core.errors import FormatError, MissingRecordingError, RecordingError
from tactbench.core.recording.reader import content_digest, open_recording, read_meta
from tactbench.core.recording.salvage import salvage
from tactbench.core.recording.writer import RecordingWriter
from tactbench.core.samples import Block

DATA = np.random.default_rng(0).integers(0, 4096, (3000, 3))


def read_all(path):
    with open_recording(path) as recording:
        recording.verify()
        return [recording.read(name) for name in recording.stream_names]


@pytest.fixture
def good(write):
    return write(DATA, force=np.arange(3000.0), notes={"object": ["ball"] * 3000})


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(MissingRecordingError, match=r"nowhere\.h5"):
        open_recording(tmp_path / "nowhere.h5")
    with pytest.raises(FileNotFoundError):
        open_recording(tmp_path)
    with pytest.raises(MissingRecordingError):
        salvage(tmp_path / "nowhere.h5.partial")


@pytest.mark.parametrize("content", [b"", b"t,x\n1,2\n", b"\x89HDF\r\n\x1a\n", bytes(4096)])
def test_a_file_that_is_no_hdf5(tmp_path, content):
    (tmp_path / "x.h5").write_bytes(content)
    with pytest.raises(FormatError, match=r"x\.h5"):
        open_recording(tmp_path / "x.h5")
    with pytest.raises(FormatError, match=r"x\.h5"):
        salvage(tmp_path / "x.h5")


def test_cut_short_anywhere(good):
    whole = good.read_bytes()
    rng = random.Random(1)
    for length in sorted({0, 8, len(whole) - 1, *(rng.randrange(len(whole)) for _ in range(15))}):
        good.write_bytes(whole[:length])
        with pytest.raises(FormatError):
            read_all(good)


def test_damaged_anywhere(good):
    """Bytes are changed at random places: what is read is right, or the damage is told."""
    whole = good.read_bytes()
    before = read_all(good)
    rng = random.Random(2)
    told = 0
    for _ in range(60):
        damaged = bytearray(whole)
        for _ in range(rng.choice([1, 4])):
            damaged[rng.randrange(len(whole))] ^= rng.randrange(1, 256)
        good.write_bytes(damaged)
        try:
            after = read_all(good)
        except FormatError:
            told += 1
            continue
        for old, new in zip(before, after, strict=True):
            assert np.array_equal(old.data, new.data)
            assert np.array_equal(old.t_ns, new.t_ns)
            assert {name: list(column) for name, column in old.annotations.items()} == {
                name: list(column) for name, column in new.annotations.items()
            }
    assert told > 30  # most of the file is data and meta: the checks must have had something to do


def test_another_programs_hdf5(tmp_path):
    with h5py.File(tmp_path / "x.h5", "w") as file:
        file["data"] = np.arange(3)
    with pytest.raises(FormatError, match="tactbench import"):
        open_recording(tmp_path / "x.h5")


def _newer(file):
    file.attrs["format_version"] = 4


def _no_version(file):
    del file.attrs["format_version"]


def _unfinished(file):
    file.attrs["complete"] = False


def _no_meta(file):
    del file.attrs["meta"]


def _meta_no_json(file):
    file.attrs["meta"] = "{"


def _meta_unit(file):
    meta = json.loads(file.attrs["meta"])
    meta["sensor"]["streams"][0]["channels"][0]["unit"] = "furlong"
    file.attrs["meta"] = json.dumps(meta)


def _meta_field(file):
    file.attrs["meta"] = json.dumps(json.loads(file.attrs["meta"]) | {"colour": "red"})


def _no_streams(file):
    del file["streams"]


def _stream_is_data(file):
    del file["streams/taxels"]
    file["streams/taxels"] = np.arange(3)


def _no_data(file):
    del file["streams/taxels/data"]


def _other_width(file):
    del file["streams/taxels/data"]
    file["streams/taxels/data"] = np.zeros((3000, 4), dtype=np.uint16)


def _other_type(file):
    del file["streams/taxels/data"]
    file["streams/taxels/data"] = np.zeros((3000, 3))


def _fewer_times(file):
    file["streams/taxels/t_ns"].resize(2999, axis=0)


def _no_times(file):
    del file["streams/taxels/t_ns"]


def _soft_link(file):
    del file["streams/taxels/data"]
    file["streams/taxels/data"] = h5py.SoftLink("/streams/force_torque/data")


def _external_link(file):
    del file["streams/taxels"]
    file["streams/taxels"] = h5py.ExternalLink("other.h5", "/streams/taxels")


def _virtual(file):
    del file["streams/taxels/data"]
    layout = h5py.VirtualLayout((3000, 3), dtype=np.uint16)
    layout[:] = h5py.VirtualSource("other.h5", "/streams/taxels/data", (3000, 3))
    file["streams/taxels"].create_virtual_dataset("data", layout)


def _labels_of_floats(file):
    file["streams/taxels/annotations/weight"] = np.zeros(3000)


def _labels_too_few(file):
    file["streams/taxels/annotations/press"] = np.zeros(2999, dtype=int)


def _labels_no_text(file):
    del file["streams/taxels/annotations/object"]
    file["streams/taxels/annotations"].create_dataset(
        "object", data=[b"\xff\xfe"] * 3000, dtype=h5py.string_dtype("ascii")
    )


def _one_reading(file):
    file["streams/taxels/data"][100, 1] ^= 1


TAMPERED = [value for name, value in list(globals().items()) if name[0] == "_" != name[1] and callable(value)]


SAYS = {
    _newer: "newer tactbench",
    _unfinished: "not finished",
    _meta_unit: "furlong",
    _soft_link: "link to another place",
    _external_link: "link to another place",
    _virtual: "link to another place",
    _one_reading: "digest",
}


def _read_without_digest(path):
    with open_recording(path) as recording:
        for name in recording.stream_names:
            recording.read(name)


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # NumPy's, about what the tampered files hold
@pytest.mark.parametrize("tamper", TAMPERED, ids=lambda tamper: tamper.__name__.strip("_"))
def test_a_file_that_contradicts_itself(good, tamper):
    with h5py.File(good, "a") as file:
        tamper(file)
    with pytest.raises(FormatError) as caught:
        read_all(good) if tamper is _one_reading else _read_without_digest(good)
    assert "press.h5" in str(caught.value)
    assert SAYS.get(tamper, "") in str(caught.value)
    assert caught.value.hint


def test_a_stream_that_is_not_there(good):
    with open_recording(good) as recording, pytest.raises(FormatError, match="taxels, force_torque"):
        recording.read("electrodes")


def test_what_a_file_may_have_besides(good):
    """Others may add what they like; it is not read, and not part of the digest."""
    before = content_digest(good)
    with h5py.File(good, "a") as file:
        file["notes"] = "mine"
        file["streams/taxels"].attrs["colour"] = "red"
        file["streams/mine/data"] = np.arange(3)
    assert content_digest(good) == before
    read_all(good)


def test_meta_alone(good):
    assert read_meta(good).name == "press"


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_a_journal_cut_or_damaged_anywhere_keeps_what_was_before(tmp_path, make_meta, data):
    journal = tmp_path / "x.h5.partial"
    ends = []
    with RecordingWriter(tmp_path / "x.h5", make_meta(), replace=True) as writer:
        for number in range(5):
            writer.append(Block("taxels", np.arange(10) + 10 * number, np.full((10, 3), number)))
            ends.append(journal.stat().st_size)
        whole = journal.read_bytes()
    place = data.draw(st.integers(0, len(whole) - 1))
    damaged = bytearray(whole)
    if data.draw(st.booleans()):
        del damaged[place:]
    else:
        damaged[place] ^= data.draw(st.integers(1, 255))
    copy = tmp_path / "copy.partial"
    copy.write_bytes(damaged)
    sound = sum(end <= place for end in ends)
    try:
        with salvage(copy) as recording:
            rows = len(recording.stream("taxels")) if recording.stream_names else 0
            values = recording.read("taxels").data if rows else np.zeros((0, 3))
    except RecordingError:
        assert sound == 0
        return
    assert rows == 10 * sound
    assert np.array_equal(values[:, 0], np.arange(rows) // 10)
