"""Whatever a file is, reading it ends in what was written or in one clear error: never a crash, never a guess."""

import json
import random
import zlib

import h5py
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tactbench.core.errors import FormatError, MissingRecordingError, RecordingError
from tactbench.core.recording.partial import read_journal
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
    for length in sorted({0, 8, len(whole) - 1, *(rng.randrange(len(whole)) for _ in range(60))}):
        good.write_bytes(whole[:length])
        with pytest.raises(FormatError):
            read_all(good)


def test_damaged_anywhere(good):
    """Bytes are changed at random places: what is read is right, or the damage is told."""
    whole = good.read_bytes()
    before = read_all(good)
    rng = random.Random(2)
    told = 0
    for _ in range(150):
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
    assert told > 75  # most of the file is data and meta: the checks must have had something to do


def test_another_programs_hdf5(tmp_path):
    with h5py.File(tmp_path / "x.h5", "w") as file:
        file["data"] = np.arange(3)
    with pytest.raises(FormatError, match="tactbench import"):
        open_recording(tmp_path / "x.h5")


def _newer(file):
    file.attrs["format_version"] = 3


def _no_version(file):
    del file.attrs["format_version"]


def _version_in_words(file):
    file.attrs["format_version"] = "one"


def _unfinished(file):
    file.attrs["complete"] = False


def _no_meta(file):
    del file.attrs["meta"]


def _meta_no_json(file):
    file.attrs["meta"] = "{"


def _meta_deep(file):
    file.attrs["meta"] = "[" * 100_000


def _meta_list(file):
    file.attrs["meta"] = "[]"


def _meta_numbers(file):
    file.attrs["meta"] = np.arange(3)


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


def _objects(file):
    del file["streams/taxels/data"]
    file["streams/taxels"].create_dataset("data", (3000, 3), dtype=h5py.vlen_dtype(np.int32))


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


def _external_bytes(file):
    del file["streams/taxels/data"]
    file["streams/taxels"].create_dataset("data", (3000, 3), dtype=np.uint16, external=[("/etc/passwd", 0, 18000)])


def _virtual(file):
    del file["streams/taxels/data"]
    layout = h5py.VirtualLayout((3000, 3), dtype=np.uint16)
    layout[:] = h5py.VirtualSource("other.h5", "/streams/taxels/data", (3000, 3))
    file["streams/taxels"].create_virtual_dataset("data", layout)


def _bomb(file):
    """A terabyte of nothing in a few bytes."""
    for name, rest in (("data", (3,)), ("t_ns", ())):
        dtype = file[f"streams/taxels/{name}"].dtype
        del file[f"streams/taxels/{name}"]
        file["streams/taxels"].create_dataset(name, (2**37, *rest), dtype=dtype, chunks=(1024, *rest))


def _labels_of_floats(file):
    file["streams/taxels/annotations/weight"] = np.zeros(3000)


def _labels_of_references(file):
    file["streams/taxels/annotations"].create_dataset("r", (3000,), dtype=h5py.ref_dtype)


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
    _external_bytes: "in another file",
    _virtual: "in another file",
    _bomb: "claims",
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


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_a_journal_cut_or_damaged_anywhere_keeps_what_was_before(tmp_path, make_meta, data):
    journal = tmp_path / "x.h5.partial"
    ends = []
    with RecordingWriter(tmp_path / "x.h5", make_meta()) as writer:
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


def test_a_journal_is_read_block_by_block(tmp_path, make_meta):
    with RecordingWriter(tmp_path / "x.h5", make_meta()) as writer:
        writer.append(Block("taxels", np.arange(2), np.ones((2, 3))))
        journal = read_journal(tmp_path / "x.h5.partial")
        assert json.loads(journal.text)["name"] == "press"
        ((stream, columns),) = journal.blocks()
    assert stream == "taxels"
    assert columns["data"].dtype == np.uint16


def _crafted(path, change):
    """Let `change` make something of the data's place in the streams of a sound recording."""
    with h5py.File(path, "r+") as file:
        group = file["streams/taxels"]
        change(group)
    with pytest.raises(FormatError) as caught:
        read_all(path)
    return str(caught.value)


def _replaced(group, name, **stored):
    del group[name]
    return group.create_dataset(name, **stored)


def test_a_chunk_larger_than_anything_in_it(good):
    def change(group):
        dtype = group["data"].dtype
        made = _replaced(
            group, "data", shape=(3000, 3), dtype=dtype, chunks=(2**25, 3), maxshape=(None, 3), compression="gzip"
        )
        made.id.write_direct_chunk((0, 0), zlib.compress(bytes(3000)))

    assert "has chunks of" in _crafted(good, change)


def test_a_chunk_that_inflates_to_more_than_it_claims(good):
    """HDF5 inflates a chunk to its end, whatever size it should have."""

    def change(group):
        dtype = group["data"].dtype
        made = _replaced(group, "data", shape=(2**19, 3), dtype=dtype, chunks=(2**19, 3), compression="gzip")
        made.id.write_direct_chunk((0, 0), zlib.compress(bytes(300 * 2**20)))

    assert "does not hold what it claims" in _crafted(good, change)


def test_more_values_than_a_file_of_its_size_means(good):
    def change(group):
        dtype = group["data"].dtype
        made = _replaced(group, "data", shape=(2**24, 3), dtype=dtype, chunks=(2**16, 3), compression="gzip")
        zeros = zlib.compress(bytes(2**16 * 3 * dtype.itemsize))
        for start in range(0, 2**24, 2**16):
            made.id.write_direct_chunk((start, 0), zeros)

    assert "claims 50331648 values" in _crafted(good, change)


def test_texts_that_share_one_place(good):
    """Every row refers to the same text of 64 KiB in the heap."""

    def change(group):
        notes = group["annotations"]
        del notes["object"]
        made = notes.create_dataset(
            "object", shape=(3000,), dtype=h5py.string_dtype("utf-8"), chunks=(3000,), compression="gzip"
        )
        made[0] = "x" * 2**16
        reference = zlib.decompress(made.id.read_direct_chunk((0,))[1])[:16]
        made.id.write_direct_chunk((0,), zlib.compress(reference * 3000))

    assert "claims texts of 196608000 bytes" in _crafted(good, change)


def test_an_altered_recording_is_refused_by_whoever_reads_its_digest(good):
    with h5py.File(good, "r+") as file:
        file["streams/taxels/data"][17, 1] += 1
    with pytest.raises(FormatError, match="content digest differs"):
        content_digest(good)


@pytest.mark.parametrize("name", ["ba\udcefd", "ba\\ud800d"])
def test_texts_that_nothing_can_print(good, name):
    with h5py.File(good, "r+") as file:
        text = file.attrs["meta"]
        file.attrs["meta"] = np.bytes_(text.replace(json.loads(text)["name"], name).encode("utf-8", "surrogateescape"))
    with pytest.raises(FormatError, match="damaged"):
        open_recording(good)


def test_texts_in_chunks_that_are_large_when_compressed_are_read(write):
    """What a row of texts takes in a chunk is its reference, 16 bytes, and no pointer of this process."""
    rows = 200_000
    texts = [f"{number:x}" for number in np.random.default_rng(0).integers(0, 2**63, rows)]
    path = write(np.arange(3 * rows).reshape(rows, 3) % 4096, force=np.arange(float(rows)))
    with h5py.File(path, "r+") as file:
        notes = file["streams/taxels"].require_group("annotations")
        made = notes.create_dataset(
            "object", data=texts, dtype=h5py.string_dtype("utf-8"), chunks=(rows,), compression="gzip"
        )
        assert made.id.get_chunk_info(0).size > 2**18
    with open_recording(path) as recording:
        assert recording.read("taxels").annotations["object"].tolist() == texts
