"""Dimension scales, by which other libraries read a recording with its coordinates."""

import h5py
import numpy as np

from tactbench.core.recording.reader import open_recording
from tests.core.evaluation.made import ramp, record


def test_every_column_has_dimension_scales_that_are_no_content(tmp_path):
    X, force = ramp(1, n=60)
    path = record(tmp_path / "a.h5", X, force, annotations={"press": np.arange(60)})
    with h5py.File(path) as file:
        stream = file["streams/taxels"]
        assert [list(dimension.keys()) for dimension in stream["data"].dims] == [["t_ns"], ["channel"]]
        assert list(stream["annotations/press"].dims[0].keys()) == ["t_ns"]
        assert stream["channel"].asstr()[:].tolist() == ["t0", "t1", "t2"]
    with open_recording(path) as one:
        digest = one.verify()
    with h5py.File(path, "r+") as file:
        file["streams/taxels/channel"][0] = "other"
    with open_recording(path) as one:
        assert one.verify() == digest


def test_a_stream_without_rows_and_without_clock_has_them(tmp_path):
    path = record(tmp_path / "a.h5", np.empty((0, 3)), t_ns=None)
    with h5py.File(path) as file:
        assert [list(dimension.keys()) for dimension in file["streams/taxels/data"].dims] == [["row"], ["channel"]]
