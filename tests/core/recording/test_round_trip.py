"""What is written is what is read, whatever it is and however it was cut into blocks."""

import itertools
import tempfile
from pathlib import Path

import h5py
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tactbench.core.recording.format import canonical, piece_rows
from tactbench.core.recording.reader import content_digest, open_recording, read_meta
from tactbench.core.recording.writer import RecordingWriter, write_recording
from tactbench.core.samples import Block
from tests.core.recording.conftest import about

DTYPES = ("uint8", "uint16", "int16", "int32", "float32", "float64")
text = st.text(st.characters(blacklist_characters="\0", blacklist_categories=("Cs",)), max_size=12)
scalar = st.one_of(text, st.integers(-(2**53), 2**53), st.floats(allow_nan=False, allow_infinity=False))


@st.composite
def recordings(draw):
    """A meta, the whole of its one stream, and where it is cut into blocks."""
    rows, channels = draw(st.integers(0, 40)), draw(st.integers(1, 4))
    dtype, timed = draw(st.sampled_from(DTYPES)), draw(st.booleans())
    finite = {"allow_infinity": False} if "float" in dtype else None
    data = draw(arrays(dtype, (rows, channels), elements=finite))
    flags = draw(arrays(np.uint8, data.shape, elements=st.integers(0, 15))) if draw(st.booleans()) else None
    meta = about(
        channels, dtype, clock="host" if timed else "none", reference=(), session=draw(text),
        labels=draw(st.dictionaries(text, scalar, max_size=3)), remarks=tuple(draw(st.lists(text, max_size=2))),
        drawn=draw(st.dictionaries(text, scalar, max_size=3)),
    )  # fmt: skip
    times = np.cumsum(draw(arrays(np.int64, rows, elements=st.integers(0, 2**40)))) if timed else None
    cuts = [0, *sorted(draw(st.lists(st.integers(0, rows), max_size=3))), rows]
    notes = np.array(draw(st.lists(text, min_size=rows, max_size=rows)), dtype=np.str_)
    return meta, times, data, flags, cuts, notes


@settings(max_examples=20)
@given(recordings())
def test_round_trip(made):
    meta, times, data, flags, cuts, notes = made
    with tempfile.TemporaryDirectory() as folder:
        blocks = []
        for first, last in itertools.pairwise(cuts):
            part = slice(first, last)
            marked = flags is not None and flags[part].any()  # quality may begin at any block
            blocks.append(Block("taxels", None if times is None else times[part], data[part],
                                flags[part] if marked else None))  # fmt: skip
        with RecordingWriter(Path(folder) / "x.h5", meta) as writer:
            for block in blocks:
                writer.append(block)
        labels = {"object": notes, "press": np.arange(len(data))}
        write_recording(Path(folder) / "y.h5", meta, blocks, {"taxels": labels})
        for name, expected in (("x.h5", {}), ("y.h5", labels)):
            with open_recording(Path(folder) / name) as recording:
                recording.verify()
                assert recording.meta == read_meta(recording.path) == meta
                read = recording.read("taxels")
            # Bytes, not values: NaN and the sign of zero must survive too.
            assert (read.data.dtype, read.data.tobytes()) == (data.dtype, data.tobytes())
            assert np.array_equal(read.t_ns, times)  # of None too
            assert np.array_equal(read.quality, flags if flags is not None and flags.any() else None)
            assert read.annotations.keys() == expected.keys()
            assert all(np.array_equal(read.annotations[label], expected[label]) for label in expected)
        assert sorted(one.name for one in Path(folder).iterdir()) == ["x.h5", "y.h5"]


def test_the_digest_is_of_what_is_said_not_of_the_file(tmp_path):
    """Blocks, the name and what was computed on the way do not matter; one bit of one reading does."""
    assert canonical({"b": [1.5, "ä"], "a": 1}) == '{"a":1,"b":[1.5,"ä"]}'

    def digest(name, data, step):
        later = {"provenance": {"host": name}, "drawn": {"solver_residual": 1e-9 * step}}
        with RecordingWriter(tmp_path / name, about(name=name, **later)) as writer:
            for rows in np.array_split(np.arange(100), step):
                writer.append(Block("taxels", rows * 1000, data[rows], np.zeros_like(data[rows])))
        return content_digest(tmp_path / name)

    data = np.arange(300, dtype=np.uint16).reshape(100, 3)
    whole = digest("a.h5", data, 1)
    assert digest("b.h5", data, 7) == whole
    data[50, 1] ^= 1
    assert digest("changed.h5", data, 1) != whole


def test_an_ordinary_viewer_finds_signal_axes_units_and_names(write):
    """What h5py alone sees, without tactbench: gzip and shuffle, NeXus attributes, plain types."""
    with h5py.File(write(np.ones((5, 3), dtype=int), force=np.arange(5))) as file:
        taxels, force = file["streams/taxels"], file["streams/force_torque"]
        assert (taxels.attrs["signal"], taxels.attrs["axes"].tolist()) == ("data", ["t_ns", "."])
        assert [one.attrs["units"] for one in (taxels["data"], taxels["t_ns"], force["data"])] == ["count", "ns", "N"]
        assert [list(dimension.keys()) for dimension in taxels["data"].dims] == [["t_ns"], ["channel"]]
        assert taxels["channel"].asstr()[:].tolist() == ["t0", "t1", "t2"]


def test_pieces_are_of_some_two_million_values_in_whole_chunks():
    assert [piece_rows(channels) for channels in (1, 128, 129, 256, 2048, 4096)] == [
        16384, 16384, 15360, 8192, 1024, 1024,
    ]  # fmt: skip
